//! [`RadianceHintsSettings`] and its presets.

use bevy::{
    ecs::{prelude::ReflectResource, resource::Resource},
    reflect::prelude::*,
    render::extract_resource::ExtractResource,
};
use serde::{Deserialize, Serialize};

use crate::settings::{Clamp, GiQuality, Parameters, Preset};

/// Radiance hints, as a [`Technique`](crate::technique::Technique). See the [module](super).
pub struct RadianceHints;

/// Order of the spherical harmonics stored per hint, counted as in the paper: the number of bands.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum ShOrder {
    /// Two bands, 4 coefficients per colour channel.
    Two,
    /// Three bands, 9 coefficients per colour channel: sufficient for diffuse reflection.
    #[default]
    Three,
}

impl ShOrder {
    /// Number of coefficients per colour channel.
    pub const fn coefficients(self) -> u32 {
        match self {
            Self::Two => 4,
            Self::Three => 9,
        }
    }
}

/// Which samples of the reflective shadow maps light a hint.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum HintSampling {
    /// Virtual point lights, which are placed where the light is. They are the same for all hints, and each has
    /// its turn.
    #[default]
    VirtualPointLights,
    /// Random texels of each map in a disk around the projection of the hint (Papaioannou 2011, section 4). The
    /// texels of a hint are always the same. Each counts for its share of the disk; light outside the disk is
    /// left out.
    Disk(HintDisk),
    /// Random texels in a disk, each of which counts for its share of the whole map, as in the paper. The
    /// result is too bright, the more so the smaller the disk.
    DiskLiteral(HintDisk),
}

/// The disk of texels of a reflective shadow map that light a hint.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HintDisk {
    /// Radius of the disk, as a fraction of the side of the map. Range 0.02..=1, default 0.35. No cost.
    pub spread: f32,
    /// Distance in cells below which the light of a texel no longer grows, since a texel that represents many is
    /// not a point. Range 0..=2, default 0.5. No cost.
    pub min_distance: f32,
}

impl Default for HintDisk {
    fn default() -> Self {
        Self {
            spread: 0.35,
            min_distance: 0.5,
        }
    }
}

/// How light on its way to a hint is occluded.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum HintOcclusion {
    /// No occlusion, as in the paper.
    None,
    /// Some points on the way are compared with the depth seen from the light. Each that is hidden from the
    /// light takes a part of it (section 8 of the paper, from the light instead of the camera).
    LightDepth(HintDepthTest),
    /// Some points on the way are compared with the depth that the [primary camera](crate::PrimaryGiCamera) saw in
    /// the last frame, as in the paper. The light then depends on the viewpoint, and surfaces outside the view do
    /// not occlude.
    CameraDepth(HintDepthTest),
    /// A ray is traced through the voxels.
    #[default]
    Voxels,
}

/// Points on the way of light to a hint that are compared with a depth (section 8 of the paper).
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HintDepthTest {
    /// Number of points. Range 1..=8, default 3. Cost: proportional.
    pub points: u32,
    /// Part of the light that each hidden point takes. Range 0..=1, default 0.5; the paper gives no value. No
    /// cost.
    pub factor: f32,
}

impl Default for HintDepthTest {
    fn default() -> Self {
        Self {
            points: 3,
            factor: 0.5,
        }
    }
}

/// Where light of the second and later bounces comes from.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum HintBounce {
    /// From the surfaces that a hint sees. Each is lit by the hints around it and reflects with its own colour.
    #[default]
    Surfaces,
    /// From random points around the hint (section 6 of the paper), as if each were a surface that faces it.
    /// The weight of each is estimated from the distances that hints store. Normalised so that uniform light
    /// keeps its strength times the [albedo](HintExchange::albedo).
    Hints(HintExchange),
    /// From random points around the hint, with equations 8 and 9 as printed: all light so far bounces again,
    /// and is divided by the number of points once too often.
    HintsLiteral(HintExchange),
}

