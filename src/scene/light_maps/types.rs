//! GPU structs of light maps; `scene/types.wgsl` has the twin of a map, `types.wgsl` here those of the others.

use bevy::{
    math::{Mat4, UVec2, Vec2, Vec3},
    render::render_resource::ShaderType,
};

use super::choice::{LightMap, Limits};
use crate::scene::world::lights::LightKind;

/// One map.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuLightMap {
    /// Of what its tile shows.
    pub clip_from_world: Mat4,
    pub world_from_clip: Mat4,
    /// As [`GpuLight::color`](crate::scene::world::lights::GpuLight::color) now, lux or candela; of a rect light times its
    /// area, candela too.
    pub color: Vec3,
    /// A [`LightKind`](crate::scene::world::lights::LightKind).
    pub kind: u32,
    /// Where the light is, metres.
    pub position: Vec3,
    /// Texels along the side of its tile of surfaces.
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
    /// Whether surfaces are drawn already.
    pub drawn: u32,
    /// Number of its light; the maps of a light follow each other.
    pub light: u32,
    /// Layer of all textures.
    pub page: u32,
    /// Surfaces outside of this box cast, but do not bounce. Metres.
    pub bounce_min: Vec3,
    pub bounce_max: Vec3,
    /// Corner of its tile of surfaces, texels.
    pub origin: UVec2,
    /// Corner of its tile of depth, over the side of a page.
    pub depth_origin: Vec2,
    /// Side of its tile of depth, over that of a page.
    pub depth_size: f32,
    /// Half a texel of depth, over the side of the tile.
    pub depth_inset: f32,
    /// Whether depth is drawn already.
    pub depth_drawn: u32,
    /// A surface is what depth shows in one of `1 << reduction` squared texels,
    pub reduction: u32,
    /// which lies so far from the surface's corner, in surfaces.
    pub center: f32,
}

impl GpuLightMap {
    /// A map as it is once this frame's are drawn: its texels are of when they were drawn, the light's colour is always
    /// that of now. `side`: of the pages of depth.
    pub(super) fn new(map: &LightMap, side: u32, limits: &Limits) -> Self {
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
        let reduction = limits.reduction;
        let size = tile.size >> reduction;
        // Width of the view over its depth, or the width itself: both are in the projection's first column.
        let half_width = 1.0 / drawn.clip_from_view.x_axis.x;
        let half_height = 1.0 / drawn.clip_from_view.y_axis.y;
        let light = &drawn.light;
        Self {
            clip_from_world: drawn.clip_from_world,
            world_from_clip: drawn.clip_from_world.inverse(),
            position: light.position,
            size,
            // A point light looks everywhere.
            direction: match light.kind {
                kind if kind == LightKind::Point as u32 => Vec3::ZERO,
                _ => light.direction,
            },
            flux_scale: 4.0 * half_width * half_height / (size * size) as f32,
            range: light.range,
            cos_inner: light.cos_inner,
            cos_outer: light.cos_outer,
            drawn: u32::from(drawn.surfaces),
            page: tile.page,
            origin: tile.origin >> reduction,
            depth_origin: tile.origin.as_vec2() / side as f32,
            depth_size: tile.size as f32 / side as f32,
            depth_inset: 0.5 / tile.size as f32,
            depth_drawn: 1,
            reduction,
            center: match reduction {
                0 => 0.5,
                _ => 0.5 + 0.5 / (1_u32 << reduction) as f32,
            },
            ..base
        }
    }
}

/// The buffer of all maps.
#[derive(ShaderType, Clone, Default)]
pub struct GpuLightMaps {
    /// Maps in `array`.
    pub count: u32,
    /// The maps, with an empty one at the end.
    #[shader(size(runtime))]
    pub array: Vec<GpuLightMap>,
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

/// Uniform of `resolve.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuMapResolve {
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
