//! Keys and on-screen help of examples with a window.

use bevy::{
    camera::Exposure,
    camera_controller::free_camera::{FreeCamera, FreeCameraPlugin},
    prelude::*,
};
use bevy_gi::{
    GiSettingsRegistry, GiSupport, GiTechniques, PrimaryGiCamera,
    inspector::{
        GiInspector, GiInspectorPlugin,
        bevy_egui::{EguiGlobalSettings, EguiPlugin},
    },
    prelude::*,
};

use crate::{
    scenes::SceneView,
    truth::{TruthPlugin, TruthState},
};

/// The inspector, the keys G, T, V, P, B, C, R and H, and the text that explains them.
pub struct ControlsPlugin {
    /// Lines about the example's own keys.
    pub help: &'static str,
}

#[derive(Resource)]
struct Help(&'static str);

#[derive(Component)]
struct HelpText;

/// Whether debug views follow the cursor.
#[derive(Resource, Default)]
struct PickAtCursor(bool);

impl Plugin for ControlsPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins((
            FreeCameraPlugin,
            EguiPlugin::default(),
            GiInspectorPlugin::default(),
            TruthPlugin,
        ))
        // What is typed into the panel does not fly the camera.
        .insert_resource(EguiGlobalSettings {
            enable_absorb_bevy_input_system: true,
            ..default()
        })
        .insert_resource(Help(self.help))
        .add_systems(Startup, spawn_help)
        .init_resource::<PickAtCursor>()
        .add_systems(
            Update,
            (keys, preset_key, pick_at_cursor, update_help, make_room).chain(),
        );
    }
}

/// What a camera needs on top to show a view of a scene, and to fly from there.
pub fn flying(view: SceneView) -> impl Bundle {
    (
        Projection::from(PerspectiveProjection {
            fov: view.fov.to_radians(),
            ..default()
        }),
        Exposure { ev100: view.ev100 },
        Transform::from_translation(view.eye).looking_at(view.look, Vec3::Y),
        FreeCamera {
            walk_speed: view.speed,
            run_speed: view.speed * 3.0,
            ..default()
        },
    )
}

/// What follows `current` in a list, round and round.
pub fn next<T: PartialEq + Copy>(all: &[T], current: T) -> T {
    let at = all.iter().position(|x| *x == current).unwrap_or(0);
    all[(at + 1) % all.len()]
}

/// Text on a dark ground in the upper left corner.
pub fn panel() -> impl Bundle {
    (
        Text::default(),
        TextFont::from_font_size(14.0),
        Node {
            position_type: PositionType::Absolute,
            top: px(8),
            left: px(8),
            padding: UiRect::all(px(6)),
            ..default()
        },
        BackgroundColor(Color::BLACK.with_alpha(0.55)),
    )
}

fn spawn_help(mut commands: Commands) {
    commands.spawn((HelpText, panel()));
}

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    mut settings: ResMut<GiSettings>,
    (techniques, views): (Res<GiTechniques>, Res<GiViews>),
    mut debug: ResMut<GiDebugSettings>,
    mut help: Query<&mut Visibility, With<HelpText>>,
) {
    if keys.just_pressed(KeyCode::KeyG) {
        settings.technique = match settings.technique {
            GiTechnique::OFF => GiTechnique::default(),
            _ => GiTechnique::OFF,
        };
    }
    if keys.just_pressed(KeyCode::KeyT) {
        let all: Vec<_> = techniques.iter().map(|entry| entry.technique).collect();
        settings.technique = next(&all, settings.technique);
    }
    if keys.just_pressed(KeyCode::KeyV) {
        let of_technique = views.of(settings.technique);
        let all: Vec<_> = of_technique.map(|entry| entry.view).collect();
        debug.view = next(&all, debug.view);
    }
    if keys.just_pressed(KeyCode::KeyB) {
        debug.show_volumes = !debug.show_volumes;
        debug.show_ambient_cubes = debug.show_volumes;
    }
    if keys.just_pressed(KeyCode::KeyH) {
        for mut visibility in &mut help {
            visibility.toggle_inherited_hidden();
        }
    }
}

