//! The reference: a path tracer on the CPU over the same Bevy world (feature `reference`).
//!
//! It reads the world as it stands, and computes what the techniques approximate: light along all paths, with
//! Bevy's own materials (see `bsdf.rs`), lights and sky. Errors of techniques are measured against it.
//!
//! # Method
//!
//! Unidirectional path tracing with next-event estimation to every light, to emissive triangles and to image
//! skies, weighted against sampling of the material (Veach 1997, balance heuristic); Russian roulette from the
//! second bounce on; Owen-scrambled Sobol points (Burley 2020). The result depends only on the scene, the
//! camera, the settings and the number of samples, not on threads or time.
//!
//! # Direct and indirect light
//!
//! *Direct* light is what a camera shows with the technique off: visible emission, plus one reflection of
//! Bevy's lights. All other light is *indirect*, including the light of emissive surfaces and of the sky.
//!
//! # Limits
//!
//! Transparent materials are left out, as in the capture of the techniques. Clearcoat, anisotropy,
//! transmission, fog and ambient occlusion maps are ignored. Lights have no radius, and always cast shadows.
//! [`GiLight`](crate::GiLight) is ignored: it sets how a technique shows a light, not how the light is. Rect
//! lights reflect like all other lights; Bevy's own shader uses Lambert's law for them.

mod bsdf;
mod film;
mod fingerprint;
mod geometry;
mod integrator;
mod lights;
mod sampler;
mod scene;
mod texture;

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use bevy::{
    ecs::{prelude::ReflectResource, resource::Resource},
    math::{UVec2, Vec3},
    reflect::prelude::*,
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use integrator::ReferenceCamera;
pub use scene::ReferenceScene;

use film::Film;
use sampler::Sampler;

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

/// A component of the result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReferenceView {
    /// All light, nits.
    #[default]
    Full,
    /// What a camera shows without global illumination, nits.
    Direct,
    /// All light but the direct light, nits.
    Indirect,
    /// Indirect light that the first surface reflects diffusely, nits.
    Diffuse,
    /// Indirect light that the first surface reflects specularly, nits.
    Specular,
    /// Diffuse albedo of the first surface.
    Albedo,
    /// Shading normal of the first surface in world space.
    Normal,
}

/// A progressively refined picture.
pub struct Reference {
    scene: Arc<ReferenceScene>,
    settings: ReferenceSettings,
    camera: ReferenceCamera,
    film: Film,
}

impl Reference {
    /// An empty picture of `size` pixels.
    pub fn new(
        scene: Arc<ReferenceScene>,
        camera: ReferenceCamera,
        size: UVec2,
        settings: ReferenceSettings,
    ) -> Self {
        Self {
            scene,
            settings,
            camera,
            film: Film::new(size),
        }
    }

    /// Size in pixels.
    pub fn size(&self) -> UVec2 {
        self.film.size
    }

    /// The camera.
    pub fn camera(&self) -> ReferenceCamera {
        self.camera
    }

    /// A number that identifies everything on which the picture depends but its number of samples: the scene,
    /// the camera, the size, the settings, and the path tracer itself.
    pub fn fingerprint(&self) -> u64 {
        fingerprint::of(&(&*self.scene, self.camera, self.film.size, self.settings))
    }

    /// Minimum number of paths per pixel so far.
    pub fn samples(&self) -> u32 {
        self.film.pixels.iter().map(|p| p.count).min().unwrap_or(0)
    }

    /// Traces on all cores until each pixel has `samples` more paths than the current minimum. Returns soon
    /// after `stop` is set, and keeps the paths traced so far. Calls `progress` after each row.
    pub fn render(&mut self, samples: u32, stop: &AtomicBool, progress: impl Fn() + Sync) {
        let target = self.samples() + samples;
        let width = self.film.size.x.max(1);
        let Self {
            scene,
            settings,
            camera,
            film,
        } = self;
        let size = film.size;
        film.pixels
            .par_chunks_mut(width as usize)
            .enumerate()
            .for_each(|(y, row)| {
                for (x, pixel) in row.iter_mut().enumerate() {
                    if stop.load(Ordering::Relaxed) {
                        return;
                    }
                    let at = UVec2::new(x as u32, y as u32);
                    while pixel.count < target {
                        let mut sampler =
                            Sampler::new(at.y * width + at.x, pixel.count, settings.seed);
                        let sample =
                            integrator::trace(scene, settings, camera, size, at, &mut sampler);
                        pixel.add(&sample);
                    }
                }
                progress();
            });
    }

    /// The picture so far, row by row from the top.
    pub fn picture(&self, view: ReferenceView) -> Vec<Vec3> {
        self.film.picture(view)
    }
}
