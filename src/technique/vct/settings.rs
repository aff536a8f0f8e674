//! [`VoxelConeTracingSettings`] and its presets.

use bevy::{
    ecs::{prelude::ReflectResource, resource::Resource},
    reflect::prelude::*,
    render::extract_resource::ExtractResource,
};
use serde::{Deserialize, Serialize};

use crate::settings::{Clamp, Clamped, FieldRange, GiQuality, SettingsResource};

/// Voxel cone tracing, as a [`Technique`](crate::technique::Technique).
pub struct VoxelConeTracing;

/// Directions of the diffuse cones.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum ConeLayout {
    /// Any number of cones of equal weight on a cosine-distributed spiral, turned by another angle
    /// in each pixel and frame; history and filtering average the turns.
    #[default]
    Spiral,
    /// Five cones: one along the normal, four tilted by 45 degrees, equal weights (Freed 2018,
    /// section 4.5.2).
    Freed2018,
}

/// Parameters of [voxel cone tracing](super).
///
/// The voxels' resolution is that of each [`GiVolume`](crate::GiVolume).
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VoxelConeTracingSettings {
    /// Diffuse cones per gathered pixel (Freed 2018, section 4.5.2). Range 1..=16, default 5. Cost:
    /// proportional.
    pub cones: u32,
    /// How the diffuse cones are arranged. Default [`ConeLayout::Spiral`]. No cost.
    pub cone_layout: ConeLayout,
    /// Full opening angle of a diffuse cone, degrees. Range 10..=90, default 60. Narrower cones are
    /// sharper, see more levels, and cost more steps.
    pub cone_angle: f32,
    /// Step along a cone as a fraction of its diameter. Range 0.25..=1, default 1. Cost:
    /// inversely proportional.
    pub step: f32,
    /// Most steps along a diffuse cone (Freed 2018, listing 4.1). Range 1..=256, default 48. Cost: that
    /// of the steps; few cones need so many.
    pub diffuse_steps: u32,
    /// Most steps along a specular cone. Range 1..=256, default 48. Mirrors need many.
    pub specular_steps: u32,
    /// Distance of a cone's start from the surface, along the normal, voxels. Range 0..=8, default
    /// 1. Too little: surfaces shade themselves; too much: light leaks at contacts.
    pub bias: f32,
    /// Largest cell that a cone reads, as a fraction of its height above the plane it started from.
    /// Larger cells reach back behind that plane, and what lies there shades the surface. Range
    /// 0.1..=4, default 0.18. Cost: smaller cells take more steps.
    pub clearance: f32,
    /// A cone ends once it is this opaque (Freed 2018, listing 4.1: 0.95). Range 0.5..=1, default 0.97.
    pub opacity_cutoff: f32,
    /// How often a fully covered cell counts along a cone. A wall is one cell thick at every level,
    /// and is sampled off its centre: too little, and light leaks through it; too much, and things
    /// grow fatter the further away they are. Range 1..=8, default 2.
    pub density: f32,
    /// The same for cells of the finest level. What is near is seen sharply enough to be dense, and
    /// stops what would leak. Range 1..=8, default 5.
    pub finest_density: f32,
    /// Bounces after the first that still gain light after a change of the scene; lighting goes
    /// on through further ones as long as something changes. Range 0..=16, default 10. Cost: only
    /// while things change.
    pub bounces: u32,
    /// Part of the voxels whose bounced light is traced anew each frame while things change, 1/1,
    /// 1/2, 1/4 or 1/8. Range 1..=8 (the divisor), default 2. Cost: inversely proportional; a
    /// bounce takes as many frames.
    pub bounce_interval: u32,
    /// Cones per voxel when bounced light is traced. Range 1..=16, default 6. Cost: proportional, only
    /// while things change.
    pub bounce_cones: u32,
    /// Whether a specular cone is traced for glossy and metallic surfaces (Crassin 2011, section 7).
    /// Default `true`. Cost: a cone per gathered pixel of such surfaces.
    pub specular: bool,
}

