//! The truth at the press of a key: what the path tracer makes of the picture, in its place.

use bevy::{camera::Exposure, prelude::*};
use bevy_gi::prelude::*;

use crate::{
    live::{LiveReference, watch_scene},
    options,
    overlay::{self, Overlay, OverlayPlugin, OverlaySettings},
    reference,
};

/// Shows the truth while R is held, or while [`ShowTruth`] says so.
pub struct TruthPlugin;

/// Whether the truth is shown all the time.
#[derive(Resource, Default)]
pub struct ShowTruth(pub bool);

/// What the on-screen help says about it.
#[derive(Resource, Default)]
pub struct TruthState {
    /// Paths a pixel so far, if the truth is shown.
    pub samples: Option<u32>,
}

impl Plugin for TruthPlugin {
    fn build(&self, app: &mut App) {
        options::register_reference(app.world_mut());
        app.add_plugins(OverlayPlugin)
            .init_resource::<ShowTruth>()
            .init_resource::<TruthState>()
            .init_resource::<LiveReference>()
            .add_systems(Last, (watch_scene, show).chain());
    }
}

/// The picture over the camera's own, and the technique that the camera shows without it.
struct Shown {
    overlay: Entity,
    material: Handle<Overlay>,
    image: Handle<Image>,
    technique: Option<GiTechnique>,
    samples: Option<u32>,
}

type Seen = (
    Entity,
    &'static Camera,
    &'static GlobalTransform,
    &'static Projection,
    Option<&'static Exposure>,
);

fn show(world: &mut World, mut shown: Local<Option<Shown>>) {
    let held = world
        .resource::<ButtonInput<KeyCode>>()
        .pressed(KeyCode::KeyR);
    let wanted = held || world.resource::<ShowTruth>().0;
    let mut cameras = world.query_filtered::<Seen, With<GiCamera>>();
    let camera = cameras.iter(world).next().and_then(|camera| {
        let (entity, camera, transform, projection, exposure) = camera;
        let size = camera.physical_target_size()?;
        let exposure = exposure.copied().unwrap_or_default().exposure();
        let camera = reference::camera(transform, projection, size);
        Some((entity, camera, size, exposure))
    });
    let Some((entity, camera, size, exposure)) = camera.filter(|_| wanted) else {
        if let Some(shown) = shown.take() {
            world.despawn(shown.overlay);
            let mut cameras = world.query::<&mut GiCamera>();
            for mut camera in cameras.iter_mut(world) {
                camera.technique = shown.technique;
            }
        }
        world.resource_mut::<LiveReference>().stop();
        world.resource_mut::<TruthState>().samples = None;
        return;
    };
    let latest = LiveReference::trace(world, camera, size);
    let samples = latest.as_ref().map_or(0, |latest| latest.samples);
    world.resource_mut::<TruthState>().samples = Some(samples);
    let Some(latest) = latest else { return };
    let view = world.resource::<GiDebugSettings>().view;
    let is_luminance = world.resource::<GiViews>().get(view).is_luminance;
    let settings = OverlaySettings::left(if is_luminance { exposure } else { 1.0 });
    let seen = shown.get_or_insert_with(|| {
        let image = overlay::texture(&latest.picture);
        let image = world.resource_mut::<Assets<Image>>().add(image);
        let material = world.resource_mut::<Assets<Overlay>>().add(Overlay {
            settings,
            left: image.clone(),
            right: image.clone(),
        });
        let bundle = overlay::bundle(&mut world.resource_mut::<Assets<Mesh>>(), material.clone());
        let overlay = world.spawn(bundle).id();
        // Light that is not seen need not be computed.
        let mut gi = world.get_mut::<GiCamera>(entity).unwrap();
        let technique = gi.technique.replace(GiTechnique::OFF);
        Shown {
            overlay,
            material,
            image,
            technique,
            samples: None,
        }
    });
    if seen.samples == Some(samples) && samples > 0 {
        return;
    }
    seen.samples = Some(samples);
    // Into the same texture, as long as the size stays: the material need not change.
    let mut images = world.resource_mut::<Assets<Image>>();
    let resized = images.get(&seen.image).is_none_or(|i| i.size() != size);
    let _ = images.insert(&seen.image, overlay::texture(&latest.picture));
    let mut overlays = world.resource_mut::<Assets<Overlay>>();
    let changed = overlays
        .get(&seen.material)
        .is_none_or(|o| o.settings != settings);
    if (changed || resized)
        && let Some(mut overlay) = overlays.get_mut(&seen.material)
    {
        overlay.settings = settings;
    }
}
