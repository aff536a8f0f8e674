//! The Cornell box, with the measures of the original (Cornell University Program of Computer
//! Graphics, 1998), ten times as large: 5.5 m a side. A bulb under the ceiling lights it.

use bevy::{light::NotShadowCaster, prelude::*};
use bevy_gi::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "cornell",
    about: "the Cornell box under a bulb: one bounce after another, and colours that bleed",
    content: Content::Built(spawn),
    view,
    quick: true,
    watched: true,
    ..Scene::PLAIN
};

/// The bulb; the examples move it.
#[derive(Component)]
pub struct CornellLight;

/// The tall box; the examples move it.
#[derive(Component)]
pub struct CornellBox;

/// Half of width, height and depth of the room, metres.
pub const HALF: Vec3 = Vec3::new(2.764, 2.744, 2.796);
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

pub fn spawn(world: &mut World) {
    spawn_box(world);
    let mut stage = Stage(world);
    let bulb = stage.bulb(BULB, CANDELA);
    stage.0.entity_mut(bulb).insert(CornellLight);
    // What is seen of the bulb: its light is the point light's.
    let glass = stage.material(StandardMaterial {
        base_color: Color::BLACK,
        emissive: LinearRgba::rgb(6.0, 5.6, 5.0),
        ..default()
    });
    let glass = stage.mesh(Sphere::new(0.09), &glass, default());
    let mut glass = stage.0.entity_mut(glass);
    glass.insert((NotGiCaster, NotShadowCaster, ChildOf(bulb)));
}

/// The box without a light.
pub fn spawn_box(world: &mut World) {
    let mut stage = Stage(world);
    let white = stage.paint([0.73, 0.73, 0.73]);
    let red = stage.paint([0.63, 0.065, 0.05]);
    let green = stage.paint([0.14, 0.45, 0.091]);

    let outer = HALF + WALL;
    let mut slab = |center: Vec3, half: Vec3, material: &Handle<StandardMaterial>| {
        let center = center + Vec3::Y * HALF.y;
        stage.slab(center - half, center + half, material);
    };
    let w = WALL * 0.5;
    let lid = Vec3::new(outer.x, w, outer.z);
    let back = Vec3::new(outer.x, HALF.y, w);
    let side = Vec3::new(w, HALF.y, HALF.z);
    slab(-Vec3::Y * (HALF.y + w), lid, &white);
    slab(Vec3::Y * (HALF.y + w), lid, &white);
    slab(-Vec3::Z * (HALF.z + w), back, &white);
    slab(-Vec3::X * (HALF.x + w), side, &red);
    slab(Vec3::X * (HALF.x + w), side, &green);

    // The boxes' footprints in the data are rotated by 17 degrees, give or take.
    let short = Vec3::new(1.67, 1.65, 1.67);
    stage.block(Vec2::new(0.909, 1.106), short, -17.0, &white);
    let tall = Vec3::new(1.66, 3.3, 1.66);
    let tall = stage.block(Vec2::new(-0.921, -0.717), tall, 17.2, &white);
    stage.0.entity_mut(tall).insert(CornellBox);
    stage.0.spawn((
        GiVolume::new(Vec3::splat(6.4)),
        Transform::from_xyz(0.0, HALF.y, 0.0),
    ));
}
