//! [`RadianceHintsSettings`] and its presets.

use bevy::{
    ecs::{prelude::ReflectResource, resource::Resource},
    reflect::prelude::*,
    render::extract_resource::ExtractResource,
};
use serde::{Deserialize, Serialize};

use crate::settings::{Clamp, Clamped, FieldRange, GiQuality, SettingsResource};

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
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintSampling {
    /// Virtual point lights, which are placed where the light is. They are the same for all hints, and each has
    /// its turn.
    #[default]
    VirtualPointLights,
    /// Random texels of each map in a disk around the projection of the hint (Papaioannou 2011, section 4). The
    /// texels of a hint are always the same. Each counts for its share of the disk; light outside the disk is
    /// left out.
    Disk,
    /// Random texels in a disk, each of which counts for its share of the whole map, as in the paper. The
    /// result is too bright, the more so the smaller the disk.
    DiskLiteral,
}

/// How light on its way to a hint is occluded.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintOcclusion {
    /// No occlusion, as in the paper.
    None,
    /// Some points on the way are compared with the depth seen from the light. Each that is hidden from the
    /// light takes a part of it (section 8 of the paper, from the light instead of the camera).
    LightDepth,
    /// Some points on the way are compared with the depth that the first GI camera saw in the last frame, as in
    /// the paper. The light then depends on the viewpoint, and surfaces outside the view do not occlude.
    CameraDepth,
    /// A ray is traced through the voxels.
    #[default]
    Voxels,
}

/// Where light of the second and later bounces comes from.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintBounce {
    /// From the surfaces that a hint sees. Each is lit by the hints around it and reflects with its own colour.
    #[default]
    Surfaces,
    /// From random points around the hint (section 6 of the paper), as if each were a surface that faces it.
    /// The weight of each is estimated from the distances that hints store. Normalised so that uniform light
    /// keeps its strength times [`average_albedo`](RadianceHintsSettings::average_albedo).
    Hints,
    /// From random points around the hint, with equations 8 and 9 as printed: all light so far bounces again,
    /// and is divided by the number of points once too often.
    HintsLiteral,
}

