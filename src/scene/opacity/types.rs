//! GPU structs of opacity; `filter.wgsl` has the twin.

use bevy::{math::UVec3, render::render_resource::ShaderType};

/// Texels are stacked along z: for what travels in the positive directions, and in the negative ones.
pub(super) const BLOCKS: u32 = 2;

/// Uniform of a pass over one level.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuOpacityLevel {
    /// Cells of the destination.
    pub cells: UVec3,
}