/// Points around a hint from which light bounces (section 6 of the paper).
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HintExchange {
    /// Number of points. Range 4..=64, default 24. Cost: proportional.
    pub samples: u32,
    /// Maximum distance of the points, and of the distances that hints store. A fraction of the volume's diagonal.
    /// Range 0.05..=1, default 0.35. No cost.
    pub reach: f32,
    /// Albedo of the points. Default [`HintAlbedo::Surfaces`].
    pub albedo: HintAlbedo,
    /// Whether points are weighted by their estimated visibility from the hint (equation 11). Default `true`. No
    /// cost.
    pub guess_visibility: bool,
}

impl Default for HintExchange {
    fn default() -> Self {
        Self {
            samples: 24,
            reach: 0.35,
            albedo: HintAlbedo::Surfaces,
            guess_visibility: true,
        }
    }
}

/// Albedo of the points from which light bounces to a hint.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum HintAlbedo {
    /// The mean albedo of the surfaces around the point, which the paper names as a further step; 0.5 where there
    /// is none. Cost: a pass over the hints after each capture.
    #[default]
    Surfaces,
    /// The same albedo everywhere. Range 0..=1. The paper has 1, with which light grows without bound in a closed
    /// room. No cost.
    Average(f32),
}

/// How a surface interpolates the hints.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum HintReconstruction {
    /// From the eight hints around it, as far as they see it.
    #[default]
    Corners,
    /// From interpolated points in front of the surface: one along the normal, the others in a ring around it
    /// (section 5). Light leaks through walls that are thinner than the distance of these points.
    Taps(HintTaps),
}

/// Points in front of a surface at which hints are interpolated (section 5 of the paper).
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HintTaps {
    /// Number of points: one along the normal, the others in a ring. Range 1..=7, default 4 as in the paper.
    /// Cost: proportional.
    pub count: u32,
    /// Angle between the normal and the points of the ring in degrees. Range 45..=85, default 80 as in the paper.
    /// No cost.
    pub angle: f32,
    /// Distance of the points in cells. Range 0.25..=2, default 1. The paper has the diagonal of a cell, 1.73. No
    /// cost.
    pub distance: f32,
}

impl Default for HintTaps {
    fn default() -> Self {
        Self {
            count: 4,
            angle: 80.0,
            distance: 1.0,
        }
    }
}

/// Parameters of [radiance hints](super).
///
/// The placement of the hints is a parameter of each volume, see [`ProbeSet`](crate::ProbeSet).
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RadianceHintsSettings {
    /// Order of the spherical harmonics stored per hint (Papaioannou 2011, section 5). Default
    /// [`ShOrder::Three`]. Cost: order three takes about twice the memory and the time per pixel of order two.
    pub order: ShOrder,
    /// Number of virtual point lights that each hint samples per frame while light changes; the others follow
    /// in the next frames. With disks as [`sampling`](Self::sampling), the number of texels over all maps. Range 4..=256, default 96. Cost:
    /// proportional, only while things change.
    pub samples: u32,
    /// Number of bounces of light. With 0, only the sky and emissive surfaces light indirectly. Range 0..=6,
    /// default 2. Cost: from the second bounce on, a pass over voxels and a pass over hints each, only while
    /// things change.
    pub bounces: u32,
    /// Whether the last bounce keeps bouncing over the following frames. Default `true`. No cost.
    pub endless: bool,
    /// Number of frames after a change over which light is accumulated; after that, updates stop. Range
    /// 1..=128, default 32. Cost: only in these frames.
    pub settle_frames: u32,
    /// Which samples of the reflective shadow maps light a hint. Default [`HintSampling::VirtualPointLights`].
    pub sampling: HintSampling,
    /// Weight of the newest frame in the first bounce while meshes move, rounded to a whole number of
    /// accumulated frames. Lower is smoother but lags more. Raised to at least 2/3 while lights change, and as
    /// far as needed for old light to fall to 2 % within [`settle_frames`](Self::settle_frames). Range
    /// 0.05..=1, default 0.5, the value that the paper has for the picture (section 9.1). No cost.
    pub temporal_blend: f32,
    /// How light on its way to a hint is occluded. Default [`HintOcclusion::Voxels`]. Cost: most of the cost of
    /// the samples.
    pub occlusion: HintOcclusion,
    /// Where light of the second and later bounces comes from. Default [`HintBounce::Surfaces`].
    pub bounce: HintBounce,
    /// How a surface interpolates the hints. Default [`HintReconstruction::Corners`]. Cost: taps take half as
    /// many reads.
    pub reconstruction: HintReconstruction,
    /// Whether glossy surfaces receive specular light, looked up along the mirror direction. Without it, they
    /// receive none. Default `true`. Cost: as much again per pixel of such surfaces.
    pub specular: bool,
    /// Factor on the light of lamps after one bounce, as it is displayed; later bounces are not affected. 1 is
    /// physical. Range 0..=8, default 1. No cost.
    pub first_gain: f32,
    /// Factor on the light of later bounces, as it is displayed. 1 is physical. Range 0..=8, default 1. No
    /// cost.
    pub later_gain: f32,
}

