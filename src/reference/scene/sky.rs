//! The sky of the primary camera.

use bevy::{
    asset::{Assets, Handle},
    color::ColorToComponents,
    ecs::prelude::*,
    image::Image,
    light::{AmbientLight, EnvironmentMapLight, GlobalAmbientLight, Skybox},
    math::{Quat, Vec3},
};

use crate::{
    reference::{
        sky::{Sky, SkyMap},
        texture::Cubemap,
    },
    settings::{GiSettings, GiSky},
};

type CameraSky = (
    Option<&'static EnvironmentMapLight>,
    Option<&'static Skybox>,
    Option<&'static AmbientLight>,
);

/// The sky of a camera as [`GiSettings::sky`] has it; `Err` says why it cannot be taken over.
pub(super) fn sky(
    world: &mut World,
    camera: Option<Entity>,
    settings: &GiSettings,
) -> Result<Sky, String> {
    let mut query = world.query::<CameraSky>();
    let world = &*world;
    let camera = camera.and_then(|camera| query.get(world, camera).ok());
    let (environment, skybox, ambient) = match (settings.sky, camera) {
        (GiSky::Constant(color), _) => return Ok(Sky::Constant(color.to_vec3())),
        (GiSky::Black, _) | (GiSky::Camera, None) => return Ok(Sky::Constant(Vec3::ZERO)),
        (GiSky::Camera, Some(camera)) => camera,
    };
    if let Some(light) = environment {
        return map(world, &light.specular_map, light.intensity, light.rotation);
    }
    if let Some((skybox, image)) = skybox.and_then(|s| Some((s, s.image.as_ref()?))) {
        return map(world, image, skybox.brightness, skybox.rotation);
    }
    if !settings.replace_ambient {
        return Ok(Sky::Constant(Vec3::ZERO));
    }
    let global = world.get_resource::<GlobalAmbientLight>();
    let (color, brightness) = match (ambient, global) {
        (Some(a), _) => (a.color, a.brightness),
        (None, Some(a)) => (a.color, a.brightness),
        (None, None) => Default::default(),
    };
    Ok(Sky::Constant(color.to_linear().to_vec3() * brightness))
}

fn map(world: &World, image: &Handle<Image>, scale: f32, rotation: Quat) -> Result<Sky, String> {
    let images = world.resource::<Assets<Image>>();
    let image = images.get(image).ok_or("its image is not loaded")?;
    let map = SkyMap::new(Cubemap::new(image)?, scale, rotation.inverse());
    Ok(Sky::Map(Box::new(map)))
}
