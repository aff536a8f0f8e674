//! [`RadianceHintsSettings`] and its presets.

use bevy::{
    ecs::{prelude::ReflectResource, resource::Resource},
    reflect::prelude::*,
    render::extract_resource::ExtractResource,
};
use serde::{Deserialize, Serialize};

use crate::settings::{Clamp, Clamped, FieldRange, GiQuality, SettingsResource};

/// Radiance hints, as a [`Technique`](crate::technique::Technique).
pub struct RadianceHints;

/// How finely a hint tells directions apart, as the paper counts: bands of spherical harmonics.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum ShOrder {
    /// Two bands, 4 coefficients a colour.
    Two,
    /// Three bands, 9 coefficients a colour: enough for all that a matte surface shows.
    #[default]
    Three,
}

impl ShOrder {
    /// Coefficients of a colour.
    pub const fn coefficients(self) -> u32 {
        match self {
            Self::Two => 4,
            Self::Three => 9,
        }
    }
}

/// Which parts of the reflective shadow maps light a hint.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintSampling {
    /// Virtual point lights, which are where the light is: the same for all hints, each in its turn.
    #[default]
    VirtualPointLights,
    /// Random texels of every map in a disk around the hint as the light sees it (Papaioannou 2011, section
    /// 4), always the same ones. Each counts for its share of the disk; what is outside is left out.
    Disk,
    /// The same, but each counts for its share of the whole map, as the paper has it: too bright the more,
    /// the smaller the disk.
    DiskLiteral,
}

/// What stands between a hint and what lights it.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintOcclusion {
    /// Nothing, as in the paper.
    None,
    /// Some points on the way are compared with what the light sees; each that is hidden from it takes a part
    /// (section 8 of the paper, seen from the light instead of the camera).
    LightDepth,
    /// The same points are compared with what the first GI camera saw in the last frame, as in the paper. Light
    /// depends on where one looks from, and what the camera does not see hides nothing.
    CameraDepth,
    /// A ray through the voxels.
    #[default]
    Voxels,
}

/// How light bounces on.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintBounce {
    /// From the surfaces that a hint sees, each lit by the hints around it, in its own colour.
    #[default]
    Surfaces,
    /// From random places around the hint (section 6 of the paper), as if each were a surface that faces it.
    /// How much each counts is guessed from the distances that hints keep. Normalised so that a field of
    /// the same light everywhere keeps its strength times [`average_albedo`](RadianceHintsSettings).
    Hints,
    /// The same, as equations 8 and 9 are printed: all light so far bounces again, and is divided by the
    /// number of places once too often.
    HintsLiteral,
}

/// How a surface reads the hints.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintReconstruction {
    /// The eight around it, those that see it.
    #[default]
    Corners,
    /// Some points before it, four in the paper, one along the normal and the others around it, each interpolated
    /// (section 5). Light leaks through walls thinner than that.
    Taps,
}

