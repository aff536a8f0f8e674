//! Small helpers over wgpu that every stage uses. Nothing here knows of global illumination.

pub(crate) mod caps;
pub(crate) mod compute;
mod diagnostics;
pub(crate) mod fullscreen;
pub(crate) mod layout;
pub(crate) mod readback;
pub(crate) mod statistics;

use bevy::{
    app::{App, Plugin},
    shader::load_shader_library,
};

/// Shader libraries that every stage uses, counts of memory and work, and diagnostics.
#[derive(Default)]
pub struct GpuPlugin;

impl Plugin for GpuPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "basis.wgsl");
        load_shader_library!(app, "color.wgsl");
        load_shader_library!(app, "pack.wgsl");
        load_shader_library!(app, "random.wgsl");
        load_shader_library!(app, "row.wgsl");
        load_shader_library!(app, "sh.wgsl");
        app.add_plugins((statistics::StatisticsPlugin, diagnostics::DiagnosticsPlugin));
    }
}
