//! Two rooms and a door between them; the lamp hangs in the far one. The door slides.

use bevy::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "two_rooms",
    about: "a room lit through the open door of another, where the lamp is; the door slides",
    content: Content::Built(spawn),
    view,
    motion: Some(slide),
    quick: true,
    ..Scene::PLAIN
};

/// The door's leaf.
#[derive(Component)]
struct Door;

/// Width of the doorway, metres.
const DOORWAY: f32 = 1.3;

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(4.7, 1.65, -2.2),
        look: Vec3::new(-0.6, 1.15, 0.75),
        fov: 58.0,
        ev100: 2.4,
        speed: 2.5,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let plaster = stage.paint([0.75, 0.72, 0.66]);
    let boards = stage.paint([0.42, 0.25, 0.13]);
    let terracotta = stage.paint([0.62, 0.22, 0.1]);
    let blue = stage.paint([0.12, 0.25, 0.5]);
    let (min, max) = (Vec3::new(-5.0, 0.0, -2.6), Vec3::new(5.0, 2.8, 2.6));
    stage.room(min, max, 0.3, &plaster);
    // A floor of boards on the slab, and a coloured wall behind the lamp.
    stage.slab(min, Vec3::new(max.x, 0.05, max.z), &boards);
    stage.slab(
        Vec3::new(min.x, 0.05, min.z),
        Vec3::new(min.x + 0.05, max.y, max.z),
        &terracotta,
    );
    // The wall between the rooms, with a doorway from z = 0.3 on.
    let (near, far, lintel) = (0.3, 0.3 + DOORWAY, 2.1);
    let w = 0.12;
    let mut wall = |z: [f32; 2], y: [f32; 2]| {
        stage.slab(
            Vec3::new(-w, y[0], z[0]),
            Vec3::new(w, y[1], z[1]),
            &plaster,
        );
    };
    wall([min.z, near], [0.05, max.y]);
    wall([far, max.z], [0.05, max.y]);
    wall([near, far], [lintel, max.y]);
    // The leaf slides along the wall of the far room, and stands open.
    let leaf = stage.slab(
        Vec3::new(-w - 0.14, 0.05, near - 0.08),
        Vec3::new(-w - 0.02, lintel + 0.08, far + 0.08),
        &blue,
    );
    let mut leaf = stage.0.entity_mut(leaf);
    leaf.insert(Door);
    slide(world, 0.0);

    let mut stage = Stage(world);
    stage.block(
        Vec2::new(2.2, 1.5),
        Vec3::new(1.1, 0.8, 0.9),
        12.0,
        &terracotta,
    );
    stage.block(
        Vec2::new(1.5, -1.7),
        Vec3::new(0.8, 1.9, 0.5),
        -4.0,
        &plaster,
    );
    stage.mesh(
        Sphere::new(0.4).mesh().uv(48, 24),
        &plaster,
        Transform::from_xyz(3.3, 0.45, 0.4),
    );
    stage.block(
        Vec2::new(-2.2, 1.2),
        Vec3::new(1.4, 0.75, 0.8),
        0.0,
        &boards,
    );
    stage.bulb(Vec3::new(-2.6, 2.3, 0.2), 450.0);
    stage.volume(min - 0.3, max + 0.3);
}

/// From open (0) to shut (1).
fn slide(world: &mut World, time: f32) {
    let mut doors = world.query_filtered::<&mut Transform, With<Door>>();
    for mut door in doors.iter_mut(world) {
        door.translation.z = 0.3 + 0.5 * DOORWAY - (1.0 - time) * (DOORWAY + 0.2);
    }
}
