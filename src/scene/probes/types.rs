//! GPU structs of probes; `types.wgsl` is their twin.

use bevy::{
    math::{IVec3, UVec3, Vec3},
    render::render_resource::ShaderType,
    shader::ShaderDefVal,
};

use crate::scene::volume::probe_set::{Lattice, ProbeSet};

/// In place of a voxel's index in a hit: the ray left the volume.
pub const HIT_NOTHING: u32 = u32::MAX;
/// In place of a voxel's index in a hit: the inside of something.
pub const HIT_INSIDE: u32 = u32::MAX - 1;
/// In a hit: the back of a two-sided voxel was met.
pub const HIT_BACK: u32 = 1 << 31;

/// The probes of a volume.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuProbes {
    /// Metres.
    pub origin: Vec3,
    /// Metres.
    pub cell: f32,
    pub dims: UVec3,
    /// Rays along a side of a probe's octahedral map.
    pub side: u32,
    /// Fraction of a cell.
    pub bias: f32,
    /// 0 or 1.
    pub visibility: u32,
    /// 0 or 1.
    pub relocation: u32,
    /// Which set of directions the rays have; 0: the middles of their texels.
    pub round: u32,
    /// 0 or 1.
    pub sleeping: u32,
}

impl GpuProbes {
    pub fn new(set: &ProbeSet, lattice: &Lattice, round: u32) -> Self {
        Self {
            origin: lattice.origin,
            cell: lattice.cell,
            dims: lattice.dims,
            side: set.ray_side(),
            bias: set.bias,
            visibility: set.visibility.into(),
            relocation: set.relocation.into(),
            round,
            sleeping: set.sleeping.into(),
        }
    }

    /// Cells by which they have moved since, if they are the same but for that.
    pub fn moved_from(&self, before: &Self) -> Option<IVec3> {
        let here = Self {
            origin: before.origin,
            ..*self
        };
        let cells = (self.origin - before.origin) / self.cell;
        let whole = cells.round();
        let overlap = whole.abs().cmplt(self.dims.as_vec3()).all();
        (here == *before && overlap && cells.abs_diff_eq(whole, 0.02)).then(|| whole.as_ivec3())
    }
}

/// The constants above, for `types.wgsl`.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    [
        ("HIT_NOTHING", HIT_NOTHING),
        ("HIT_INSIDE", HIT_INSIDE),
        ("HIT_BACK", HIT_BACK),
    ]
    .map(|(name, value)| ShaderDefVal::UInt(name.into(), value))
    .into()
}
