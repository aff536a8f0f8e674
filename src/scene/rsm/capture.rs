//! Which maps there are, and how meshes are drawn into them.

use std::sync::Arc;

use bevy::{
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    math::{
        Mat4, UVec2, Vec3,
        bounding::{Aabb3d, BoundingVolume},
    },
    mesh::MeshVertexBufferLayoutRef,
    pbr::{DrawPrepass, MeshPipelineKey},
    render::{
        Extract, batching::gpu_preprocessing::GpuPreprocessingSupport, render_phase::DrawFunctions,
        render_resource::*,
    },
};

use super::{prepare::SceneRsm, types::GpuRsmMap};
use crate::{
    scene::{
        capture::{
            CaptureKind, CapturePhase, CapturePhases, CapturePipeline, CaptureViews,
            PrepassPipelines, WantedView, sync_views,
        },
        light_views::{MapView, light_views},
        lights::{LightKind, SceneLight, SceneLights},
        needs::SceneNeeds,
        visibility::{SceneCasters, grid_bounds, overlaps},
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
    /// What the layer shows.
    pub drawn: Option<Drawn>,
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
        direction: gpu.direction,
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
) {
    let volumes = grids
        .iter()
        .filter_map(|grid| grid.0.as_ref().map(grid_bounds))
        .reduce(|a, b| a.merge(&b));
    let casting = casters.casters.iter().map(|c| c.bounds);
    let casting = casting.reduce(|a, b| a.merge(&b));

    let mut maps = Vec::new();
    let mut wanted = Vec::new();
    if let (Some(volumes), Some(casting), true) = (volumes, casting, needs.rsm) {
        for (number, light) in lights.lights.iter().enumerate() {
            let reach = Aabb3d::new(light.gpu.position, Vec3::splat(light.gpu.range));
            let unbounded = light.gpu.kind == LightKind::Directional as u32;
            // What a lamp cannot reach, it does not light: then it has no maps.
            if !unbounded && !overlaps(&reach, &volumes) {
                continue;
            }
            let reached = || {
                let all = casters.casters.iter();
                all.filter(|c| unbounded || overlaps(&c.bounds, &reach))
            };
            let size = light.rsm_size.unwrap_or(settings.rsm_size);
            let size = size.next_power_of_two();
            let views = light_views(light, &volumes, &casting);
            if maps.len() + views.len() > settings.max_shadow_maps as usize {
                break;
            }
            let content = SceneCasters::content(reached());
            for (face, view) in views.into_iter().enumerate() {
                let face = face as u32;
                let gpu = gpu_map(light, number, &view, size);
                if gpu.world_from_clip.is_finite() && gpu.world_from_clip != Mat4::ZERO {
                    maps.push(RsmMap {
                        light: light.entity,
                        face,
                        gpu,
                        content,
                        drawn: None,
                        age: u32::MAX,
                        interval: light.rsm_interval,
                        draw_now: false,
                    });
                    wanted.push(WantedView {
                        owner: light.entity,
                        index: face,
                        clip_from_view: view.clip_from_view,
                        world_from_view: view.world_from_view,
                        size: UVec2::splat(size),
                        meshes: reached().map(|c| c.entity).collect(),
                    });
                }
            }
        }
    }
    rsm.replace(maps, settings.rsm_updates);
    sync_views(&mut commands, &mut views, &mut phases, &support, wanted);
}
