//! [`GiSettings`]: what holds for every technique, and its presets. Ranges of settings are in
//! `clamp.rs`, the list of all settings resources in `registry.rs`, that of
//! all techniques in `techniques.rs`.

mod clamp;
mod registry;
mod techniques;

use bevy::{
    app::{App, Plugin},
    color::LinearRgba,
    ecs::prelude::*,
    reflect::prelude::*,
    render::extract_resource::{ExtractResource, ExtractResourcePlugin},
};
use serde::{Deserialize, Serialize};

pub use clamp::{Clamp, Clamped, FieldRange};
pub use registry::SettingsResource;
pub(crate) use registry::SettingsResourcePlugin;
pub use registry::{GiSettingsRegistry, SettingsEntry, SettingsValues};
pub use techniques::{GiTechnique, GiTechniques, TechniqueEntry};

/// Resolution at which indirect light is gathered, relative to the camera's.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum GatherResolution {
    /// One gather per pixel.
    Full,
    /// One gather per 2x2 pixels.
    Half,
    /// One gather per 4x4 pixels.
    #[default]
    Quarter,
}

impl GatherResolution {
    /// Pixels per gather along each axis: 1, 2 or 4.
    pub const fn divisor(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

/// How a material's emission becomes light.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum EmissiveUnits {
    /// A surface lights its surroundings as brightly as it looks on screen, whatever
    /// `StandardMaterial::emissive_exposure_weight` says. The exposure is that of the GI camera
    /// with the lowest `Camera::order`.
    #[default]
    AsSeen,
    /// `StandardMaterial::emissive` is a luminance in nits. Used to compare with a path tracer.
    Nits,
}

/// How samples are shared among lights.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum LightShare {
    /// In proportion to the light that surfaces reflect of each: the least noise.
    #[default]
    Power,
    /// The same number to each: a dim light beside a bright one is sampled as well.
    Even,
}

/// The light that arrives from outside of the scene.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum GiSky {
    /// The camera's `EnvironmentMapLight`, else its `Skybox`, else its ambient light as a constant
    /// (only with [`GiSettings::replace_ambient`]), else black.
    #[default]
    Camera,
    /// The same luminance from every direction. Linear Rec. 709, nits, 0..=1e12 each.
    Constant(LinearRgba),
    /// No light from outside.
    Black,
}

/// Quality presets, applied by [`GiSettings::preset`] and by the presets of each technique.
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
    /// Every preset, lowest first.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Ultra];

    /// Lower-case name, as used by the viewer.
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

/// What holds for every technique.
///
/// Values out of range are clamped, with one warning that names field, value and range.
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GiSettings {
    /// The technique of every [`GiCamera`](crate::GiCamera) that names none itself. Default "hints".
    pub technique: GiTechnique,
    /// Factor on the indirect light that is added to the picture. 1 is physical. Range 0..=16,
    /// default 1. Does not change the bounces themselves, so it cannot run away. No cost.
    pub indirect_strength: f32,
    /// Resolution of the gather. Default quarter. Cost of the gather is proportional to its pixels.
    pub gather_resolution: GatherResolution,
    /// Number of past frames blended into each gathered pixel, 1 = none. Range 1..=128, default 64; while light
    /// changes, as few as the technique's noise allows (cones: 8, hints: 2). More is calmer. Cost: two reads and
    /// two writes a gathered pixel.
    pub history_frames: u32,
    /// Gathered pixels to each side over which the light of one surface is averaged, 0 = none. Range
    /// 0..=3, default 1; one more while light changes, where the technique's gather has noise (cones). More is
    /// calmer and less detailed. Cost: proportional to `(2 r + 1)^2`.
    pub denoise_radius: u32,
    /// Leaves out the ambient light and the environment map of GI cameras, and lets their light
    /// arrive as sky through the scene instead, with occlusion. Default `false`. No cost.
    pub replace_ambient: bool,
    /// Where light from outside of the scene comes from. Default [`GiSky::Camera`].
    pub sky: GiSky,
    /// How a material's emission becomes light. Default [`EmissiveUnits::AsSeen`].
    pub emissive_units: EmissiveUnits,
    /// What is not deferred (forward, transparent and own materials) receives diffuse indirect light
    /// from probes 8 voxels apart, through Bevy's irradiance volumes. Default `true`. Cost: a pass over
    /// the probes while light changes, and three texture reads in each pixel that Bevy shades.
    pub forward_light: bool,
    /// Every light without a [`GiLight`](crate::GiLight) takes part. Default `true`.
    pub auto_lights: bool,
    /// Texels along the side of each shadow map that the bounced light uses, while there is room for all at that
    /// size. A point or rect light takes six of them, a spot one, a directional light one for each volume. Range
    /// 64..=2048, default 512. 4 bytes a texel.
    pub shadow_map_size: u32,
    /// Memory for shadow maps, counted in maps of [`shadow_map_size`](Self::shadow_map_size), and for reflective ones,
    /// counted in maps of [`rsm_size`](Self::rsm_size). Where the lights of a scene need more, their maps are smaller, down to
    /// 16 texels: texels go to the lights that send the most light to where a GI camera is. A light for which not even that is
    /// left does not bounce, and a warning says so. Range 1..=254, default 48.
    pub max_shadow_maps: u32,
    /// Texels along the side of each reflective shadow map, rounded up to a power of two: what techniques
    /// see of what a light lights. As many maps as of shadow maps. Range 64..=2048, default 256. 20 bytes a texel.
    pub rsm_size: u32,
    /// Maximum number of reflective shadow maps that are drawn again in a frame, while lights or meshes move; others wait
    /// their turn. New ones come first, up to 48 a frame. Range 1..=256, default 12. Cost: proportional.
    pub rsm_updates: u32,
    /// Virtual point lights that stand for all light in the reflective shadow maps, for each volume; rounded up to a power
    /// of two; at least 16 for each light. Range 64..=16384, default 1024. 32 bytes each.
    pub vpls: u32,
    /// How virtual point lights, and what else is sampled of reflective shadow maps, are shared among lights.
    /// Default [`LightShare::Power`]. No cost.
    pub light_share: LightShare,
    /// Keeps voxels, shadow maps and reflective ones as they are, whatever moves: for scenes whose light may lag, and to
    /// look into a moment. Default `false`. Saves what captures cost.
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
    /// The given quality; what is no question of quality keeps its default.
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

    /// As the papers have it: a gather per pixel, nothing accumulated or filtered.
    pub fn paper() -> Self {
        Self {
            gather_resolution: GatherResolution::Full,
            history_frames: 1,
            denoise_radius: 0,
            ..Self::default()
        }
    }

    /// These settings, but with what is no question of quality as in `other`: the technique, and what
    /// belongs to a scene.
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

impl SettingsResource for GiSettings {
    fn presets() -> Vec<(&'static str, Self)> {
        GiQuality::named(Self::preset, Self::paper())
    }
}

/// Where temporal history is thrown away on request.
///
/// Every cache and every camera's history starts afresh in the frame after [`reset`](Self::reset):
/// after a teleport, a cut, or to make a capture repeatable.
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

/// Registers [`GiSettings`] and [`GiHistory`].
pub(crate) struct SettingsPlugin;

impl Plugin for SettingsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<GiHistory>().add_plugins((
            SettingsResourcePlugin::<GiSettings>::default(),
            ExtractResourcePlugin::<GiHistory>::default(),
        ));
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
    pub(crate) fn check_ranges(
        value: &dyn bevy::reflect::structs::Struct,
        ranges: impl IntoIterator<Item = FieldRange>,
    ) {
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
