//! GPU structs of voxel cone tracing; `types.wgsl` and `bindings.wgsl` are their twins.

use bevy::{math::IVec3, math::UVec3, render::render_resource::ShaderType};

use super::settings::{ConeLayout, VoxelConeTracingSettings};

/// Radiance is stored per cell for light that travels in each of these many directions: +x, -x,
/// +y, -y, +z, -z. The six lie above each other along z in one texture.
pub const DIRECTIONS: u32 = 6;

/// Parameters of all cones.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuCones {
    pub cones: u32,
    pub bounce_cones: u32,
    /// A [`ConeLayout`].
    pub arrangement: u32,
    pub diffuse_steps: u32,
    pub specular_steps: u32,
    /// Tangent of half the angle of a diffuse cone.
    pub tan_half: f32,
    /// Fraction of the diameter.
    pub step: f32,
    /// Voxels.
    pub bias: f32,
    /// Fraction of the height above the start's plane.
    pub clearance: f32,
    pub opacity_cutoff: f32,
    pub density: f32,
    /// 0 or 1.
    pub specular: u32,
    /// Tangent of half a specular cone over `roughness^2`.
    pub specular_scale: f32,
    /// Nits of a unit of the cells' radiance.
    pub unit: f32,
}

impl GpuCones {
    /// Of cells in a unit of that many nits.
    pub fn new(s: &VoxelConeTracingSettings, unit: f32) -> Self {
        Self {
            cones: match s.cone_layout {
                ConeLayout::Spiral => s.cones,
                ConeLayout::Freed2018 => 5,
            },
            bounce_cones: s.bounce_cones,
            arrangement: s.cone_layout as u32,
            diffuse_steps: s.diffuse_steps,
            specular_steps: s.specular_steps,
            tan_half: (0.5 * s.cone_angle.to_radians()).tan(),
            step: s.step,
            bias: s.bias,
            clearance: s.clearance,
            opacity_cutoff: s.opacity_cutoff,
            density: s.density,
            specular: s.specular.into(),
            specular_scale: 1.0,
            unit,
        }
    }
}

/// Uniform of the passes over voxels.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuVoxelPass {
    /// The slice whose bounced light is traced.
    pub slice: u32,
    /// Voxels to add to a voxel's coordinates to find it in the previous brick map.
    pub shift: IVec3,
    /// 1 if the previous brick map can be used.
    pub carry: u32,
    /// Voxels along each axis.
    pub dims: UVec3,
}

/// Uniform of a mip pass.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuMip {
    /// Cells of the destination level.
    pub cells: UVec3,
    /// Nits of a unit of their radiance.
    pub unit: f32,
}
