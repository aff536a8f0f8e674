//! The least that an app needs: a plugin group, a component on the camera, and a volume.

use bevy::prelude::*;
use bevy_gi::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, GiPlugins))
        .add_systems(Startup, setup)
        .run();
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    commands.spawn((
        Camera3d::default(),
        GiCamera::default(),
        Transform::from_xyz(0.0, 2.0, 7.0).looking_at(Vec3::Y, Vec3::Y),
    ));
    commands.spawn((
        GiVolume::new(Vec3::splat(9.0)),
        Transform::from_xyz(0.0, 2.0, 0.0),
    ));

    let mut cuboid = |size: Vec3, at: Vec3, color: Color| {
        let mesh = Mesh3d(meshes.add(Cuboid::from_size(size)));
        commands.spawn((
            mesh,
            MeshMaterial3d(materials.add(color)),
            Transform::from_translation(at),
        ));
    };
    cuboid(Vec3::new(8.0, 0.4, 8.0), Vec3::Y * -0.2, Color::WHITE);
    cuboid(
        Vec3::new(0.4, 4.0, 8.0),
        Vec3::new(-3.0, 2.0, 0.0),
        Color::srgb(0.9, 0.1, 0.1),
    );
    cuboid(Vec3::ONE, Vec3::new(-1.5, 0.5, 0.5), Color::WHITE);
    commands.spawn((
        DirectionalLight {
            illuminance: 20_000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(4.0, 5.0, 2.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
}
