//! The Sponza atrium in a window; or another glTF, by path.

use bevy::{light::light_consts, prelude::*, world_serialization::WorldInstance};
use bevy_gi::prelude::*;
use bevy_gi_tools::{
    adapter,
    controls::{ControlsPlugin, flying},
    scenes::{asset_folder, sponza},
};

/// Nits of the sky.
const SKY: LinearRgba = LinearRgba::rgb(sponza::SKY[0], sponza::SKY[1], sponza::SKY[2]);

fn main() {
    adapter::require();
    let path = match std::env::args().nth(1) {
        None => sponza::PATH.into(),
        // Seen from here, not from the asset folder.
        Some(path) => match std::fs::canonicalize(&path) {
            Ok(path) => path.to_string_lossy().into_owned(),
            Err(error) => {
                eprintln!("{path}: {error}");
                std::process::exit(1);
            }
        },
    };
    App::new()
        .add_plugins((
            DefaultPlugins.set(AssetPlugin {
                file_path: asset_folder(),
                unapproved_path_mode: bevy::asset::UnapprovedPathMode::Allow,
                ..default()
            }),
            GiPlugins,
            ControlsPlugin {
                help: "L: move the sun",
            },
        ))
        .insert_resource(ClearColor(Color::srgb(0.45, 0.6, 0.85)))
        .insert_resource(GiSettings {
            replace_ambient: true,
            sky: GiSky::Constant(SKY),
            ..default()
        })
        .add_systems(
            Startup,
            move |mut commands: Commands, server: Res<AssetServer>| {
                commands.spawn(WorldAssetRoot(
                    server.load(GltfAssetLabel::Scene(0).from_asset(path.clone())),
                ));
                commands.spawn((
                    GiVolume::new(Vec3::new(34.0, 18.0, 20.0)),
                    Transform::from_xyz(0.0, 7.5, 0.0),
                ));
                let flying = flying(sponza::view());
                commands.spawn((Camera3d::default(), GiCamera::default(), flying));
            },
        )
        .add_systems(Update, (add_sun, light, move_sun))
        // Scenes come to life between the two: no frame is drawn with their cameras.
        .add_systems(PostUpdate, drop_file_cameras)
        .run();
}

/// The file brings cameras of its own; ours is the one that flies.
fn drop_file_cameras(
    mut commands: Commands,
    cameras: Query<Entity, (Added<Camera3d>, Without<GiCamera>)>,
) {
    for camera in &cameras {
        commands.entity(camera).remove::<(Camera3d, Camera)>();
    }
}

type AnyLight = Or<(With<DirectionalLight>, With<PointLight>, With<SpotLight>)>;

/// A file without lights gets a sun.
fn add_sun(
    mut commands: Commands,
    scenes: Query<(), Added<WorldInstance>>,
    lights: Query<(), AnyLight>,
) {
    if !scenes.is_empty() && lights.is_empty() {
        commands.spawn((
            DirectionalLight {
                illuminance: light_consts::lux::RAW_SUNLIGHT,
                ..default()
            },
            Transform::default().looking_to(Vec3::new(0.25, -1.0, 0.2), Vec3::X),
        ));
    }
}

/// The file's sun casts shadows.
fn light(mut suns: Query<&mut DirectionalLight, Added<DirectionalLight>>) {
    for mut sun in &mut suns {
        sun.shadow_maps_enabled = true;
    }
}

fn move_sun(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    mut suns: Query<&mut Transform, With<DirectionalLight>>,
) {
    if keys.pressed(KeyCode::KeyL) {
        for mut sun in &mut suns {
            sun.rotate_x(0.2 * time.delta_secs());
        }
    }
}