impl Default for RadianceHintsSettings {
    fn default() -> Self {
        Self {
            order: ShOrder::Three,
            samples: 96,
            bounces: 2,
            endless: true,
            settle_frames: 32,
            temporal_blend: 0.5,
            sampling: HintSampling::VirtualPointLights,
            occlusion: HintOcclusion::Voxels,
            bounce: HintBounce::Surfaces,
            reconstruction: HintReconstruction::Corners,
            specular: true,
            first_gain: 1.0,
            later_gain: 1.0,
        }
    }
}

impl RadianceHintsSettings {
    /// Settings of a quality level. The numbers of hints and voxels are not part of it, since they depend on
    /// the scene: see [`ProbeSet`](crate::ProbeSet) and [`GiVolume`](crate::GiVolume).
    pub fn preset(quality: GiQuality) -> Self {
        let medium = Self::default();
        match quality {
            GiQuality::Low => Self {
                order: ShOrder::Two,
                samples: 48,
                settle_frames: 16,
                ..medium
            },
            GiQuality::Medium => medium,
            GiQuality::High => Self {
                samples: 144,
                settle_frames: 48,
                ..medium
            },
            GiQuality::Ultra => Self {
                samples: 256,
                settle_frames: 64,
                ..medium
            },
        }
    }

    /// Settings of Papaioannou 2011: order two, 50 texels in disks, no occlusion, two bounces by its equations
    /// as printed, four taps at the distance of a cell's diagonal. The number of hints is a parameter of the
    /// [`ProbeSet`](crate::ProbeSet); the paper has 10 to 32 along the longest side.
    pub fn paper() -> Self {
        Self {
            order: ShOrder::Two,
            samples: 50,
            bounces: 2,
            endless: false,
            settle_frames: 1,
            sampling: HintSampling::DiskLiteral(HintDisk::default()),
            occlusion: HintOcclusion::None,
            bounce: HintBounce::HintsLiteral(HintExchange {
                albedo: HintAlbedo::Average(1.0),
                ..HintExchange::default()
            }),
            reconstruction: HintReconstruction::Taps(HintTaps {
                distance: 1.732,
                ..HintTaps::default()
            }),
            specular: false,
            ..Self::default()
        }
    }

    /// For open land under the sun: lit areas are large, and light rarely bounces twice.
    pub fn sun() -> Self {
        Self {
            samples: 64,
            endless: false,
            ..Self::default()
        }
    }

    /// For rooms: light bounces many times.
    pub fn indoor() -> Self {
        Self {
            bounces: 3,
            ..Self::default()
        }
    }

    /// For a carried lamp: all light comes from one small moving area, so that more samples per frame pay off.
    pub fn flashlight() -> Self {
        Self {
            samples: 192,
            settle_frames: 16,
            ..Self::default()
        }
    }

    /// The same settings, but for what only changes how light at the hints is looked up.
    pub(super) fn without_lookup(&self) -> Self {
        Self {
            specular: true,
            first_gain: 1.0,
            later_gain: 1.0,
            ..self.clone()
        }
    }
}

