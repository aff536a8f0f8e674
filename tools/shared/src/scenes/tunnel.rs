//! A corridor with a bend: the lamp is in one leg, the camera in the other.

use bevy::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "tunnel",
    about: "an L-shaped corridor: beyond the bend, all light has bounced, most of it often",
    content: Content::Built(spawn),
    view,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(0.55, 1.5, 6.2),
        look: Vec3::new(-0.15, 1.1, 0.0),
        fov: 52.0,
        ev100: 2.6,
        speed: 2.0,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let concrete = stage.paint([0.62, 0.6, 0.57]);
    let tiles = stage.paint([0.35, 0.37, 0.4]);
    let orange = stage.paint([0.75, 0.3, 0.08]);
    let (top, w) = (2.4, 0.3);
    let mut wall = |min: [f32; 3], max: [f32; 3], paint| {
        stage.slab(Vec3::from(min), Vec3::from(max), paint);
    };
    let (outer, end) = (1.0 + w, 7.0 + w);
    wall([-end, -w, -outer], [outer, 0.0, end], &tiles);
    wall([-end, top, -outer], [outer, top + w, end], &concrete);
    wall([-end, 0.0, -outer], [outer, top, -1.0], &orange);
    wall([1.0, 0.0, -outer], [outer, top, end], &concrete);
    wall([-end, 0.0, -outer], [-7.0, top, outer], &concrete);
    wall([-end, 0.0, 1.0], [-1.0, top, outer], &concrete);
    wall([-outer, 0.0, 1.0], [-1.0, top, end], &concrete);
    wall([-outer, 0.0, 7.0], [outer, top, end], &concrete);

    let crate_size = Vec3::new(0.55, 0.5, 0.55);
    stage.block(Vec2::new(-0.6, 2.6), crate_size, 20.0, &orange);
    stage.block(
        Vec2::new(0.65, 1.4),
        Vec3::new(0.4, 0.9, 0.4),
        -10.0,
        &concrete,
    );
    stage.bulb(Vec3::new(-4.2, 2.0, 0.0), 700.0);
    stage.volume(Vec3::new(-end, -w, -outer), Vec3::new(outer, top + w, end));
}
