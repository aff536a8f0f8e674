//! The least that an app needs: a plugin group, a component on the camera, and a volume.

use bevy::{math::vec3, prelude::*};
use bevy_gi::prelude::*;

fn main() {
    let mut app = App::new();
    app.add_plugins((DefaultPlugins, GiPlugins));
    app.add_systems(Startup, setup).run();
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let eye = Transform::from_xyz(0.0, 2.0, 7.0).looking_at(Vec3::Y, Vec3::Y);
    commands.spawn((Camera3d::default(), GiCamera::default(), eye));
    // Nine metres around the scene.
    let place = Transform::from_xyz(0.0, 2.0, 0.0);
    commands.spawn((GiVolume::new(Vec3::splat(9.0)), place));

    let (white, red) = (Color::WHITE, Color::srgb(0.9, 0.1, 0.1));
    for (size, at, color) in [
        (vec3(8.0, 0.4, 8.0), vec3(0.0, -0.2, 0.0), white),
        (vec3(0.4, 4.0, 8.0), vec3(-3.0, 2.0, 0.0), red),
        (vec3(1.0, 1.0, 1.0), vec3(-1.5, 0.5, 0.5), white),
    ] {
        let mesh = Mesh3d(meshes.add(Cuboid::from_size(size)));
        let material = MeshMaterial3d(materials.add(color));
        commands.spawn((mesh, material, Transform::from_translation(at)));
    }
    let sun = DirectionalLight {
        shadow_maps_enabled: true,
        ..default()
    };
    let sunlight = Transform::from_xyz(4.0, 5.0, 2.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((sun, sunlight));
}
