//! A closed room whose walls shine with 1 nit and reflect half: 1 + 1/2 + 1/4 + ... = 2 nits.

use bevy::prelude::*;

use super::{
    Content, Scene, SceneView,
    stage::{Stage, shining},
};

pub const SCENE: Scene = Scene {
    name: "furnace",
    about: "a closed room that shines with 1 nit and reflects half: 2 nits everywhere",
    content: Content::Built(spawn),
    view,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(-1.2, -0.4, 1.4),
        look: Vec3::new(1.0, 0.3, -1.0),
        fov: 80.0,
        ev100: 1.0,
        speed: 1.0,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let walls = stage.material(StandardMaterial {
        base_color: Color::linear_rgb(0.5, 0.5, 0.5),
        ..shining([1.0; 3], view().ev100)
    });
    let half = Vec3::splat(2.0);
    stage.room(-half, half, 0.4, &walls);
    stage.volume(-half - 0.4, half + 0.4);
}
