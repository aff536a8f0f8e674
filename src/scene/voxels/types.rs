//! Layouts shared with `types.wgsl`, and their constants, which WGSL gets as definitions.

use bevy::{math::Vec3, render::render_resource::ShaderType, shader::ShaderDefVal};

use crate::scene::volume::{BRICK, GpuVolume};

/// Words of a voxel's sums while it is drawn.
pub const WORDS: u32 = 11;
/// Voxels in a brick.
pub const BRICK_VOXELS: u32 = BRICK * BRICK * BRICK;
/// Samples per voxel along each axis of a view.
pub const SUPERSAMPLING: u32 = 2;
/// Voxels are also listed in this many slices, so that work can be spread over frames. A brick
/// belongs to one, by the parity of its coordinates.
pub const SLICES: u32 = 8;

/// Bits of the brightest emission of a brick, in sums of 32. A voxel counts up to 1023 samples along each
/// axis from each of its two sides: 13 bits are for their number.
pub const EMISSION_BITS: i32 = 32 - 13;

/// Steps of `voxelize`, as the uniform says.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(u32)]
pub enum VoxelizeStep {
    /// Mark the bricks that hold a surface, and how brightly the brightest shines.
    Mark,
    /// Sum the attributes.
    Sum,
}

/// Uniform of one voxelizer draw.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuVoxelize {
    pub volume: GpuVolume,
    /// Axis of the view: 0, 1, 2.
    pub axis: u32,
    /// A [`VoxelizeStep`].
    pub step: u32,
    /// x, y: nits per unit of `StandardMaterial::emissive` at exposure weight 0 and 1; z: nits per
    /// unit of an unlit material's colour.
    pub emission: Vec3,
}

/// Where things are in the buffer of counters and indirect arguments, in words.
pub mod counter {
    use super::SLICES;
    /// Bricks that asked for a slot; may exceed the pool.
    pub const BRICKS: u32 = 0;
    /// Voxels with a surface.
    pub const VOXELS: u32 = 1;
    /// Nits, `f32`, that no emission reaches, and the brightest exceeds half of; 0 if nothing shines.
    pub const EMISSION: u32 = 2;
    /// Voxels of each slice.
    pub const SLICE_COUNT: u32 = 3;
    /// First entry of each slice in the list.
    pub const SLICE_START: u32 = SLICE_COUNT + SLICES;
    /// Next free entry of each slice.
    pub const SLICE_CURSOR: u32 = SLICE_START + SLICES;
    /// All of it.
    pub const WORDS: u32 = SLICE_CURSOR + SLICES;
}

/// Where the arguments of indirect dispatches are, in words.
pub mod argument {
    use super::SLICES;
    /// One workgroup a brick.
    pub const BRICKS: u32 = 0;
    /// One thread a voxel.
    pub const VOXELS: u32 = 3;
    /// The same for each slice.
    pub const SLICE: u32 = 6;
    /// One thread for each 2x2x2 voxels of a brick.
    pub const CELLS: u32 = SLICE + 3 * SLICES;
    /// All of it.
    pub const WORDS: u32 = CELLS + 3;
}

/// The constants above, for `types.wgsl`.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    let mut defs: Vec<_> = [
        ("WORDS", WORDS),
        ("BRICK", BRICK),
        ("BRICK_VOXELS", BRICK_VOXELS),
        ("SLICES", SLICES),
        ("LAYER_SAMPLES", SUPERSAMPLING * SUPERSAMPLING),
        ("STEP_MARK", VoxelizeStep::Mark as u32),
        ("COUNTER_BRICKS", counter::BRICKS),
        ("COUNTER_VOXELS", counter::VOXELS),
        ("COUNTER_EMISSION", counter::EMISSION),
        ("COUNTER_SLICE_COUNT", counter::SLICE_COUNT),
        ("COUNTER_SLICE_START", counter::SLICE_START),
        ("COUNTER_SLICE_CURSOR", counter::SLICE_CURSOR),
        ("ARGUMENT_BRICKS", argument::BRICKS),
        ("ARGUMENT_VOXELS", argument::VOXELS),
        ("ARGUMENT_SLICE", argument::SLICE),
        ("ARGUMENT_CELLS", argument::CELLS),
    ]
    .map(|(name, value)| ShaderDefVal::UInt(name.into(), value))
    .into();
    defs.push(ShaderDefVal::Int("EMISSION_BITS".into(), EMISSION_BITS));
    defs
}
