//! Which maps there are, and how meshes are drawn into them.

use std::sync::Arc;

use bevy::{
    camera::Camera,
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{DrawPrepass, MeshPipelineKey},
    render::{
        Extract, batching::gpu_preprocessing::GpuPreprocessingSupport, render_phase::DrawFunctions,
        render_resource::*,
    },
    transform::components::GlobalTransform,
};

use super::prepare::SceneRsm;
use crate::{
    camera::GiCamera,
    gpu::statistics::GiStatistics,
    scene::{
        capture::{
            CaptureKind, CapturePhase, CapturePhases, CapturePipeline, CaptureViews,
            PrepassPipelines, sync_views,
        },
        light_maps::Limits,
        light_views::LitScene,
        lights::{SceneLights, warn_of_lights},
        needs::SceneNeeds,
        visibility::SceneCasters,
        volume::VolumeGrid,
    },
    settings::GiSettings,
};

/// The G-buffer from the lights: Bevy's deferred prepass as it is.
pub(crate) struct RsmCapture;

impl CaptureKind for RsmCapture {
    type Param = (
        PrepassPipelines<'static>,
        SRes<DrawFunctions<CapturePhase<Self>>>,
    );
    const KEY: MeshPipelineKey =
        MeshPipelineKey::DEPTH_PREPASS.union(MeshPipelineKey::DEFERRED_PREPASS);

    fn specialize(
        (prepass, draws): &mut SystemParamItem<Self::Param>,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        _: MeshPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CapturePipeline> {
        Some(CapturePipeline {
            pipeline: prepass.specialize(cache, key, material, layout)?,
            draw: draws.read().id::<DrawPrepass>(),
            reads_material: true,
        })
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn extract_rsm_views(
    mut commands: Commands,
    settings: Extract<Res<GiSettings>>,
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
                frozen: settings.freeze_capture,
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
