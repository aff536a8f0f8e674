//! The capture of the scene: geometry, lights and sky, independent of any camera.
//!
//! Data flows one way: meshes, lights and sky of the main world become [`SceneVoxels`](voxels),
//! [`SceneLightMaps`](light_maps), [`SceneOpacity`](opacity), [`SceneProbes`](probes) and [`SceneLights`](lights).
//! Techniques read nothing else. Everything inside a [`GiVolume`](volume::GiVolume) is captured, whether it is
//! on screen or not.
//!
//! Only what a technique or a debug view in use reads is captured, and only when it has changed.

pub mod bind_group;
pub mod cascades;
pub mod light_maps;
pub mod lights;
pub mod material;
pub mod opacity;
pub mod probes;
pub mod visibility;
pub mod volume;
pub mod voxels;

mod around;
pub(crate) mod bounds;
pub(crate) mod capture;
pub(crate) mod needs;
pub(crate) mod reach;
pub(crate) mod shapes;
pub(crate) mod sky;
pub(crate) mod units;
pub(crate) mod viewers;

use bevy::{
    app::{App, Plugin},
    pbr::StandardMaterial,
};

/// The capture of the scene: everything in [`scene`](self).
#[derive(Default)]
pub struct ScenePlugin;

impl Plugin for ScenePlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins((
            needs::NeedsPlugin,
            volume::VolumePlugin,
            cascades::CascadesPlugin,
            visibility::VisibilityPlugin,
            lights::LightsPlugin,
            sky::SkyPlugin,
            units::UnitsPlugin,
            material::GiMaterialPlugin::<StandardMaterial>::default(),
            capture::CapturePlugin,
            light_maps::LightMapsPlugin,
            voxels::VoxelsPlugin,
            opacity::OpacityPlugin,
            probes::ProbesPlugin,
            bind_group::SceneBindGroupPlugin,
        ));
    }
}
