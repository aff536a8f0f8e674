//! The Cornell box, with the measures of the original (Cornell University Program of Computer
//! Graphics, 1998), ten times as large: 5.5 m a side. A bulb under the ceiling lights it.

use bevy::{light::NotShadowCaster, prelude::*};
use bevy_gi::prelude::*;

use super::SceneView;

/// The bulb; the examples move it.
#[derive(Component)]
pub struct CornellLight;

/// The tall box; the examples move it.
#[derive(Component)]
pub struct CornellBox;

/// Half of width, height and depth of the room, metres.
const HALF: Vec3 = Vec3::new(2.764, 2.744, 2.796);
/// Thickness of the walls, metres.
const WALL: f32 = 0.3;

/// Candela of the bulb.
pub const CANDELA: f32 = 800.0;
/// Where the bulb hangs.
pub const BULB: Vec3 = Vec3::new(0.0, 4.9, 0.0);

pub fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(0.0, 2.74, 10.8),
        look: Vec3::new(0.0, 2.74, 0.0),
        fov: 38.5,
        ev100: 4.6,
        speed: 3.0,
    }
}

/// Perfectly diffuse, of a linear albedo.
pub fn diffuse(color: [f32; 3]) -> StandardMaterial {
    StandardMaterial {
        base_color: Color::linear_rgb(color[0], color[1], color[2]),
        perceptual_roughness: 1.0,
        reflectance: 0.0,
        ..default()
    }
}

pub fn spawn(
    commands: &mut Commands,
    meshes: &mut Assets<Mesh>,
    materials: &mut Assets<StandardMaterial>,
) {
    let white = materials.add(diffuse([0.73, 0.73, 0.73]));
    let red = materials.add(diffuse([0.63, 0.065, 0.05]));
    let green = materials.add(diffuse([0.14, 0.45, 0.091]));

    let outer = HALF + WALL;
    let mut slab = |center: Vec3, half: Vec3, material: &Handle<StandardMaterial>| {
        commands.spawn((
            Mesh3d(meshes.add(Cuboid::from_size(half * 2.0))),
            MeshMaterial3d(material.clone()),
            Transform::from_translation(center + Vec3::Y * HALF.y),
        ));
    };
    let w = WALL * 0.5;
    slab(
        -Vec3::Y * (HALF.y + w),
        Vec3::new(outer.x, w, outer.z),
        &white,
    );
    slab(
        Vec3::Y * (HALF.y + w),
        Vec3::new(outer.x, w, outer.z),
        &white,
    );
    slab(
        -Vec3::Z * (HALF.z + w),
        Vec3::new(outer.x, HALF.y, w),
        &white,
    );
    slab(-Vec3::X * (HALF.x + w), Vec3::new(w, HALF.y, HALF.z), &red);
    slab(Vec3::X * (HALF.x + w), Vec3::new(w, HALF.y, HALF.z), &green);

    // The boxes' footprints in the data are rotated by 17 degrees, give or take.
    let mut block = |center: Vec2, size: Vec3, degrees: f32| {
        commands
            .spawn((
                Mesh3d(meshes.add(Cuboid::from_size(size))),
                MeshMaterial3d(white.clone()),
                Transform::from_xyz(center.x, size.y * 0.5, center.y)
                    .with_rotation(Quat::from_rotation_y(degrees.to_radians())),
            ))
            .id()
    };
    block(Vec2::new(0.909, 1.106), Vec3::new(1.67, 1.65, 1.67), -17.0);
    let tall = block(Vec2::new(-0.921, -0.717), Vec3::new(1.66, 3.3, 1.66), 17.2);

    commands.entity(tall).insert(CornellBox);
    commands.spawn((
        CornellLight,
        PointLight {
            intensity: CANDELA * 4.0 * std::f32::consts::PI,
            range: 1000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_translation(BULB),
        // What is seen of the bulb: its light is the point light's.
        children![(
            Mesh3d(meshes.add(Sphere::new(0.09))),
            MeshMaterial3d(materials.add(StandardMaterial {
                base_color: Color::BLACK,
                emissive: LinearRgba::rgb(6.0, 5.6, 5.0),
                ..default()
            })),
            NotGiCaster,
            NotShadowCaster,
        )],
    ));
    commands.spawn((
        GiVolume::new(Vec3::splat(6.4)),
        Transform::from_xyz(0.0, HALF.y, 0.0),
    ));
}
