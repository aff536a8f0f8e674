//! Two sealed rooms side by side, a lamp in one: what is seen in the other has leaked.

use bevy::prelude::*;
use bevy_gi::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "sealed",
    about: "two sealed rooms, a lamp in one: what is seen in the other has leaked",
    content: Content::Built(spawn),
    view,
    quick: true,
    leaks: true,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: EYES[1],
        look: Vec3::ZERO,
        fov: 90.0,
        ev100: 4.0,
        speed: 1.0,
    }
}

/// Edge of a voxel, metres.
pub const VOXEL: f32 = 0.1;
/// Where one stands in the dark room and in the lit one, looking at the wall between them.
pub const EYES: [Vec3; 2] = [Vec3::new(-2.4, 0.0, 0.0), Vec3::new(2.4, 0.0, 0.0)];

/// The wall between the rooms.
#[derive(Component)]
struct Wall;

/// The rooms, with a wall of two voxels between them: see [`set_wall`].
fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let white = stage.paint([0.7; 3]);
    let (min, max) = (Vec3::new(-2.6, -1.3, -1.3), Vec3::new(2.6, 1.3, 1.3));
    stage.room(min, max, 0.3, &white);
    let wall = stage.slab(
        Vec3::new(-0.5, min.y, min.z),
        Vec3::new(0.5, max.y, max.z),
        &white,
    );
    stage.0.entity_mut(wall).insert(Wall);
    stage.bulb(Vec3::new(1.4, 0.6, 0.0), 320.0);
    let volume = GiVolume::new(Vec3::splat(64.0 * VOXEL)).with_resolution(64);
    stage.0.spawn(volume);
    set_wall(world, 2.0, 0.0);
}

/// Makes the wall so many voxels thick, its centre `phase` of a voxel off a border of voxels.
pub fn set_wall(world: &mut World, voxels: f32, phase: f32) {
    let mut walls = world.query_filtered::<&mut Transform, With<Wall>>();
    for mut wall in walls.iter_mut(world) {
        wall.translation.x = phase * VOXEL;
        wall.scale.x = voxels * VOXEL;
    }
}
