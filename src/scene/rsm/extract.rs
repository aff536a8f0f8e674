//! Which maps there are.

use bevy::{
    camera::Camera,
    ecs::prelude::*,
    render::{Extract, batching::gpu_preprocessing::GpuPreprocessingSupport},
    transform::components::GlobalTransform,
};

use super::{cache::SceneRsm, pipelines::RsmCapture};
use crate::{
    camera::GiCamera,
    gpu::statistics::GiStatistics,
    scene::{
        capture::{CapturePhases, CaptureViews, sync_views},
        light_maps::Limits,
        light_views::LitScene,
        lights::{SceneLights, warn_of_lights},
        needs::SceneNeeds,
        visibility::SceneCasters,
        volume::VolumeGrid,
    },
    settings::GiCaptureSettings,
};

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn extract_rsm_views(
    mut commands: Commands,
    settings: Extract<Res<GiCaptureSettings>>,
    casters: Extract<Res<SceneCasters>>,
    grids: Extract<Query<(Entity, &VolumeGrid)>>,
    cameras: Extract<Query<(&Camera, &GlobalTransform), With<GiCamera>>>,
    lights: Res<SceneLights>,
    needs: Res<SceneNeeds>,
    mut rsm: ResMut<SceneRsm>,
    mut views: ResMut<CaptureViews<RsmCapture>>,
    mut phases: ResMut<CapturePhases<RsmCapture>>,
    support: Res<GpuPreprocessingSupport>,
    statistics: Res<GiStatistics>,
) {
    let scene = LitScene::new(&grids, &casters, &cameras).filter(|_| needs.rsm);
    let scene = scene.map(LitScene::of_lit);
    let wanted = match scene {
        Some(scene) => {
            let limits = Limits {
                size: settings.rsm_size,
                own_size: |light| light.rsm_size,
                interval: |light| light.rsm_interval,
                maps: settings.max_shadow_maps,
                updates: settings.rsm_updates as usize,
                frozen: settings.freeze,
            };
            let wanted = rsm.maps.update(&scene, &lights.lights, |_| true, &limits);
            rsm.look_from_volumes(&scene, &lights.lights);
            wanted
        }
        None => {
            rsm.maps.clear();
            Vec::new()
        }
    };
    warn_of_lights(&statistics, rsm.maps.without(), "reflective shadow maps");
    sync_views(&mut commands, &mut views, &mut phases, &support, wanted);
}
