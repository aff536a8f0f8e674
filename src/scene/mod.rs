//! The capture of the scene: geometry, lights and sky, independent of any camera.
//!
//! Data flows one way. [`volume`] is what the user places, [`world`] what Bevy's world says: casters, lights, sky.
//! `views` draws meshes from views that are no cameras. From these come [`SceneLightMaps`](light_maps),
//! [`SceneVoxels`](voxels), [`SceneOpacity`](opacity) and [`SceneProbes`](probes). Techniques read nothing else. Everything inside a [`GiVolume`](volume::GiVolume) is captured, whether it is
//! on screen or not.
//!
//! Only what a technique or a debug view in use reads is captured, and only when it has changed.

pub mod bind_group;
pub mod light_maps;
pub mod opacity;
pub mod probes;
pub mod volume;
pub mod voxels;
pub mod world;

pub(crate) mod bounds;
pub(crate) mod needs;
pub(crate) mod reach;
pub(crate) mod units;
pub(crate) mod views;

use bevy::app::{App, Plugin};

/// The capture of the scene: everything in [`scene`](self).
#[derive(Default)]
pub struct ScenePlugin;

impl Plugin for ScenePlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins((
            needs::NeedsPlugin,
            volume::VolumePlugin,
            volume::cascades::CascadesPlugin,
            world::WorldPlugin,
            units::UnitsPlugin,
            views::ViewsPlugin,
            light_maps::LightMapsPlugin,
            voxels::VoxelsPlugin,
            opacity::OpacityPlugin,
            probes::ProbesPlugin,
            bind_group::SceneBindGroupPlugin,
        ));
    }
}
