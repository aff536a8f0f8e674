//! Which maps there are.

use bevy::{
    camera::Camera,
    ecs::prelude::*,
    render::{Extract, batching::gpu_preprocessing::GpuPreprocessingSupport},
    transform::components::GlobalTransform,
};

use super::{
    cache::SceneLightMaps,
    choice::Limits,
    pipelines::{DepthCapture, SurfaceCapture},
    views::LitScene,
};
use crate::{
    camera::GiCamera,
    gpu::statistics::GiStatistics,
    scene::{
        needs::SceneNeeds,
        views::{CapturePhases, CaptureViews, sync_views},
        volume::VolumeGrid,
        world::{
            casters::SceneCasters,
            lights::{SceneLights, warn_of_lights},
        },
    },
    settings::GiCaptureSettings,
};

/// Chooses the maps of this frame, and keeps the views that draw them.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn extract_views(
    mut commands: Commands,
    settings: Extract<Res<GiCaptureSettings>>,
    casters: Extract<Res<SceneCasters>>,
    grids: Extract<Query<(Entity, &VolumeGrid)>>,
    cameras: Extract<Query<(&Camera, &GlobalTransform), With<GiCamera>>>,
    lights: Res<SceneLights>,
    needs: Res<SceneNeeds>,
    mut maps: ResMut<SceneLightMaps>,
    (mut depth_views, mut depth_phases): (
        ResMut<CaptureViews<DepthCapture>>,
        ResMut<CapturePhases<DepthCapture>>,
    ),
    (mut surface_views, mut surface_phases): (
        ResMut<CaptureViews<SurfaceCapture>>,
        ResMut<CapturePhases<SurfaceCapture>>,
    ),
    support: Res<GpuPreprocessingSupport>,
    statistics: Res<GiStatistics>,
) {
    let limits = Limits::new(&settings, &needs);
    let scene = LitScene::new(&grids, &casters, &cameras, limits.surfaces);
    let wanted = maps.choose(
        scene.filter(|_| needs.shadows || needs.rsm),
        &lights.lights,
        limits,
    );
    warn_of_lights(&statistics, maps.maps.without());
    let (depth, surfaces) = match limits.surfaces {
        true => (Vec::new(), wanted),
        false => (wanted, Vec::new()),
    };
    sync_views(
        &mut commands,
        &mut depth_views,
        &mut depth_phases,
        &support,
        depth,
    );
    sync_views(
        &mut commands,
        &mut surface_views,
        &mut surface_phases,
        &support,
        surfaces,
    );
}
