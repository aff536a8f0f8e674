//! [`GiSettings`]: parameters common to all techniques, and their presets. Ranges of settings are in
//! `clamp.rs`, the list of all settings resources in `registry.rs`, the list of all techniques in
//! `techniques.rs`.

mod clamp;
mod plugin;
mod registry;
mod techniques;

use bevy::{
    color::LinearRgba, ecs::prelude::*, reflect::prelude::*,
    render::extract_resource::ExtractResource,
};
use serde::{Deserialize, Serialize};

pub use clamp::{Clamp, Clamped, FieldRange};
pub(crate) use plugin::SettingsPlugin;
pub use registry::SettingsResource;
pub(crate) use registry::SettingsResourcePlugin;
pub use registry::{GiSettingsRegistry, SettingsEntry, SettingsValues};
pub use techniques::{GiTechnique, GiTechniques, TechniqueEntry};

/// Resolution at which indirect light is gathered, relative to that of the camera.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum GatherResolution {
    /// One gathered pixel per pixel.
    Full,
    /// One gathered pixel per 2x2 pixels.
    Half,
    /// One gathered pixel per 4x4 pixels.
    #[default]
    Quarter,
}

impl GatherResolution {
    /// Pixels per gathered pixel along each axis: 1, 2 or 4.
    pub const fn divisor(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

/// Unit of a material's emission in global illumination.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum EmissiveUnits {
    /// Emissive surfaces light their surroundings as brightly as they appear on screen, whatever
    /// `StandardMaterial::emissive_exposure_weight` is. The exposure is that of the GI camera with the lowest
    /// `Camera::order`.
    #[default]
    AsSeen,
    /// `StandardMaterial::emissive` is a luminance in nits. Used for comparison with a path tracer.
    Nits,
}

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

/// Light that enters the scene from outside.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum GiSky {
    /// The camera's `EnvironmentMapLight`. Without one, its `Skybox`; without that, its ambient light as a
    /// constant (only with [`GiSettings::replace_ambient`]); otherwise black.
    #[default]
    Camera,
    /// The same luminance from every direction. Linear Rec. 709, nits, each channel 0..=1e12.
    Constant(LinearRgba),
    /// No light from outside.
    Black,
}

/// Quality levels. [`GiSettings::preset`] and the presets of each technique take one.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum GiQuality {
    /// Integrated and old GPUs.
    Low,
    /// The default.
    #[default]
    Medium,
    /// Discrete GPUs.
    High,
    /// Screenshots and comparison.
    Ultra,
}

impl GiQuality {
    /// Every level, lowest first.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Ultra];

    /// Lower-case name, as on the command line of the viewer.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Ultra => "ultra",
        }
    }

    /// All presets of a type under their names, and the values of its paper.
    pub(crate) fn named<T>(preset: impl Fn(Self) -> T, paper: T) -> Vec<(&'static str, T)> {
        let qualities = Self::ALL.into_iter().map(|q| (q.name(), preset(q)));
        qualities.chain([("paper", paper)]).collect()
    }
}

