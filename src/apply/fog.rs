//! What Bevy's distance fog leaves of the indirect light.

use bevy::{
    color::Alpha,
    math::Vec3,
    pbr::{DistanceFog, FogFalloff},
    render::render_resource::ShaderType,
    shader::ShaderDefVal,
};

/// Kinds of fog, by [`GpuFog::kind`].
const KINDS: [&str; 5] = [
    "FOG_NONE",
    "FOG_LINEAR",
    "FOG_EXPONENTIAL",
    "FOG_EXPONENTIAL_SQUARED",
    "FOG_ATMOSPHERIC",
];

/// A camera's fog; its own light is Bevy's business.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(crate) struct GpuFog {
    /// Start and end, metres; density, 1/m; or extinction, 1/m.
    pub falloff: Vec3,
    /// Alpha of the fog's colour.
    pub opacity: f32,
    /// Index in [`KINDS`].
    pub kind: u32,
}

impl From<Option<&DistanceFog>> for GpuFog {
    fn from(fog: Option<&DistanceFog>) -> Self {
        let Some(fog) = fog else {
            return Self::default();
        };
        let (kind, falloff) = match &fog.falloff {
            FogFalloff::Linear { start, end } => (1, Vec3::new(*start, *end, 0.0)),
            FogFalloff::Exponential { density } => (2, Vec3::splat(*density)),
            FogFalloff::ExponentialSquared { density } => (3, Vec3::splat(*density)),
            FogFalloff::Atmospheric { extinction, .. } => (4, *extinction),
        };
        Self {
            falloff,
            opacity: fog.color.alpha(),
            kind,
        }
    }
}

/// For `composite.wgsl`.
pub(crate) fn shader_defs() -> impl Iterator<Item = ShaderDefVal> {
    (0..)
        .zip(KINDS)
        .map(|(kind, name)| ShaderDefVal::UInt(name.into(), kind))
}
