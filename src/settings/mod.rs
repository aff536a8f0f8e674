//! [`GiSettings`]: how all cameras are lit. What the capture may cost is in `capture.rs`; what belongs to a camera
//! is in [`GiCamera`](crate::GiCamera).
//!
//! All of these, and the parameters of techniques and of objects of the scene, are [`Parameters`]: their ranges and
//! presets are stated as `parameters.rs` says, `plugin.rs` registers them, and `registry.rs` lists them. The list of
//! all techniques is in `techniques.rs`.

mod capture;
pub(crate) mod name;
mod parameters;
mod plugin;
mod quality;
mod registry;
mod techniques;

use bevy::{
    color::LinearRgba, ecs::prelude::*, reflect::prelude::*,
    render::extract_resource::ExtractResource,
};
use serde::{Deserialize, Serialize};

pub use capture::{GiCaptureSettings, LightShare};
pub use parameters::{Clamp, FieldRange, Parameters, ParametersKind, Preset};
pub(crate) use plugin::Clamping;
pub use plugin::{SettingsComponentPlugin, SettingsPlugin, SettingsResourcePlugin};
pub use quality::GiQuality;
pub use registry::{GiSettingsRegistry, SettingsEntry, SettingsValues};
pub use techniques::{GiTechnique, GiTechniques, Lookup, TechniqueEntry};

/// Unit of a material's emission in global illumination.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum EmissiveUnits {
    /// Emissive surfaces light their surroundings as brightly as they appear on screen, whatever
    /// `StandardMaterial::emissive_exposure_weight` is. The exposure is that of the
    /// [primary camera](crate::PrimaryGiCamera).
    #[default]
    AsSeen,
    /// `StandardMaterial::emissive` is a luminance in nits. Used for comparison with a path tracer.
    Nits,
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

/// How the scene is lit, for all cameras and techniques.
///
/// What belongs to a camera, such as the strength of indirect light and its resolution, is in
/// [`GiCamera`](crate::GiCamera); the budget of shadow maps is in [`GiCaptureSettings`]. Quality levels change
/// nothing here. Values out of range are clamped, with one warning that names field, value and range.
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GiSettings {
    /// Technique of every [`GiCamera`](crate::GiCamera) that does not choose its own. Default `"hints"`,
    /// radiance hints.
    pub technique: GiTechnique,
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
}

impl Default for GiSettings {
    fn default() -> Self {
        Self {
            technique: GiTechnique::default(),
            replace_ambient: false,
            sky: GiSky::Camera,
            emissive_units: EmissiveUnits::AsSeen,
            forward_light: true,
            auto_lights: true,
        }
    }
}

impl Parameters for GiSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        // Its range is known whatever the sky is now: an editor asks before it is a constant.
        let mut none = LinearRgba::BLACK;
        let color = match &mut self.sky {
            GiSky::Constant(color) => color,
            _ => &mut none,
        };
        c.color("sky.0", color, 1e12);
    }
}

/// Resets temporal state on request.
///
/// The caches of all techniques and the histories of all cameras start afresh in the frame after
/// [`reset`](Self::reset). Use it when the scene is replaced, or to make a capture repeatable. After a cut or a
/// teleport of one camera, [`GiCamera::reset`](crate::GiCamera::reset) is enough: light is still known then.
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
    use bevy::reflect::{TypeInfo, Typed, enums::VariantInfo};

    use super::*;

    /// The presets of a type are in range, change nothing when they are applied again, and survive being written and
    /// read.
    pub(crate) fn check_presets<T>()
    where
        T: Parameters + PartialEq + std::fmt::Debug + Serialize + for<'a> Deserialize<'a>,
    {
        assert!(!T::presets().is_empty());
        for preset in T::presets() {
            let mut value = T::default();
            preset.apply(&mut value);
            let mut again = value.clone();
            preset.apply(&mut again);
            assert_eq!(again, value, "{}", preset.name);
            assert!(Clamp::apply("preset", &mut again).is_empty(), "{value:?}");
            let text = ron::to_string(&value).unwrap();
            assert_eq!(ron::from_str::<T>(&text).unwrap(), value, "{text}");
        }
    }

    /// Paths of all numbers in a type, those in variants of enums included.
    fn numbers(info: &TypeInfo, path: &str, found: &mut Vec<String>) {
        if info.is::<f32>() || info.is::<u32>() || info.is::<LinearRgba>() {
            found.push(path.trim_start_matches('.').into());
            return;
        }
        let mut inside = |info: Option<&'static TypeInfo>, name: &str| {
            if let Some(info) = info {
                numbers(info, &format!("{path}.{name}"), found);
            }
        };
        match info {
            TypeInfo::Struct(info) => info
                .iter()
                .for_each(|field| inside(field.type_info(), field.name())),
            TypeInfo::Enum(info) => {
                for variant in info.iter() {
                    match variant {
                        VariantInfo::Struct(info) => info
                            .iter()
                            .for_each(|field| inside(field.type_info(), field.name())),
                        VariantInfo::Tuple(info) => info.iter().for_each(|field| {
                            inside(field.type_info(), &field.index().to_string())
                        }),
                        VariantInfo::Unit(_) => {}
                    }
                }
            }
            _ => {}
        }
    }

    /// Every number of a type has a range, and nothing else has.
    pub(crate) fn check_ranges<T: Parameters + Typed>() {
        let mut expected = Vec::new();
        numbers(T::type_info(), "", &mut expected);
        let mut ranges: Vec<_> = T::ranges().iter().map(|r| r.field.to_owned()).collect();
        for list in [&mut expected, &mut ranges] {
            list.sort();
            list.dedup();
        }
        assert_eq!(ranges, expected, "{}", T::short_type_path());
    }

    #[test]
    fn presets_are_in_range_and_survive_ron() {
        check_presets::<GiCaptureSettings>();
        // What a file leaves out has its default.
        let partial: GiCaptureSettings = ron::from_str("(vpls: 256)").unwrap();
        assert_eq!(
            partial,
            GiCaptureSettings {
                vpls: 256,
                ..Default::default()
            }
        );
    }

    #[test]
    fn quality_keeps_what_is_no_matter_of_quality() {
        let capture = GiCaptureSettings {
            shadow_map_size: 64,
            light_share: LightShare::Even,
            freeze: true,
            ..Default::default()
        };
        let high = capture.with_quality(GiQuality::High);
        assert_eq!(high.shadow_map_size, 1024);
        assert_eq!((high.light_share, high.freeze), (LightShare::Even, true));
    }

    #[test]
    fn bad_values_are_clamped_once() {
        let mut settings = GiSettings {
            sky: GiSky::Constant(LinearRgba::rgb(f32::INFINITY, -1.0, f32::NAN)),
            ..Default::default()
        };
        assert_eq!(Clamp::apply("GiSettings", &mut settings).len(), 3);
        assert_eq!(
            settings.sky,
            GiSky::Constant(LinearRgba::rgb(1e12, 0.0, 0.0))
        );
        assert!(Clamp::apply("GiSettings", &mut settings).is_empty());
        let mut capture = GiCaptureSettings {
            shadow_map_size: u32::MAX,
            rsm_updates: 0,
            ..Default::default()
        };
        assert_eq!(Clamp::apply("GiCaptureSettings", &mut capture).len(), 2);
        assert_eq!((capture.shadow_map_size, capture.rsm_updates), (2048, 1));
    }

    #[test]
    fn every_number_has_a_range() {
        check_ranges::<GiSettings>();
        check_ranges::<GiCaptureSettings>();
    }
}
