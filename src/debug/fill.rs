//! What fills a buffer that a debug view draws.

use bevy::{math::UVec3, render::render_resource::BindGroup};

use crate::gpu::compute::ComputePass;

/// A compute pass that writes spheres, or marks, in each frame.
pub(crate) struct FillPass {
    pub pass: ComputePass,
    pub threads: UVec3,
    pub bind_groups: Vec<BindGroup>,
}
