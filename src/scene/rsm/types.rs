//! GPU structs of reflective shadow maps; `types.wgsl` is their twin.

use bevy::{
    math::{Mat4, Vec3},
    render::render_resource::ShaderType,
};

/// One map.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuRsmMap {
    pub clip_from_world: Mat4,
    pub world_from_clip: Mat4,
    /// As [`GpuLight::color`](crate::scene::lights::GpuLight::color) now, lux or candela; of a rect light times its
    /// area, candela too.
    pub color: Vec3,
    /// A [`LightKind`](crate::scene::lights::LightKind).
    pub kind: u32,
    /// Where the light is, metres.
    pub position: Vec3,
    /// Texels along a side; the rest of the layer is unused.
    pub size: u32,
    /// Unit vector in which the light travels.
    pub direction: Vec3,
    /// What stored flux is divided by, times [`color`](Self::color): lumens. For a directional light the
    /// area of a texel, for others the solid angle of one in the middle.
    pub flux_scale: f32,
    /// As the light's, like the next two.
    pub range: f32,
    pub cos_inner: f32,
    pub cos_outer: f32,
    /// Whether it shows anything yet.
    pub drawn: u32,
    /// Number of its light; the maps of a light follow each other.
    pub light: u32,
}

/// The buffer of all maps.
#[derive(ShaderType, Clone, Default)]
pub struct GpuRsmMaps {
    /// Maps in `array`.
    pub count: u32,
    /// The maps, with an empty one at the end.
    #[shader(size(runtime))]
    pub array: Vec<GpuRsmMap>,
}

/// A small light that a patch of surface is.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuVpl {
    pub position: Vec3,
    /// Area that it stands for over pi, square metres: nearer than that, it is no point.
    pub radius_squared: f32,
    /// Reflected flux, lumens.
    pub flux: Vec3,
    /// As a texel's word 1, but with the number of its map, counted from 1, in the top byte.
    pub normal: u32,
}

/// Uniform of [`resolve.wgsl`](super).
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuRsmResolve {
    pub map: u32,
}

/// Uniform of `vpls.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuVpls {
    /// Virtual point lights, a power of two.
    pub count: u32,
    /// A [`LightShare`](crate::LightShare).
    pub share: u32,
}
