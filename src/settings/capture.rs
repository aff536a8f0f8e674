//! [`GiCaptureSettings`]: what the capture of the scene may cost.

use bevy::{ecs::prelude::*, reflect::prelude::*, render::extract_resource::ExtractResource};
use serde::{Deserialize, Serialize};

use super::{
    parameters::{Clamp, Parameters, Preset},
    quality::GiQuality,
};

/// How samples of the reflective shadow maps are distributed among lights.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum LightShare {
    /// In proportion to the light from each that surfaces reflect. This has the least noise.
    #[default]
    Power,
    /// The same number for each light, so that a dim light beside a bright one is sampled as well.
    Even,
}

/// Budget of the capture of the scene, which all cameras share: shadow maps, reflective shadow maps and virtual
/// point lights.
///
/// The resolution of the voxels is a parameter of each [`GiVolume`](crate::GiVolume). Values out of range are
/// clamped, with one warning that names field, value and range.
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GiCaptureSettings {
    /// Size of each shadow map of bounced light, texels along its side, rounded up to a power of two, while there
    /// is room for all maps at that size. A point or rect light has six maps, a spot light one, a directional
    /// light one per volume. Range 64..=2048, default 512. Cost: 4 bytes per texel.
    pub shadow_map_size: u32,
    /// Memory for light maps, counted in maps of [`shadow_map_size`](Self::shadow_map_size), or of
    /// [`rsm_size`](Self::rsm_size) where only reflective shadow maps are in use. Range 1..=254, default 48.
    /// Where lights need more, their maps are smaller, down to 16 texels; the lights that send the most light
    /// to the position of a GI camera get the most texels. A light whose maps do not fit even then does not
    /// bounce, and a warning says so.
    pub max_shadow_maps: u32,
    /// Size of each reflective shadow map, texels along its side, rounded up to a power of two. Techniques
    /// sample these maps to find the surfaces that a light illuminates. Where shadow maps are in use as well and
    /// are larger, both come from one drawing at their size. Range 64..=2048, default 256. Cost: 24 bytes per
    /// texel.
    pub rsm_size: u32,
    /// Maximum number of reflective shadow maps that are rendered again in a frame, while lights or meshes
    /// move; four times as many where only shadow maps are in use. The others wait their turn. New maps come
    /// first, up to 48 a frame. Range 1..=256, default 12. Cost: proportional.
    pub rsm_updates: u32,
    /// Number of virtual point lights (VPLs) of each volume, which represent all light in the reflective shadow
    /// maps. Rounded up to a power of two, and at least 16 for each light. Range 64..=16384, default 1024.
    /// Cost: 32 bytes each.
    pub vpls: u32,
    /// How virtual point lights and other samples of the reflective shadow maps are distributed among lights.
    /// Default [`LightShare::Power`]. No cost.
    pub light_share: LightShare,
    /// Whether voxels, shadow maps and reflective shadow maps stay as they are, whatever moves. For scenes
    /// whose light may lag, and to inspect a single moment. Default `false`. Saves the cost of captures.
    pub freeze: bool,
}

impl Default for GiCaptureSettings {
    fn default() -> Self {
        Self {
            shadow_map_size: 512,
            max_shadow_maps: 48,
            rsm_size: 256,
            rsm_updates: 12,
            vpls: 1024,
            light_share: LightShare::Power,
            freeze: false,
        }
    }
}

impl GiCaptureSettings {
    /// The same settings with the budget of a quality level: shadow maps of 256, 512, 1024 or 1024 texels, and the
    /// default of all other numbers. [`light_share`](Self::light_share) and [`freeze`](Self::freeze) stay.
    pub fn with_quality(self, quality: GiQuality) -> Self {
        let Self {
            max_shadow_maps,
            rsm_size,
            rsm_updates,
            vpls,
            ..
        } = Self::default();
        Self {
            shadow_map_size: match quality {
                GiQuality::Low => 256,
                GiQuality::Medium => 512,
                GiQuality::High | GiQuality::Ultra => 1024,
            },
            max_shadow_maps,
            rsm_size,
            rsm_updates,
            vpls,
            ..self
        }
    }
}

impl Parameters for GiCaptureSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.int("shadow_map_size", &mut self.shadow_map_size, 64, 2048)
            .unit("px");
        c.int("max_shadow_maps", &mut self.max_shadow_maps, 1, 254)
            .unit("maps");
        c.int("rsm_size", &mut self.rsm_size, 64, 2048).unit("px");
        c.int("rsm_updates", &mut self.rsm_updates, 1, 256)
            .unit("maps");
        c.int("vpls", &mut self.vpls, 64, 16384);
    }

    fn presets() -> Vec<Preset<Self>> {
        let set = |capture: &mut Self, quality| *capture = capture.clone().with_quality(quality);
        let mut presets = GiQuality::presets(set);
        // The papers say nothing of it.
        presets.push(Preset::new(GiQuality::PAPER, move |capture| {
            set(capture, GiQuality::Medium);
        }));
        presets
    }
}
