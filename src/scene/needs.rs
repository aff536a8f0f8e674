//! What of the capture anybody reads this frame: nothing else is drawn.

use bevy::{
    app::{App, Plugin},
    ecs::prelude::*,
    render::{ExtractSchedule, RenderApp},
};

/// Parts of the capture that are read. Only these are captured.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SceneNeeds {
    /// [`SceneVoxels`](super::voxels).
    pub voxels: bool,
    /// [`SceneOpacity`](super::opacity), which requires voxels.
    pub opacity: bool,
    /// Depth of the [`SceneLightMaps`](super::light_maps): shadow maps.
    pub shadows: bool,
    /// Surfaces of the [`SceneLightMaps`](super::light_maps): reflective shadow maps.
    pub rsm: bool,
    /// [`SceneProbes`](super::probes), which require voxels.
    pub probes: bool,
    /// Maximum number of bytes per probe that a technique stores in one buffer. It limits the number of probes,
    /// so that the buffer fits the device.
    pub probe_bytes: u32,
    /// Depth that the primary camera saw in the frame before.
    pub camera_depth: bool,
}

impl SceneNeeds {
    /// Adds the needs of `other`.
    pub fn add(&mut self, other: Self) {
        self.voxels |= other.voxels;
        self.opacity |= other.opacity;
        self.shadows |= other.shadows;
        self.rsm |= other.rsm;
        self.probes |= other.probes;
        self.camera_depth |= other.camera_depth;
        self.probe_bytes = self.probe_bytes.max(other.probe_bytes);
    }
}

/// While extracting: everybody has said what they need.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct NeedsKnown;

pub(crate) struct NeedsPlugin;

impl Plugin for NeedsPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SceneNeeds>()
            .add_systems(ExtractSchedule, forget.before(NeedsKnown));
    }
}

fn forget(mut needs: ResMut<SceneNeeds>) {
    *needs = SceneNeeds::default();
}
