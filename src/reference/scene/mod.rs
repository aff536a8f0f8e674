//! The Bevy world, as the path tracer sees it.

mod layers;
mod lights;
mod materials;
mod meshes;
mod sky;
mod warnings;

use std::fmt;

use bevy::{
    camera::{Camera, Exposure},
    ecs::prelude::*,
    log::warn,
    math::Vec3,
};

use self::{materials::MaterialCollector, meshes::MeshCollector, warnings::Warnings};
use super::{
    distribution::Distribution,
    emitters::Emitters,
    geometry::{Geometry, Hit},
    lights::Light,
    material::{Materials, Vertex},
    sky::Sky,
};
use crate::{
    camera::{GiCamera, PrimaryGiCamera},
    scene::world::viewers::{Viewer, Viewers},
    settings::GiSettings,
};

/// Everything that light paths meet. Made from a world by [`ReferenceScene::new`]; it does not change
/// with the world afterwards.
pub struct ReferenceScene {
    pub(super) geometry: Geometry,
    materials: Materials,
    pub(super) lights: Vec<Light>,
    /// For each light, sets of render layers that do not stand in its way, a bit each: a mesh casts shadows
    /// in the light of those lights with which it shares a layer, as in Bevy.
    pub(super) passes: Vec<u64>,
    pub(super) sky: Sky,
    pub(super) emitters: Emitters,
    /// Of kinds of light: each of `lights`, then all emitters together, then the sky.
    pub(super) light_choice: Distribution,
    /// Whether next-event estimation takes random numbers: not where all light is that of one point.
    pub(super) light_is_drawn: bool,
    /// What could not be taken over, in words.
    warnings: Vec<String>,
}

/// What it was made of; the rest follows from that.
impl fmt::Debug for ReferenceScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ReferenceScene")
            .field("faces", &self.geometry.faces)
            .field("materials", &self.materials)
            .field("lights", &self.lights)
            .field("passes", &self.passes)
            .field("sky", &self.sky)
            .finish_non_exhaustive()
    }
}

impl ReferenceScene {
    /// Takes over the world as it stands: meshes with a `StandardMaterial` and lights that a GI camera would
    /// see if it looked there, and the sky. Transforms must have been propagated.
    pub fn new(world: &mut World) -> Self {
        let settings = world
            .get_resource::<GiSettings>()
            .cloned()
            .unwrap_or_default();
        let primary = primary(world);
        let exposure = primary
            .0
            .and_then(|camera| world.get::<Exposure>(camera).copied())
            .unwrap_or_default()
            .exposure();
        let mut cameras = world.query_filtered::<Viewer, With<GiCamera>>();
        let viewers = Viewers::new(primary, cameras.iter(world));
        let mut warnings = Warnings::default();
        let mut materials = MaterialCollector::new(exposure.max(1e-12), settings.emissive_units);
        let mut meshes = MeshCollector::default();
        meshes.collect(world, &viewers, &mut materials, &mut warnings);
        let lights = lights::lights(world, &viewers);
        let (lights, layers): (Vec<_>, Vec<_>) = lights.into_iter().unzip();
        let sky = sky::sky(world, primary.0, &settings).unwrap_or_else(|why| {
            warnings.add(format!("the sky is left out: {why}"));
            Sky::Constant(Vec3::ZERO)
        });
        for warning in &warnings.0 {
            warn!("reference: {warning}");
        }
        let geometry = Geometry::new(meshes.faces);
        let emitters = Emitters::new(&geometry, &materials.found);
        let weights = light_weights(&lights, &emitters, &sky, geometry.radius());
        let chosen = weights.iter().filter(|w| **w > 0.0).count();
        let extended =
            emitters.power > 0.0 || sky.is_sampled() || lights.iter().any(Light::has_extent);
        Self {
            passes: layers
                .iter()
                .map(|layers| meshes.layers.passes(layers))
                .collect(),
            light_is_drawn: chosen > 1 || extended,
            light_choice: Distribution::new(weights),
            geometry,
            materials: materials.found,
            lights,
            sky,
            emitters,
            warnings: warnings.0,
        }
    }

    /// Triangles.
    pub fn triangles(&self) -> usize {
        self.geometry.faces.len()
    }

    /// What could not be taken over from the world, in words.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Whether there is something at a point of a masked face.
    pub(super) fn is_opaque(&self, hit: &Hit) -> bool {
        let face = &self.geometry.faces[hit.face as usize];
        self.materials.is_opaque(face, hit.barycentric)
    }

    /// The surface at a hit, for what comes along `direction`.
    pub(super) fn vertex(&self, hit: &Hit, direction: Vec3) -> Vertex {
        let face = &self.geometry.faces[hit.face as usize];
        self.materials.vertex(face, hit.barycentric, direction)
    }
}

/// The primary GI camera, in a world that may have none of the plugins.
fn primary(world: &mut World) -> PrimaryGiCamera {
    let mut cameras = world.query_filtered::<(Entity, &Camera), With<GiCamera>>();
    PrimaryGiCamera::of(cameras.iter(world))
}

/// How often next-event estimation looks at each light, at all emitters together, and at the sky, in a scene of that
/// radius: lights by their power, and each at least sometimes, as what is near is not known here.
fn light_weights(lights: &[Light], emitters: &Emitters, sky: &Sky, radius: f32) -> Vec<f32> {
    let mut weights: Vec<f32> = lights.iter().map(|light| light.power(radius)).collect();
    weights.push(emitters.power);
    let total: f32 = weights.iter().sum();
    let sources = weights.iter().filter(|w| **w > 0.0).count().max(1) as f32;
    for weight in &mut weights {
        if *weight > 0.0 {
            *weight = 0.5 * *weight / total + 0.5 / sources;
        }
    }
    let others: f32 = weights.iter().sum();
    weights.push(if sky.is_sampled() {
        others.max(1e-6)
    } else {
        0.0
    });
    weights
}
