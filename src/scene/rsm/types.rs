//! GPU structs of reflective shadow maps; `types.wgsl` is their twin.

use bevy::{
    math::{Mat4, UVec2, Vec3},
    render::render_resource::ShaderType,
};

use crate::scene::{light_maps::LightMap, lights::LightKind};

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
    /// Texels along the side of its tile.
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
    /// Layer of the textures.
    pub page: u32,
    /// Surfaces outside of this box cast, but do not bounce. Metres.
    pub bounce_min: Vec3,
    pub bounce_max: Vec3,
    /// Corner of its tile, texels.
    pub origin: UVec2,
}

impl GpuRsmMap {
    /// A map as it is once this frame's are drawn: its texels are of when they were drawn, the light's colour is always
    /// that of now.
    pub(crate) fn new(map: &LightMap) -> Self {
        let base = Self {
            clip_from_world: map.view.clip_from_world,
            // From afar, a rect light is one of an intensity: luminance times area.
            color: match map.now.kind {
                kind if kind == LightKind::Rect as u32 => map.now.color * map.now.area(),
                _ => map.now.color,
            },
            kind: map.now.kind,
            light: map.number,
            size: 1,
            bounce_min: map.view.bounces.min.into(),
            bounce_max: map.view.bounces.max.into(),
            ..Self::default()
        };
        let Some((drawn, tile)) = map.shown() else {
            return base;
        };
        let texels = (tile.size * tile.size) as f32;
        // Width of the view over its depth, or the width itself: both are in the projection's first column.
        let half_width = 1.0 / drawn.clip_from_view.x_axis.x;
        let half_height = 1.0 / drawn.clip_from_view.y_axis.y;
        let light = &drawn.light;
        Self {
            clip_from_world: drawn.clip_from_world,
            world_from_clip: drawn.clip_from_world.inverse(),
            position: light.position,
            size: tile.size,
            // A point light looks everywhere.
            direction: match light.kind {
                kind if kind == LightKind::Point as u32 => Vec3::ZERO,
                _ => light.direction,
            },
            flux_scale: 4.0 * half_width * half_height / texels,
            range: light.range,
            cos_inner: light.cos_inner,
            cos_outer: light.cos_outer,
            drawn: 1,
            page: tile.page,
            origin: tile.origin,
            ..base
        }
    }
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
    /// Octahedral 2 x 10 bit, and the number of its map, counted from 1, in the other 12.
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
    /// Virtual point lights of a volume, a power of two.
    pub count: u32,
    /// A [`LightShare`](crate::LightShare).
    pub share: u32,
}
