//! A lantern carried past a row of pillars.

use bevy::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "moving_light",
    about: "a lantern carried past pillars: light and its bounces move in every frame",
    content: Content::Built(spawn),
    view,
    motion: Some(carry),
    ..Scene::PLAIN
};

/// What is carried.
#[derive(Component)]
struct Lantern;

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(0.0, 1.9, 4.6),
        look: Vec3::new(0.0, 1.2, -1.0),
        fov: 55.0,
        ev100: 4.4,
        speed: 2.5,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let stone = stage.paint([0.6, 0.56, 0.5]);
    let red = stage.paint([0.6, 0.1, 0.06]);
    let green = stage.paint([0.12, 0.4, 0.14]);
    let (min, max) = (Vec3::new(-4.0, 0.0, -3.0), Vec3::new(4.0, 3.0, 5.2));
    stage.room(min, max, 0.3, &stone);
    // Banners on the back wall.
    for (x, paint) in [(-2.6, &red), (-0.9, &green), (0.9, &red), (2.6, &green)] {
        stage.slab(
            Vec3::new(x - 0.5, 0.7, min.z),
            Vec3::new(x + 0.5, 2.6, min.z + 0.07),
            paint,
        );
    }
    for x in [-2.6, -0.9, 0.9, 2.6] {
        stage.block(
            Vec2::new(x, -0.2),
            Vec3::new(0.42, max.y, 0.42),
            0.0,
            &stone,
        );
    }
    let lantern = stage.bulb(Vec3::ZERO, 350.0);
    stage.0.entity_mut(lantern).insert(Lantern);
    stage.volume(min - 0.3, max + 0.3);
    carry(world, 0.0);
}

/// From left to right, behind the pillars.
fn carry(world: &mut World, time: f32) {
    let mut lanterns = world.query_filtered::<&mut Transform, With<Lantern>>();
    for mut lantern in lanterns.iter_mut(world) {
        lantern.translation = Vec3::new(-3.2 + 6.4 * time, 1.6, -1.5);
    }
}
