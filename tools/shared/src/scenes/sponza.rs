//! The atrium of the Sponza palace, from `assets/scenes/sponza.glb` (made by `cargo xtask assets`).

use bevy::prelude::*;

use super::{Content, Scene, SceneView};

/// Path of the scene in the asset folder.
pub const PATH: &str = "scenes/sponza.glb";

pub const SCENE: Scene = Scene {
    name: "sponza",
    about: "the atrium of the Sponza palace in the sun: a whole level",
    content: Content::File(PATH),
    view,
    sky: Some(SKY),
    ..Scene::PLAIN
};

/// Nits of the sky, on a clear day away from the sun.
pub const SKY: [f32; 3] = [3200.0, 4300.0, 6500.0];

pub fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(-12.0, 2.2, 0.6),
        look: Vec3::new(4.0, 4.2, -0.6),
        fov: 60.0,
        ev100: 11.5,
        speed: 5.0,
    }
}