/// Parameters common to all techniques.
///
/// Values out of range are clamped, with one warning that names field, value and range.
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GiSettings {
    /// Technique of every [`GiCamera`](crate::GiCamera) that does not choose its own. Default `"hints"`,
    /// radiance hints.
    pub technique: GiTechnique,
    /// Factor on the indirect light that is added to the picture. 1 is physical. Range 0..=16, default 1. It
    /// does not affect the bounces themselves, so light cannot grow without bound. No cost.
    pub indirect_strength: f32,
    /// Resolution at which indirect light is gathered. Default [`GatherResolution::Quarter`]. Cost: the gather
    /// is proportional to the number of gathered pixels.
    pub gather_resolution: GatherResolution,
    /// Maximum number of frames accumulated in each gathered pixel, 1 = no accumulation. Range 1..=128, default
    /// 64. Reduced automatically while light changes, as far as the noise of the technique allows (cones: to 8,
    /// hints: to 2). Higher values are more stable. Cost: two reads and two writes per gathered pixel.
    pub history_frames: u32,
    /// Radius of the spatial filter in gathered pixels, 0 = no filter. The filter averages light over the same
    /// surface. Range 0..=3, default 1. One more while light changes, if the gather of the technique is noisy
    /// (cones). Higher values are smoother and less detailed. Cost: proportional to `(2 r + 1)^2`.
    pub denoise_radius: u32,
    /// Whether GI replaces the ambient light and the environment map of GI cameras. They are then not added
    /// unoccluded, but enter the scene as its sky, with occlusion. Default `false`. No cost.
    pub replace_ambient: bool,
    /// Source of the light from outside the scene. Default [`GiSky::Camera`].
    pub sky: GiSky,
    /// Unit of the emission of materials. Default [`EmissiveUnits::AsSeen`].
    pub emissive_units: EmissiveUnits,
    /// Whether forward-rendered objects (forward, transparent and custom materials) receive diffuse indirect
    /// light. It comes from probes 8 voxels apart, through Bevy's irradiance volumes. Default `true`. Cost: a
    /// pass over the probes while light changes, and three texture reads in each pixel that Bevy shades.
    pub forward_light: bool,
    /// Whether lights without a [`GiLight`](crate::GiLight) take part. Default `true`.
    pub auto_lights: bool,
    /// Size of each shadow map of bounced light, texels along its side, while there is room for all maps at
    /// that size. A point or rect light has six maps, a spot light one, a directional light one per volume.
    /// Range 64..=2048, default 512. Cost: 4 bytes per texel.
    pub shadow_map_size: u32,
    /// Memory for shadow maps, counted in maps of [`shadow_map_size`](Self::shadow_map_size), and for
    /// reflective shadow maps, counted in maps of [`rsm_size`](Self::rsm_size). Range 1..=254, default 48.
    /// Where lights need more, their maps are smaller, down to 16 texels; the lights that send the most light
    /// to the position of a GI camera get the most texels. A light whose maps do not fit even then does not
    /// bounce, and a warning says so.
    pub max_shadow_maps: u32,
    /// Size of each reflective shadow map, texels along its side, rounded up to a power of two. Techniques
    /// sample these maps to find the surfaces that a light illuminates. There are as many as shadow maps. Range
    /// 64..=2048, default 256. Cost: 20 bytes per texel.
    pub rsm_size: u32,
    /// Maximum number of reflective shadow maps that are rendered again in a frame, while lights or meshes
    /// move. The others wait their turn. New maps come first, up to 48 a frame. Range 1..=256, default 12.
    /// Cost: proportional.
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
    pub freeze_capture: bool,
}

impl Default for GiSettings {
    fn default() -> Self {
        Self {
            technique: GiTechnique::default(),
            indirect_strength: 1.0,
            gather_resolution: GatherResolution::Quarter,
            history_frames: 64,
            denoise_radius: 1,
            replace_ambient: false,
            sky: GiSky::Camera,
            emissive_units: EmissiveUnits::AsSeen,
            forward_light: true,
            auto_lights: true,
            shadow_map_size: 512,
            max_shadow_maps: 48,
            rsm_size: 256,
            rsm_updates: 12,
            vpls: 1024,
            light_share: LightShare::Power,
            freeze_capture: false,
        }
    }
}

impl GiSettings {
    /// Settings of a quality level. Fields that do not affect quality have their defaults.
    pub fn preset(quality: GiQuality) -> Self {
        let (gather_resolution, shadow_map_size) = match quality {
            GiQuality::Low => (GatherResolution::Quarter, 256),
            GiQuality::Medium => (GatherResolution::Quarter, 512),
            GiQuality::High => (GatherResolution::Half, 1024),
            GiQuality::Ultra => (GatherResolution::Full, 1024),
        };
        Self {
            gather_resolution,
            shadow_map_size,
            ..Self::default()
        }
    }

    /// Settings of the papers: one gather per pixel, no accumulation and no filter.
    pub fn paper() -> Self {
        Self {
            gather_resolution: GatherResolution::Full,
            history_frames: 1,
            denoise_radius: 0,
            ..Self::default()
        }
    }

    /// These settings, but with the fields that do not affect quality taken from `other`: the technique, and
    /// what belongs to the scene.
    pub fn with_scene_of(self, other: &Self) -> Self {
        Self {
            technique: other.technique,
            indirect_strength: other.indirect_strength,
            replace_ambient: other.replace_ambient,
            sky: other.sky,
            emissive_units: other.emissive_units,
            forward_light: other.forward_light,
            auto_lights: other.auto_lights,
            freeze_capture: other.freeze_capture,
            ..self
        }
    }

    /// Ranges of the numeric fields.
    pub fn ranges() -> Vec<FieldRange> {
        Clamp::ranges::<Self>()
    }
}