/// How a surface interpolates the hints.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintReconstruction {
    /// From the eight hints around it, as far as they see it.
    #[default]
    Corners,
    /// From interpolated points in front of the surface (four in the paper): one along the normal, the others
    /// in a ring around it (section 5). Light leaks through walls that are thinner than the distance of these
    /// points.
    Taps,
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
    /// in the next frames. With disks, the number of texels over all maps. Range 4..=256, default 96. Cost:
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
    /// Radius of the disk that is sampled, as a fraction of the side of the map. Only with disks as
    /// [`sampling`](Self::sampling). Range 0.02..=1, default 0.35. No cost.
    pub spread: f32,
    /// Weight of the newest frame in the first bounce while meshes move, rounded to a whole number of
    /// accumulated frames. Lower is smoother but lags more. Raised to at least 2/3 while lights change, and as
    /// far as needed for old light to fall to 2 % within [`settle_frames`](Self::settle_frames). Range
    /// 0.05..=1, default 0.5, the value that the paper has for the picture (section 9.1). No cost.
    pub temporal_blend: f32,
    /// How light on its way to a hint is occluded. Default [`HintOcclusion::Voxels`]. Cost: most of the cost of
    /// the samples.
    pub occlusion: HintOcclusion,
    /// Number of points on the way that are compared with a depth (section 8). Only if
    /// [`occlusion`](Self::occlusion) is by depth. Range 1..=8, default 3. Cost: proportional.
    pub occlusion_points: u32,
    /// Part of the light that each hidden point takes. Only if [`occlusion`](Self::occlusion) is by depth.
    /// Range 0..=1, default 0.5; the paper gives no value. No cost.
    pub occlusion_factor: f32,
    /// Distance in cells below which the light of a sampled texel no longer grows, since a texel that
    /// represents many is not a point. Only with disks; virtual point lights store their size. Range 0..=2,
    /// default 0.5. No cost.
    pub min_distance: f32,
    /// Where light of the second and later bounces comes from. Default [`HintBounce::Surfaces`].
    pub bounce: HintBounce,
    /// Number of points around a hint from which light bounces. Only if [`bounce`](Self::bounce) is not from
    /// surfaces. Range 4..=64, default 24. Cost: proportional.
    pub bounce_samples: u32,
    /// Maximum distance of the points from which light bounces, and of the distances that hints store. A
    /// fraction of the volume's diagonal. Range 0.05..=1, default 0.35. No cost.
    pub reach: f32,
    /// Albedo of the points from which light bounces, if [`bounce`](Self::bounce) is not from surfaces and
    /// [`coloured_bounces`](Self::coloured_bounces) is off. Range 0..=1, default 0.5. The paper has 1, with
    /// which light grows without bound in a closed room. No cost.
    pub average_albedo: f32,
    /// Whether light that bounces from hint to hint takes the colour of the surfaces around the point where it
    /// bounces. Without it, [`average_albedo`](Self::average_albedo) is used. Default `true`. The paper names
    /// it as a further step. No cost while only light changes.
    pub coloured_bounces: bool,
    /// Whether points from which light bounces are weighted by their estimated visibility from the hint
    /// (equation 11). Only if [`bounce`](Self::bounce) is not from surfaces, whose visibility is known. Default
    /// `true`. No cost.
    pub guess_visibility: bool,
    /// How a surface interpolates the hints. Default [`HintReconstruction::Corners`]. Cost: taps take half as
    /// many reads.
    pub reconstruction: HintReconstruction,
    /// Number of taps in front of a surface: one along the normal, the others in a ring. Only with
    /// [`HintReconstruction::Taps`]. Range 1..=7, default 4 as in the paper. Cost: proportional.
    pub taps: u32,
    /// Angle between the normal and the taps of the ring in degrees. Only with [`HintReconstruction::Taps`].
    /// Range 45..=85, default 80 as in the paper. No cost.
    pub ring_angle: f32,
    /// Distance of the taps in cells. Only with [`HintReconstruction::Taps`]. Range 0.25..=2, default 1. The
    /// paper has the diagonal of a cell, 1.73. No cost.
    pub tap_distance: f32,
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
            spread: 0.35,
            occlusion: HintOcclusion::Voxels,
            occlusion_points: 3,
            occlusion_factor: 0.5,
            min_distance: 0.5,
            bounce: HintBounce::Surfaces,
            bounce_samples: 24,
            reach: 0.35,
            average_albedo: 0.5,
            coloured_bounces: true,
            guess_visibility: true,
            reconstruction: HintReconstruction::Corners,
            taps: 4,
            ring_angle: 80.0,
            tap_distance: 1.0,
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
            sampling: HintSampling::DiskLiteral,
            spread: 0.35,
            occlusion: HintOcclusion::None,
            bounce: HintBounce::HintsLiteral,
            average_albedo: 1.0,
            coloured_bounces: false,
            reconstruction: HintReconstruction::Taps,
            tap_distance: 1.732,
            specular: false,
            ..Self::default()
        }
    }

    /// For open land under the sun: lit areas are large, and light rarely bounces twice.
    pub fn sun() -> Self {
        Self {
            samples: 64,
            spread: 0.18,
            endless: false,
            ..Self::default()
        }
    }

    /// For rooms: light bounces many times.
    pub fn indoor() -> Self {
        Self {
            spread: 0.53,
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

    /// Ranges of the numeric fields.
    pub fn ranges() -> Vec<FieldRange> {
        Clamp::ranges::<Self>()
    }
}

impl Clamped for RadianceHintsSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.int("samples", &mut self.samples, 4, 256);
        c.int("bounces", &mut self.bounces, 0, 6);
        c.int("settle_frames", &mut self.settle_frames, 1, 128)
            .unit("frames");
        c.float("temporal_blend", &mut self.temporal_blend, 0.05, 1.0);
        c.float("spread", &mut self.spread, 0.02, 1.0);
        c.int("occlusion_points", &mut self.occlusion_points, 1, 8);
        c.float("occlusion_factor", &mut self.occlusion_factor, 0.0, 1.0);
        c.float("min_distance", &mut self.min_distance, 0.0, 2.0)
            .unit("cells");
        c.int("bounce_samples", &mut self.bounce_samples, 4, 64);
        c.float("reach", &mut self.reach, 0.05, 1.0);
        c.float("average_albedo", &mut self.average_albedo, 0.0, 1.0);
        c.int("taps", &mut self.taps, 1, 7);
        c.float("ring_angle", &mut self.ring_angle, 45.0, 85.0)
            .unit("degrees");
        c.float("tap_distance", &mut self.tap_distance, 0.25, 2.0)
            .unit("cells");
        c.float("first_gain", &mut self.first_gain, 0.0, 8.0);
        c.float("later_gain", &mut self.later_gain, 0.0, 8.0);
    }
}

impl SettingsResource for RadianceHintsSettings {
    fn presets() -> Vec<(&'static str, Self)> {
        let mut presets = GiQuality::named(Self::preset, Self::paper());
        presets.extend([
            ("sun", Self::sun()),
            ("indoor", Self::indoor()),
            ("flashlight", Self::flashlight()),
        ]);
        presets
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::{check_preset, check_ranges};

    #[test]
    fn presets_are_in_range_and_survive_ron() {
        for (_, preset) in RadianceHintsSettings::presets() {
            check_preset("RadianceHintsSettings", &preset);
        }
    }

    #[test]
    fn every_number_has_a_range() {
        check_ranges(
            &RadianceHintsSettings::default(),
            RadianceHintsSettings::ranges(),
        );
    }
}
