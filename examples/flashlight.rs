//! A dark cellar and a torch in your hand: all that is not in its beam is lit by bounced light.

use bevy::{input::mouse::MouseWheel, prelude::*};
use bevy_gi::prelude::*;
use bevy_gi_tools::{
    adapter,
    controls::{ControlsPlugin, flying},
    scenes::cellar::{self, Torch},
};

/// How fast the hand follows the eye, a second.
const FOLLOW: f32 = 9.0;

fn main() {
    adapter::require();
    App::new()
        .add_plugins((
            DefaultPlugins,
            GiPlugins,
            ControlsPlugin {
                help: "F: torch on/off   L: leave it here / take it up   mouse wheel: its beam",
            },
        ))
        .insert_resource(ClearColor(Color::BLACK))
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(GiSettings {
            technique: GiTechnique::new("hints"),
            replace_ambient: true,
            sky: GiSky::Black,
            ..default()
        })
        .insert_resource(RadianceHintsSettings::flashlight())
        .insert_resource(Carried(true))
        .add_systems(Startup, setup)
        .add_systems(Update, (keys, carry).chain())
        .run();
}

fn setup(mut commands: Commands) {
    // The cellar, and a `GiVolume` around it.
    commands.queue(cellar::build);
    let view = cellar::SCENE.view;
    let eye = Transform::from_translation(view().eye).looking_at(view().look, Vec3::Y);
    commands.spawn((Camera3d::default(), GiCamera::default(), flying(view())));
    commands.spawn((cellar::torch(), in_hand(&eye)));
}

/// Where the hand is, a little to the right of the eye and below it.
fn in_hand(eye: &Transform) -> Transform {
    let at = eye.translation + eye.rotation * Vec3::new(0.25, -0.22, 0.0);
    eye.with_translation(at)
}

/// Whether the torch is in the hand.
#[derive(Resource)]
struct Carried(bool);

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut wheel: MessageReader<MouseWheel>,
    mut torch: Single<(&mut SpotLight, &mut Visibility), With<Torch>>,
    mut carried: ResMut<Carried>,
) {
    let (light, visibility) = &mut *torch;
    if keys.just_pressed(KeyCode::KeyF) {
        visibility.toggle_visible_hidden();
    }
    if keys.just_pressed(KeyCode::KeyL) {
        carried.0 = !carried.0;
    }
    let turned: f32 = wheel.read().map(|event| event.y).sum();
    if turned != 0.0 {
        light.outer_angle = (light.outer_angle - 0.03 * turned).clamp(0.1, 1.0);
        light.inner_angle = 0.45 * light.outer_angle;
    }
}

/// The hand follows the eye, softly; a torch at rest is not touched, so that its light can rest, too.
fn carry(
    time: Res<Time>,
    carried: Res<Carried>,
    eye: Single<&Transform, (With<GiCamera>, Without<Torch>)>,
    mut torch: Single<&mut Transform, With<Torch>>,
) {
    let to = in_hand(&eye);
    let apart =
        torch.translation.distance(to.translation) + torch.rotation.angle_between(to.rotation);
    if !carried.0 || apart < 1e-3 {
        return;
    }
    let share = 1.0 - (-FOLLOW * time.delta_secs()).exp();
    torch.translation = torch.translation.lerp(to.translation, share);
    torch.rotation = torch.rotation.slerp(to.rotation, share);
}