impl Clamped for GiSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.float("indirect_strength", &mut self.indirect_strength, 0.0, 16.0);
        c.int("history_frames", &mut self.history_frames, 1, 128)
            .unit("frames");
        c.int("denoise_radius", &mut self.denoise_radius, 0, 3)
            .unit("px");
        c.int("shadow_map_size", &mut self.shadow_map_size, 64, 2048)
            .unit("px");
        c.int("max_shadow_maps", &mut self.max_shadow_maps, 1, 254)
            .unit("maps");
        c.int("rsm_size", &mut self.rsm_size, 64, 2048).unit("px");
        c.int("rsm_updates", &mut self.rsm_updates, 1, 256)
            .unit("maps");
        c.int("vpls", &mut self.vpls, 64, 16384);
        // Its range is known whatever the sky is now: an editor asks before it is a constant.
        let mut none = LinearRgba::BLACK;
        let color = match &mut self.sky {
            GiSky::Constant(color) => color,
            _ => &mut none,
        };
        c.color("sky", color, 1e12);
    }
}

/// Resets temporal state on request.
///
/// The caches of all techniques and the histories of all cameras start afresh in the frame after
/// [`reset`](Self::reset). Use it after a teleport or a cut, or to make a capture repeatable.
#[derive(Resource, Reflect, ExtractResource, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct GiHistory {
    epoch: u32,
}

impl GiHistory {
    /// Drops all temporal state in the next frame.
    pub fn reset(&mut self) {
        self.epoch = self.epoch.wrapping_add(1);
    }

    /// Number of resets so far.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A preset is in range, and survives being written and read.
    pub(crate) fn check_preset<T>(name: &'static str, preset: &T)
    where
        T: Clamped + Clone + PartialEq + std::fmt::Debug + Serialize + for<'a> Deserialize<'a>,
    {
        let mut clamped = preset.clone();
        assert!(Clamp::apply(name, &mut clamped).is_empty(), "{preset:?}");
        let text = ron::to_string(preset).unwrap();
        assert_eq!(&ron::from_str::<T>(&text).unwrap(), preset, "{text}");
    }

    /// Every number of a settings type has a range, and nothing else has.
    pub(crate) fn check_ranges(value: &dyn Struct, ranges: impl IntoIterator<Item = FieldRange>) {
        let ranges: Vec<_> = ranges.into_iter().collect();
        for i in 0..value.field_len() {
            let field = value.field_at(i).unwrap();
            let number = field.try_downcast_ref::<f32>().is_some()
                || field.try_downcast_ref::<u32>().is_some();
            let name = value.name_at(i).unwrap();
            let has = ranges.iter().any(|range| range.field == name);
            assert_eq!(number, has, "{name}");
        }
    }

    #[test]
    fn presets_are_in_range_and_survive_ron() {
        for quality in GiQuality::ALL {
            check_preset("GiSettings", &GiSettings::preset(quality));
        }
        check_preset("GiSettings", &GiSettings::paper());
        // What a file leaves out has its default.
        let partial: GiSettings = ron::from_str("(history_frames: 7)").unwrap();
        assert_eq!(
            partial,
            GiSettings {
                history_frames: 7,
                ..Default::default()
            }
        );
    }

    #[test]
    fn bad_values_are_clamped_once() {
        let mut settings = GiSettings {
            indirect_strength: f32::NAN,
            history_frames: 0,
            shadow_map_size: u32::MAX,
            sky: GiSky::Constant(LinearRgba::rgb(f32::INFINITY, -1.0, f32::NAN)),
            ..Default::default()
        };
        // Two numbers, the map size, and three channels.
        assert_eq!(Clamp::apply("GiSettings", &mut settings).len(), 6);
        assert_eq!(settings.indirect_strength, 0.0);
        assert_eq!(settings.history_frames, 1);
        assert_eq!(settings.shadow_map_size, 2048);
        assert_eq!(
            settings.sky,
            GiSky::Constant(LinearRgba::rgb(1e12, 0.0, 0.0))
        );
        assert!(Clamp::apply("GiSettings", &mut settings).is_empty());
    }

    #[test]
    fn every_number_has_a_range() {
        // The sky's range is that of the colour in one of its variants.
        let ranges = GiSettings::ranges();
        check_ranges(
            &GiSettings::default(),
            ranges.into_iter().filter(|range| range.field != "sky"),
        );
    }
}