/// Parameters of [radiance hints](super).
///
/// Where the hints stand is up to the [`ProbeSet`](crate::ProbeSet) of each volume.
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RadianceHintsSettings {
    /// Bands of spherical harmonics (Papaioannou 2011, section 5). Default [`ShOrder::Three`]. Cost: order
    /// three has about twice that of order two, in memory and per pixel.
    pub order: ShOrder,
    /// Virtual point lights that each hint looks at in a frame while light changes; others follow in the next
    /// frames. Range 4..=256, default 96. Cost: proportional, only while things change.
    pub samples: u32,
    /// Bounces of light. Range 0..=6, default 2; without any, only the sky and emissive surfaces light indirectly.
    /// Cost: from the second on, a pass over voxels and hints each, only while things change.
    pub bounces: u32,
    /// The last bounce goes on bouncing over the following frames. Default `true`. No cost.
    pub endless: bool,
    /// Frames after a change over which light is accumulated before everything comes to rest. Range
    /// 1..=128, default 32. Cost: only in these frames.
    pub settle_frames: u32,
    /// Which parts of the reflective shadow maps light a hint. Default
    /// [`HintSampling::VirtualPointLights`]. With disks, `samples` are spread over the maps.
    pub sampling: HintSampling,
    /// Radius of the disk, as a fraction of the map's side. Range 0.02..=1, default 0.35. No cost.
    pub spread: f32,
    /// Share of a frame in the light of lamps while meshes move; rounded to whole frames of memory. Less is calmer, and
    /// lags more. At least two thirds while lamps change, and so much that after
    /// [`settle_frames`](Self::settle_frames) no more than a fiftieth of the light of before is left. Range
    /// 0.05..=1, default 0.5, which is what the paper has for the picture (section 9.1). No cost.
    pub temporal_blend: f32,
    /// What stands between a hint and what lights it. Default [`HintOcclusion::Voxels`]. Cost: most of
    /// that of the samples.
    pub occlusion: HintOcclusion,
    /// Points on the way that are compared with a depth, if not with voxels (section 8). Range 1..=8, default 3.
    /// Cost: proportional.
    pub occlusion_points: u32,
    /// What each of them that is hidden takes of the light. Range 0..=1, default 0.5; the paper does not say. No
    /// cost.
    pub occlusion_factor: f32,
    /// Distance within which a texel that stands for many is no point, cells: nearer, light does not grow. Range
    /// 0..=2, default 0.5. Only with disks; virtual point lights know their size. No cost.
    pub min_distance: f32,
    /// How light bounces on. Default [`HintBounce::Surfaces`].
    pub bounce: HintBounce,
    /// Places around a hint from which light bounces, if not from surfaces. Range 4..=64, default 24. Cost:
    /// proportional.
    pub bounce_samples: u32,
    /// How far away those are at most, and the greatest distance that hints keep: a fraction of the
    /// volume's diagonal. Range 0.05..=1, default 0.35. No cost.
    pub reach: f32,
    /// What those reflect. Range 0..=1, default 0.5. The paper has 1, which adds light without end in a
    /// closed room. No cost.
    pub average_albedo: f32,
    /// Whether light that bounces from hint to hint takes the colour of the surfaces around the place where it
    /// does; without, it takes the average albedo. Default `true`. The paper names it as a further step. No cost
    /// while only light changes.
    pub coloured_bounces: bool,
    /// Whether places count the less, the less likely the hint sees them (equation 11), if light does not bounce at
    /// surfaces, where it is known. Default `true`. No cost.
    pub guess_visibility: bool,
    /// How a surface reads the hints. Default [`HintReconstruction::Corners`]. Cost: taps are half as many
    /// reads.
    pub reconstruction: HintReconstruction,
    /// Taps: one along the normal, the others in a ring. Range 1..=7, default 4 as in the paper. Cost:
    /// proportional.
    pub taps: u32,
    /// Angle between the normal and the taps of the ring. Range 45..=85 degrees, default 80 as in the paper. No cost.
    pub ring_angle: f32,
    /// Distance of the taps, cells. Range 0.25..=2, default 1. The paper has a cell's diagonal, 1.73. No cost.
    pub tap_distance: f32,
    /// Whether glossy surfaces look the light in the direction of the mirror up. Without, they get none.
    /// Default `true`. Cost: as much again per pixel of such surfaces.
    pub specular: bool,
    /// Factor on light of lamps that has bounced once, where it is seen. Range 0..=8, default 1, which is physical.
    /// Later bounces start from the physical light. No cost.
    pub first_gain: f32,
    /// Factor on light that has bounced more than that, where it is seen. Range 0..=8, default 1, which is
    /// physical. No cost.
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
    /// The given quality. Neither the number of hints nor that of voxels: these go with the scene, see
    /// [`ProbeSet`](crate::ProbeSet) and [`GiVolume`](crate::GiVolume).
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

    /// As the paper has it (Papaioannou 2011): order two, 50 texels in disks, nothing stands in their way,
    /// two bounces by its equations as printed, four taps a cell's diagonal away. The hints' number is that of
    /// the [`ProbeSet`](crate::ProbeSet); the paper has 10 to 32 along the longest side.
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

    /// For open land under the sun: what is lit is large, and light rarely bounces twice.
    pub fn sun() -> Self {
        Self {
            samples: 64,
            spread: 0.18,
            endless: false,
            ..Self::default()
        }
    }

    /// For rooms: light bounces on and on.
    pub fn indoor() -> Self {
        Self {
            spread: 0.53,
            bounces: 3,
            ..Self::default()
        }
    }

    /// For a carried lamp: all light comes from one small place that moves, so that many samples a frame pay.
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
