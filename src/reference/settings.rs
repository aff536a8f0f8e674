//! Parameters of the path tracer.

use bevy::{
    ecs::{prelude::ReflectResource, resource::Resource},
    reflect::prelude::*,
};
use serde::{Deserialize, Serialize};

use crate::settings::{Clamp, Parameters};

/// Diffuse lobe of materials.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum DiffuseModel {
    /// Burley's lobe, as Bevy uses it for its lights.
    #[default]
    Bevy,
    /// Lambert's law, as Bevy uses it for light from probes, and as other path tracers use it.
    Lambert,
}

/// Specular lobe of materials: GGX with height-correlated Smith masking.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum SpecularModel {
    /// With Bevy's factor for light that bounces between microfacets, from Karis' fit (2014). It makes metals
    /// of roughness 0.35 a tenth brighter where they are seen at 60 degrees.
    #[default]
    Bevy,
    /// The lobe alone, as other path tracers use it.
    SingleScattering,
}

/// Most of [`ReferenceSettings::max_bounces`].
const MAX_BOUNCES: u32 = 128;

/// Parameters of the path tracer.
#[derive(Resource, Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReferenceSettings {
    /// Maximum number of reflections between the first surface and the light. 0 leaves direct light and
    /// emission alone. Range 0..=128, default 64; Russian roulette ends most paths earlier, without bias.
    pub max_bounces: u32,
    /// Seed that scrambles the sampling points. Default 0.
    pub seed: u32,
    /// Diffuse lobe of materials. Default [`DiffuseModel::Bevy`].
    pub diffuse: DiffuseModel,
    /// Specular lobe of materials. Default [`SpecularModel::Bevy`].
    pub specular: SpecularModel,
    /// Whether the sky is visible behind the scene. Default `true`.
    pub show_sky: bool,
}

impl Parameters for ReferenceSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.int("max_bounces", &mut self.max_bounces, 0, MAX_BOUNCES);
        c.int("seed", &mut self.seed, 0, u32::MAX);
    }
}

impl Default for ReferenceSettings {
    fn default() -> Self {
        Self {
            max_bounces: 64,
            seed: 0,
            diffuse: DiffuseModel::Bevy,
            specular: SpecularModel::Bevy,
            show_sky: true,
        }
    }
}
