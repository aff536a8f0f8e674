//! What Bevy's world says: which meshes cast and where they are now, which lights shine, and the sky.
//!
//! Everything here is extracted anew in each frame and compared by value, so that what was written again with
//! the same value changes nothing.

pub mod casters;
pub mod lights;
pub mod material;

pub(crate) mod shapes;
pub(crate) mod sky;
pub(crate) mod viewers;

use bevy::{
    app::{App, Plugin},
    pbr::StandardMaterial,
    shader::load_shader_library,
};

pub(crate) struct WorldPlugin;

impl Plugin for WorldPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "falloff.wgsl");
        load_shader_library!(app, "lights.wgsl");
        load_shader_library!(app, "sky.wgsl");
        app.add_plugins((
            casters::CastersPlugin,
            lights::LightsPlugin,
            sky::SkyPlugin,
            material::GiMaterialPlugin::<StandardMaterial>::default(),
        ));
    }
}
