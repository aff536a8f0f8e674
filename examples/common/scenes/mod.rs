//! Bundled scenes, one module each.

pub mod cornell;
pub mod sponza;

use bevy::prelude::*;

/// Where a scene is looked at from, and how brightly.
#[derive(Resource, Clone, Copy, Debug)]
pub struct SceneView {
    pub eye: Vec3,
    pub look: Vec3,
    /// Vertical, degrees.
    pub fov: f32,
    pub ev100: f32,
    /// Metres per second of the free camera.
    pub speed: f32,
}

/// Asset folder of this repository, also when an example is started from elsewhere.
pub fn asset_folder() -> String {
    let bundled = concat!(env!("CARGO_MANIFEST_DIR"), "/assets");
    if std::path::Path::new(bundled).is_dir() {
        bundled.into()
    } else {
        "assets".into()
    }
}