/// The line of sight under the cursor picks what debug views show more of.
fn pick_at_cursor(
    keys: Res<ButtonInput<KeyCode>>,
    windows: Query<&Window>,
    primary: Res<PrimaryGiCamera>,
    cameras: Query<(&Camera, &GlobalTransform)>,
    mut at_cursor: ResMut<PickAtCursor>,
    mut debug: ResMut<GiDebugSettings>,
) {
    if keys.just_pressed(KeyCode::KeyC) {
        at_cursor.0 = !at_cursor.0;
        debug.show_picked = at_cursor.0;
    }
    let cursor = windows.iter().find_map(Window::cursor_position);
    let (Some(cursor), true) = (cursor, at_cursor.0) else {
        return;
    };
    let camera = primary.0.and_then(|camera| cameras.get(camera).ok());
    let ray = camera.and_then(|(camera, place)| camera.viewport_to_world(place, cursor).ok());
    if let Some(ray) = ray {
        debug.pick_from = ray.origin;
        debug.pick_to = ray.origin + *ray.direction;
    }
}

/// The panel has the help's corner while it is open.
fn make_room(inspector: Res<GiInspector>, mut help: Query<&mut Node, With<HelpText>>) {
    for mut node in &mut help {
        let display = match inspector.open {
            true => Display::None,
            false => Display::Flex,
        };
        if node.display != display {
            node.display = display;
        }
    }
}

/// Goes through the presets.
fn preset_key(world: &mut World) {
    let keys = world.resource::<ButtonInput<KeyCode>>();
    if !keys.just_pressed(KeyCode::KeyP) {
        return;
    }
    let registry = world.resource::<GiSettingsRegistry>().clone();
    let names = GiQuality::ALL.map(GiQuality::name);
    let current = names
        .into_iter()
        .find(|name| registry.has_preset(world, name));
    registry.apply_preset(world, next(&names, current.unwrap_or("ultra")));
}

fn update_help(
    world: &mut World,
    texts: &mut QueryState<&mut Text, With<HelpText>>,
    mut smooth: Local<f32>,
) {
    let settings = world.resource::<GiSettings>();
    let debug = world.resource::<GiDebugSettings>();
    let support = world.resource::<GiSupport>();
    let truth = world.get_resource::<TruthState>();
    let time = world.resource::<Time<Real>>();
    *smooth += (time.delta_secs() - *smooth) * 0.1;
    let off = match support.technique(settings.technique) {
        Some(why) => format!("\n{why}"),
        None => String::new(),
    };
    let (technique, hold) = match truth {
        None => (settings.technique.name().into(), ""),
        Some(TruthState { samples }) => {
            let name = settings.technique.name().into();
            let traced = samples.map(|n| format!("reference, {n} paths a pixel"));
            (
                traced.unwrap_or(name),
                "   R: hold for the truth, path-traced",
            )
        }
    };
    let registry = world.resource::<GiSettingsRegistry>();
    let legends = registry.debug(settings.technique);
    let legends: String = legends
        .filter_map(|entry| entry.legend(world))
        .map(|legend| format!("\n{legend}"))
        .collect();
    let view = world.resource::<GiViews>().get(debug.view);
    let shown = format!(
        "{:.1} ms   technique: {technique}   view: {}{off}\n{}{legends}\n\
             F1: inspector   G: GI on/off   T: technique   V: view   B: volumes and ambient cubes\n\
             P: quality preset   C: what lights the surface at the cursor   H: this help{hold}\n\
             WASD, E, Q: fly   Shift: faster   right mouse button: look\n{}",
        *smooth * 1000.0,
        view.view,
        view.legend,
        world.resource::<Help>().0,
    );
    for mut text in texts.iter_mut(world) {
        text.0.clone_from(&shown);
    }
}