impl Parameters for RadianceHintsSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.int("samples", &mut self.samples, 4, 256);
        c.int("bounces", &mut self.bounces, 0, 6);
        c.int("settle_frames", &mut self.settle_frames, 1, 128)
            .unit("frames");
        c.float("temporal_blend", &mut self.temporal_blend, 0.05, 1.0);
        c.float("first_gain", &mut self.first_gain, 0.0, 8.0);
        c.float("later_gain", &mut self.later_gain, 0.0, 8.0);

        // Ranges are known whatever the variants are now: an editor asks before they are others.
        let (mut disk, mut depth) = Default::default();
        let (mut exchange, mut taps) = Default::default();
        let HintDisk {
            spread,
            min_distance,
        } = match &mut self.sampling {
            HintSampling::Disk(disk) | HintSampling::DiskLiteral(disk) => disk,
            HintSampling::VirtualPointLights => &mut disk,
        };
        c.float("sampling.0.spread", spread, 0.02, 1.0);
        c.float("sampling.0.min_distance", min_distance, 0.0, 2.0)
            .unit("cells");
        let HintDepthTest { points, factor } = match &mut self.occlusion {
            HintOcclusion::LightDepth(test) | HintOcclusion::CameraDepth(test) => test,
            HintOcclusion::None | HintOcclusion::Voxels => &mut depth,
        };
        c.int("occlusion.0.points", points, 1, 8);
        c.float("occlusion.0.factor", factor, 0.0, 1.0);
        let HintExchange {
            samples,
            reach,
            albedo,
            ..
        } = match &mut self.bounce {
            HintBounce::Hints(exchange) | HintBounce::HintsLiteral(exchange) => exchange,
            HintBounce::Surfaces => &mut exchange,
        };
        c.int("bounce.0.samples", samples, 4, 64);
        c.float("bounce.0.reach", reach, 0.05, 1.0);
        let mut none = 0.0;
        let average = match albedo {
            HintAlbedo::Average(albedo) => albedo,
            HintAlbedo::Surfaces => &mut none,
        };
        c.float("bounce.0.albedo.0", average, 0.0, 1.0);
        let HintTaps {
            count,
            angle,
            distance,
        } = match &mut self.reconstruction {
            HintReconstruction::Taps(taps) => taps,
            HintReconstruction::Corners => &mut taps,
        };
        c.int("reconstruction.0.count", count, 1, 7);
        c.float("reconstruction.0.angle", angle, 45.0, 85.0)
            .unit("°");
        c.float("reconstruction.0.distance", distance, 0.25, 2.0)
            .unit("cells");
    }

    fn presets() -> Vec<Preset<Self>> {
        let mut presets =
            GiQuality::presets(|settings: &mut Self, quality| *settings = Self::preset(quality));
        presets.extend([
            Preset::value(GiQuality::PAPER, Self::paper()),
            Preset::value("sun", Self::sun()),
            Preset::value("indoor", Self::indoor()),
            Preset::value("flashlight", Self::flashlight()),
        ]);
        presets
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::{check_presets, check_ranges};

    #[test]
    fn presets_are_in_range_and_survive_ron() {
        check_presets::<RadianceHintsSettings>();
        // What a variant leaves out has its default.
        let read: RadianceHintsSettings = ron::from_str("(sampling: Disk((spread: 0.5)))").unwrap();
        let disk = HintDisk {
            spread: 0.5,
            ..Default::default()
        };
        assert_eq!(read.sampling, HintSampling::Disk(disk));
    }

    #[test]
    fn every_number_has_a_range() {
        check_ranges::<RadianceHintsSettings>();
    }

    #[test]
    fn what_a_variant_holds_is_clamped() {
        let mut settings = RadianceHintsSettings {
            sampling: HintSampling::Disk(HintDisk {
                spread: f32::NAN,
                min_distance: 9.0,
            }),
            bounce: HintBounce::Hints(HintExchange {
                albedo: HintAlbedo::Average(2.0),
                ..Default::default()
            }),
            ..Default::default()
        };
        assert_eq!(Clamp::apply("settings", &mut settings).len(), 3);
        let disk = HintDisk {
            spread: 0.02,
            min_distance: 2.0,
        };
        assert_eq!(settings.sampling, HintSampling::Disk(disk));
        let exchange = HintExchange {
            albedo: HintAlbedo::Average(1.0),
            ..Default::default()
        };
        assert_eq!(settings.bounce, HintBounce::Hints(exchange));
    }
}
