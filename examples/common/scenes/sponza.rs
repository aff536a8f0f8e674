//! The atrium of the Sponza palace, from `assets/scenes/sponza.glb` (made by `cargo xtask assets`).

use bevy::prelude::*;

use super::SceneView;

/// Path of the scene in the asset folder.
pub const PATH: &str = "scenes/sponza.glb";

pub fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(-12.0, 2.2, 0.6),
        look: Vec3::new(4.0, 4.2, -0.6),
        fov: 60.0,
        ev100: 11.5,
        speed: 5.0,
    }
}