impl Default for VoxelConeTracingSettings {
    fn default() -> Self {
        Self {
            cones: 5,
            cone_layout: ConeLayout::Spiral,
            cone_angle: 60.0,
            step: 1.0,
            diffuse_steps: 48,
            specular_steps: 48,
            bias: 1.0,
            clearance: 0.18,
            opacity_cutoff: 0.97,
            density: 2.0,
            finest_density: 5.0,
            bounces: 10,
            bounce_interval: 2,
            bounce_cones: 6,
            specular: true,
        }
    }
}

impl VoxelConeTracingSettings {
    /// The given quality.
    pub fn preset(quality: GiQuality) -> Self {
        let medium = Self::default();
        match quality {
            GiQuality::Low => Self {
                cones: 4,
                step: 1.0,
                specular_steps: 24,
                bounces: 6,
                bounce_interval: 4,
                bounce_cones: 4,
                ..medium
            },
            GiQuality::Medium => medium,
            GiQuality::High => Self {
                cones: 8,
                cone_angle: 50.0,
                step: 0.8,
                specular_steps: 96,
                bounces: 12,
                bounce_interval: 1,
                bounce_cones: 8,
                ..medium
            },
            GiQuality::Ultra => Self {
                cones: 16,
                cone_angle: 40.0,
                step: 0.6,
                diffuse_steps: 48,
                specular_steps: 192,
                bounces: 16,
                bounce_interval: 1,
                bounce_cones: 16,
                ..medium
            },
        }
    }

    /// The values of Freed 2018: five cones of 45 degrees, half a diameter a step, opacity cut off
    /// at 0.95, one bounce, specular cones of `0.1 pi roughness`. What the thesis leaves open (step
    /// counts, bias) keeps its default.
    pub fn paper() -> Self {
        Self {
            cones: 5,
            cone_layout: ConeLayout::Freed2018,
            cone_angle: 45.0,
            step: 0.5,
            opacity_cutoff: 0.95,
            bounces: 0,
            ..Self::default()
        }
    }
}

impl VoxelConeTracingSettings {
    /// Ranges of the numeric fields.
    pub fn ranges() -> Vec<FieldRange> {
        Clamp::ranges::<Self>()
    }
}

impl Clamped for VoxelConeTracingSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.int("cones", &mut self.cones, 1, 16);
        c.float("cone_angle", &mut self.cone_angle, 10.0, 90.0)
            .unit("°");
        c.float("step", &mut self.step, 0.25, 1.0);
        c.int("diffuse_steps", &mut self.diffuse_steps, 1, 256);
        c.int("specular_steps", &mut self.specular_steps, 1, 256);
        c.float("bias", &mut self.bias, 0.0, 8.0).unit("voxels");
        c.float("clearance", &mut self.clearance, 0.1, 4.0);
        c.float("opacity_cutoff", &mut self.opacity_cutoff, 0.5, 1.0);
        c.float("density", &mut self.density, 1.0, 8.0);
        c.float("finest_density", &mut self.finest_density, 1.0, 8.0);
        c.int("bounces", &mut self.bounces, 0, 16);
        c.int("bounce_interval", &mut self.bounce_interval, 1, 8);
        c.int("bounce_cones", &mut self.bounce_cones, 1, 16);
    }
}

impl SettingsResource for VoxelConeTracingSettings {
    fn presets() -> Vec<(&'static str, Self)> {
        GiQuality::named(Self::preset, Self::paper())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::{check_preset, check_ranges};

    #[test]
    fn presets_are_in_range_and_survive_ron() {
        let presets = GiQuality::ALL.map(VoxelConeTracingSettings::preset);
        for preset in presets.iter().chain([&VoxelConeTracingSettings::paper()]) {
            check_preset("VoxelConeTracingSettings", preset);
        }
    }

    #[test]
    fn every_number_has_a_range() {
        check_ranges(
            &VoxelConeTracingSettings::default(),
            VoxelConeTracingSettings::ranges(),
        );
    }
}
