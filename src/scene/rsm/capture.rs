//! Which maps there are, and how meshes are drawn into them.

use std::sync::Arc;

use bevy::{
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    math::{Mat4, Vec3},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{DrawPrepass, MeshPipelineKey},
    render::{
        Extract, batching::gpu_preprocessing::GpuPreprocessingSupport, render_phase::DrawFunctions,
        render_resource::*,
    },
};

use super::{prepare::SceneRsm, types::GpuRsmMap};
use crate::{
    gpu::statistics::GiStatistics,
    scene::{
        capture::{
            CaptureKind, CapturePhase, CapturePhases, CapturePipeline, CaptureViews,
            PrepassPipelines, sync_views,
        },
        light_views::{LitScene, MapView},
        lights::{LightKind, SceneLight, SceneLights, warn_of_lights},
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

/// One map.
pub(crate) struct RsmMap {
    pub light: Entity,
    pub face: u32,
    pub gpu: GpuRsmMap,
    /// Of the meshes that it may show, see [`SceneCasters::content`].
    pub content: u64,
    /// What its layer shows,
    pub drawn: Option<Drawn>,
    /// and which layer that was in the last frame.
    pub layer: Option<u32>,
    /// Whether a mesh has come into view or left it since.
    pub in_doubt: bool,
    /// Whether it was drawn before all pipelines were compiled.
    pub incomplete: bool,
    /// Whether a mesh was missing then, as its assets were.
    pub waits: bool,
    /// Frames since it was last drawn.
    pub age: u32,
    /// Frames that it stays as it is at least.
    pub interval: u32,
    pub draw_now: bool,
}

/// Everything whose change makes a map wrong.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Drawn {
    /// Without the light's colour, which is not in the texels.
    gpu: GpuRsmMap,
    content: u64,
}

impl RsmMap {
    /// What the texels are of: of now, or of when they were drawn. The light's colour is always that of
    /// now.
    pub fn shown(&self) -> GpuRsmMap {
        let shown = match self.drawn {
            Some(drawn) if !self.draw_now => drawn.gpu,
            _ => self.gpu,
        };
        GpuRsmMap {
            color: self.gpu.color,
            light: self.gpu.light,
            drawn: (self.draw_now || self.drawn.is_some()).into(),
            ..shown
        }
    }

    /// What it should show.
    pub fn wanted(&self) -> Drawn {
        Drawn {
            gpu: GpuRsmMap {
                color: Vec3::ZERO,
                light: 0,
                drawn: 0,
                ..self.gpu
            },
            content: self.content,
        }
    }
}

/// A map as shaders see it.
fn gpu_map(light: &SceneLight, number: usize, view: &MapView, size: u32) -> GpuRsmMap {
    let clip_from_world = view.clip_from_world();
    let texels = (size * size) as f32;
    // Width of the view over its depth, or the width itself: both are in the projection's first column.
    let half_width = 1.0 / view.clip_from_view.x_axis.x;
    let half_height = 1.0 / view.clip_from_view.y_axis.y;
    let gpu = &light.gpu;
    GpuRsmMap {
        clip_from_world,
        world_from_clip: clip_from_world.inverse(),
        color: gpu.color,
        kind: gpu.kind,
        position: gpu.position,
        size,
        // A point light looks everywhere.
        direction: match gpu.kind {
            kind if kind == LightKind::Point as u32 => Vec3::ZERO,
            _ => gpu.direction,
        },
        flux_scale: 4.0 * half_width * half_height / texels,
        half_width: gpu.half_width,
        range: gpu.range,
        half_height: gpu.half_height,
        cos_inner: gpu.cos_inner,
        cos_outer: gpu.cos_outer,
        drawn: 0,
        light: number as u32,
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn extract_rsm_views(
    mut commands: Commands,
    settings: Extract<Res<GiSettings>>,
    casters: Extract<Res<SceneCasters>>,
    grids: Extract<Query<&VolumeGrid>>,
    lights: Res<SceneLights>,
    needs: Res<SceneNeeds>,
    mut rsm: ResMut<SceneRsm>,
    mut views: ResMut<CaptureViews<RsmCapture>>,
    mut phases: ResMut<CapturePhases<RsmCapture>>,
    support: Res<GpuPreprocessingSupport>,
    statistics: Res<GiStatistics>,
) {
    let scene = LitScene::new(grids.iter(), casters.casters.iter()).map(LitScene::of_lit);
    let mut maps = Vec::new();
    let mut wanted = Vec::new();
    let mut without = 0;
    if let (Some(scene), true) = (scene, needs.rsm) {
        for (number, light) in lights.lights.iter().enumerate() {
            // What a lamp cannot reach, it does not light: then it has no maps.
            if !scene.is_reached_by(light) {
                continue;
            }
            let size = light.rsm_size.unwrap_or(settings.rsm_size);
            let size = size.next_power_of_two();
            if maps.len() + light.maps() > settings.max_shadow_maps as usize {
                without += 1;
                continue;
            }
            for view in scene.views(light) {
                let gpu = gpu_map(light, number, &view.view, size);
                if gpu.world_from_clip.is_finite() && gpu.world_from_clip != Mat4::ZERO {
                    maps.push(RsmMap {
                        light: light.entity,
                        face: view.face,
                        gpu,
                        content: view.content,
                        drawn: None,
                        layer: None,
                        in_doubt: false,
                        incomplete: false,
                        waits: false,
                        age: u32::MAX,
                        interval: light.rsm_interval,
                        draw_now: false,
                    });
                    wanted.push(view.wanted(light.entity, size));
                }
            }
        }
    }
    warn_of_lights(
        &statistics,
        without,
        "do not bounce, without a reflective shadow map",
        settings.max_shadow_maps,
    );
    rsm.replace(maps, settings.rsm_updates);
    sync_views(&mut commands, &mut views, &mut phases, &support, wanted);
}
