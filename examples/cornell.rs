//! The Cornell box in a window, with a light and a box that move.

use bevy::prelude::*;
use bevy_gi::prelude::*;
use bevy_gi_tools::{
    adapter,
    controls::{ControlsPlugin, flying},
    scenes::cornell::{self, BULB, CornellBox, CornellLight},
};

fn main() {
    adapter::require();
    App::new()
        .add_plugins((
            DefaultPlugins,
            GiPlugins,
            ControlsPlugin {
                help: "L: move the light   N: turn the box   arrow keys: push the box",
            },
        ))
        .insert_resource(ClearColor(Color::BLACK))
        .insert_resource(GiSettings {
            replace_ambient: true,
            sky: GiSky::Black,
            ..default()
        })
        .add_systems(Startup, setup)
        .add_systems(Update, animate)
        .run();
}

fn setup(mut commands: Commands) {
    // The box, its bulb, and a `GiVolume` around them.
    commands.queue(cornell::spawn);
    let flying = flying(cornell::view());
    commands.spawn((Camera3d::default(), GiCamera::default(), flying));
}

fn animate(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    mut light: Single<&mut Transform, (With<CornellLight>, Without<CornellBox>)>,
    mut block: Single<&mut Transform, With<CornellBox>>,
    mut phase: Local<f32>,
) {
    if keys.pressed(KeyCode::KeyL) {
        *phase += time.delta_secs();
        light.translation = BULB + Vec3::new(phase.sin(), 0.0, (phase.cos() - 1.0) * 0.7) * 1.8;
    }
    if keys.pressed(KeyCode::KeyN) {
        block.rotate_y(time.delta_secs());
    }
    let axis = |negative: KeyCode, positive: KeyCode| {
        f32::from(keys.pressed(positive)) - f32::from(keys.pressed(negative))
    };
    let push = Vec3::new(
        axis(KeyCode::ArrowLeft, KeyCode::ArrowRight),
        0.0,
        axis(KeyCode::ArrowUp, KeyCode::ArrowDown),
    ) * time.delta_secs();
    if push != Vec3::ZERO {
        let to = block.translation + push;
        block.translation = to.clamp(Vec3::new(-1.6, 0.0, -1.6), Vec3::new(1.6, 5.0, 1.6));
    }
}
