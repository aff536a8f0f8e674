//! [`VoxelConeTracingSettings`] and its presets.

use bevy::{
    ecs::{prelude::ReflectResource, resource::Resource},
    reflect::prelude::*,
    render::extract_resource::ExtractResource,
};
use serde::{Deserialize, Serialize};

use crate::settings::{Clamp, GiQuality, Parameters, Preset};

/// Voxel cone tracing, as a [`Technique`](crate::technique::Technique). See the [module](super).
pub struct VoxelConeTracing;

/// Directions of the diffuse cones.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum ConeLayout {
    /// Any number of cones of equal weight on a cosine-distributed spiral. The spiral is rotated by a different
    /// angle in each pixel and frame; accumulation and filtering average the rotations.
    #[default]
    Spiral,
    /// Five cones of equal weight: one along the normal, four tilted by 45 degrees (Freed 2018, section 4.5.2).
    Freed2018,
}

/// Parameters of [voxel cone tracing](super).
///
/// The resolution of the voxels is a parameter of each [`GiVolume`](crate::GiVolume).
#[derive(Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VoxelConeTracingSettings {
    /// Number of diffuse cones per gathered pixel (Freed 2018, section 4.5.2). Range 1..=16, default 5. Cost:
    /// proportional.
    pub cones: u32,
    /// Arrangement of the diffuse cones. Default [`ConeLayout::Spiral`]. No cost.
    pub cone_layout: ConeLayout,
    /// Full opening angle of a diffuse cone in degrees. Range 10..=90, default 60. `clearance` bounds the width of cones, too:
    /// with its default, angles above some 15 degrees only blur the sky more.
    pub cone_angle: f32,
    /// Length of a step along a cone, as a fraction of the width of the cells that it reads, which are about as wide as the
    /// cone. Range 0.25..=1, default 1. Cost: inversely proportional.
    pub step: f32,
    /// Maximum number of steps along a diffuse cone (Freed 2018, listing 4.1). What a cone has not met by then counts as
    /// blocked, and looks like what it has met. Range 1..=512, default 256, which a cone along a surface may need to leave
    /// a volume of 256 voxels. Cost: none above the steps that cones take.
    pub diffuse_steps: u32,
    /// Maximum number of steps along a specular cone, as `diffuse_steps`. Range 1..=512, default 256: one of a mirror takes
    /// a step for each two voxels. Cost: none above the steps that cones take.
    pub specular_steps: u32,
    /// Distance of the start of a cone from the surface, along the normal, in voxels. Range 0..=8, default 1.
    /// Too low: surfaces shade themselves. Too high: light leaks at contacts.
    pub bias: f32,
    /// Maximum size of the cells that a cone reads, as a fraction of its height above the plane of the surface
    /// it starts from. Larger cells extend behind that plane, and geometry there shades the surface. Range
    /// 0.1..=4, default 0.18. Cost: smaller cells take more steps.
    pub clearance: f32,
    /// Opacity at which a cone ends (Freed 2018, listing 4.1: 0.95). Range 0.5..=1, default 0.97. Cost: a lower
    /// value ends cones earlier.
    pub opacity_cutoff: f32,
    /// Part of a cone that a fully covered cell stops over its own width. 1 is what the cell covers. Less: light leaks
    /// through walls. More: walls that a cone does not meet in their middle are tight, and distant objects appear
    /// thicker. Range 0.5..=4, default 1.
    pub density: f32,
    /// Number of bounces after the first that are computed after a change of the scene. While the scene keeps
    /// changing, light keeps bouncing beyond that number. Range 0..=16, default 10. Cost: only while things
    /// change.
    pub bounces: u32,
    /// Number of frames in which bounced light is traced once from all voxels, while things change: 1 traces
    /// all voxels in each frame, 8 traces an eighth. Range 1..=8, default 2. Cost: inversely proportional, but
    /// a bounce takes as many frames.
    pub bounce_interval: u32,
    /// Number of cones that trace bounced light, per voxel and per side of a probe that lights forward-rendered
    /// objects. Range 1..=16, default 6. Cost: proportional, only while things change.
    pub bounce_cones: u32,
    /// Whether glossy and metallic surfaces trace a specular cone (Crassin 2011, section 7). Default `true`.
    /// Cost: a cone per gathered pixel of such surfaces.
    pub specular: bool,
}

impl Default for VoxelConeTracingSettings {
    fn default() -> Self {
        Self {
            cones: 5,
            cone_layout: ConeLayout::Spiral,
            cone_angle: 60.0,
            step: 1.0,
            diffuse_steps: 256,
            specular_steps: 256,
            bias: 1.0,
            clearance: 0.18,
            opacity_cutoff: 0.97,
            density: 1.0,
            bounces: 10,
            bounce_interval: 2,
            bounce_cones: 6,
            specular: true,
        }
    }
}

impl VoxelConeTracingSettings {
    /// Settings of a quality level.
    pub fn preset(quality: GiQuality) -> Self {
        let medium = Self::default();
        match quality {
            GiQuality::Low => Self {
                cones: 4,
                step: 1.0,
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
                bounces: 12,
                bounce_interval: 1,
                bounce_cones: 8,
                ..medium
            },
            GiQuality::Ultra => Self {
                cones: 16,
                cone_angle: 40.0,
                step: 0.6,
                bounces: 16,
                bounce_interval: 1,
                bounce_cones: 16,
                ..medium
            },
        }
    }

    /// Settings of Freed 2018: five cones of 45 degrees, steps of half a diameter, opacity cut off at 0.95, one
    /// bounce. What the thesis does not specify (step counts, bias), and its specular cones of `0.1 pi roughness`, keep
    /// their default.
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

impl Parameters for VoxelConeTracingSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.int("cones", &mut self.cones, 1, 16);
        c.float("cone_angle", &mut self.cone_angle, 10.0, 90.0)
            .unit("°");
        c.float("step", &mut self.step, 0.25, 1.0);
        c.int("diffuse_steps", &mut self.diffuse_steps, 1, 512);
        c.int("specular_steps", &mut self.specular_steps, 1, 512);
        c.float("bias", &mut self.bias, 0.0, 8.0).unit("voxels");
        c.float("clearance", &mut self.clearance, 0.1, 4.0);
        c.float("opacity_cutoff", &mut self.opacity_cutoff, 0.5, 1.0);
        c.float("density", &mut self.density, 0.5, 4.0);
        c.int("bounces", &mut self.bounces, 0, 16);
        c.int("bounce_interval", &mut self.bounce_interval, 1, 8);
        c.int("bounce_cones", &mut self.bounce_cones, 1, 16);
    }

    fn presets() -> Vec<Preset<Self>> {
        let mut presets =
            GiQuality::presets(|settings: &mut Self, quality| *settings = Self::preset(quality));
        presets.push(Preset::value(GiQuality::PAPER, Self::paper()));
        presets
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::{check_presets, check_ranges};

    #[test]
    fn presets_are_in_range_and_survive_ron() {
        check_presets::<VoxelConeTracingSettings>();
    }

    #[test]
    fn every_number_has_a_range() {
        check_ranges::<VoxelConeTracingSettings>();
    }
}
