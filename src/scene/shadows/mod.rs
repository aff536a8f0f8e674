//! `SceneShadows`: the depth of the scene as each light sees it.
//!
//! Bevy's own shadow maps cover the camera's frustum only, and only lights that a camera sees have
//! any; bounced light needs all of the volume. One texture array holds a layer per map: a
//! directional light has one, orthographic, around all volumes; a spot one perspective; a point or
//! rect light the six faces of a cube. A map is drawn again only when its light or some caster
//! changed.

use bevy::{
    app::{App, Plugin},
    core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    math::Mat4,
    mesh::MeshVertexBufferLayoutRef,
    pbr::{DrawDepthOnlyPrepass, DrawPrepass, MeshPipelineKey},
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        batching::gpu_preprocessing::GpuPreprocessingSupport,
        diagnostic::RecordDiagnostics,
        render_phase::{AddRenderCommand, DrawFunctions},
        render_resource::*,
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue},
        view::ExtractedView,
    },
};
use std::sync::Arc;

use super::{
    capture::{
        CaptureKind, CaptureKindPlugin, CapturePhase, CapturePhases, CapturePipeline, CaptureQueue,
        CaptureViews, PrepassPipelines, preprocess_captures, sync_views,
    },
    light_views::LitScene,
    lights::{SceneLight, SceneLights, warn_of_lights},
    needs::{NeedsKnown, SceneNeeds},
    visibility::SceneCasters,
    volume::VolumeGrid,
};
use crate::{
    gpu::statistics::{GiStatistics, Tracked},
    schedule::GiSystems,
    settings::GiSettings,
};

/// Depth from the lights: meshes drawn with Bevy's depth-only prepass.
pub(crate) struct ShadowCapture;

impl CaptureKind for ShadowCapture {
    type Param = (
        PrepassPipelines<'static>,
        SRes<DrawFunctions<CapturePhase<Self>>>,
    );
    const KEY: MeshPipelineKey = MeshPipelineKey::DEPTH_PREPASS;

    fn specialize(
        (prepass, draws): &mut SystemParamItem<Self::Param>,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        mesh_key: MeshPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CapturePipeline> {
        let reads_material = mesh_key
            .intersects(MeshPipelineKey::MAY_DISCARD | MeshPipelineKey::PREPASS_READS_MATERIAL);
        let draws = draws.read();
        Some(CapturePipeline {
            pipeline: prepass.specialize(cache, key, material, layout)?,
            draw: if reads_material {
                draws.id::<DrawPrepass>()
            } else {
                draws.id::<DrawDepthOnlyPrepass>()
            },
            reads_material,
        })
    }
}

/// One shadow map.
struct ShadowMap {
    light: Entity,
    face: u32,
    clip_from_world: Mat4,
    /// Of the meshes that it may show, see [`SceneCasters::content`].
    content: u64,
    /// What the layer shows: the matrix, and the content.
    drawn: Option<(Mat4, u64)>,
    /// Whether a mesh was missing then, as its assets were.
    waits: bool,
    draw_now: bool,
}

impl ShadowMap {
    /// The matrix of what the layer shows, which may be frozen.
    fn shown(&self) -> Mat4 {
        self.drawn.map_or(self.clip_from_world, |drawn| drawn.0)
    }
}

/// All shadow maps, in the render world.
#[derive(Resource, Default)]
pub struct SceneShadows {
    maps: Vec<ShadowMap>,
    size: u32,
    layers: Vec<TextureView>,
    texture: Option<Tracked<Texture>>,
    /// All layers.
    pub view: Option<TextureView>,
    /// Compares depths, reverse-Z, bilinear.
    pub sampler: Option<Sampler>,
    /// `array<mat4x4<f32>>`: clip from world of each map.
    pub matrices: StorageBuffer<Vec<Mat4>>,
    /// Grows whenever a map is drawn.
    pub version: u64,
}

impl SceneShadows {
    /// Number of maps.
    pub(crate) fn count(&self) -> u32 {
        self.maps.len() as u32
    }

    /// Texels along the side of a map.
    pub(crate) fn size(&self) -> u32 {
        self.size
    }
}

/// Gives each light its maps, as long as there are any of `max`.
pub(crate) fn assign(lights: &mut [SceneLight], max: usize) {
    let mut next = 0;
    for light in lights {
        let wanted = light.shadow_maps();
        let fits = wanted > 0 && next + wanted <= max;
        light.gpu.shadow = if fits { next as i32 } else { -1 };
        next += if fits { wanted } else { 0 };
    }
}

pub(crate) struct ShadowsPlugin;

impl Plugin for ShadowsPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(CaptureKindPlugin::<ShadowCapture, DrawPrepass>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SceneShadows>()
            .add_render_command::<CapturePhase<ShadowCapture>, DrawDepthOnlyPrepass>()
            .add_systems(
                ExtractSchedule,
                extract_shadow_views
                    .after(super::lights::extract_lights)
                    .after(NeedsKnown),
            )
            .add_systems(
                Render,
                prepare_shadows.in_set(RenderSystems::PrepareResources),
            )
            .add_systems(
                RenderGraph,
                draw_shadows
                    .in_set(GiSystems::CaptureScene)
                    .after(preprocess_captures),
            );
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn extract_shadow_views(
    mut commands: Commands,
    settings: Extract<Res<GiSettings>>,
    casters: Extract<Res<SceneCasters>>,
    grids: Extract<Query<&VolumeGrid>>,
    lights: Res<SceneLights>,
    mut shadows: ResMut<SceneShadows>,
    mut views: ResMut<CaptureViews<ShadowCapture>>,
    mut phases: ResMut<CapturePhases<ShadowCapture>>,
    support: Res<GpuPreprocessingSupport>,
    needs: Res<SceneNeeds>,
    statistics: Res<GiStatistics>,
) {
    let shadows = &mut *shadows;
    if shadows.size != settings.shadow_map_size {
        shadows.size = settings.shadow_map_size;
        shadows.texture = None;
    }
    let casting = casters.casters.iter().filter(|caster| caster.shadow);
    let scene = LitScene::new(grids.iter(), casting);
    let mut maps = Vec::new();
    let mut wanted = Vec::new();
    let mut without = 0;
    if let (Some(scene), true) = (scene, needs.shadows) {
        for light in &lights.lights {
            if light.gpu.shadow < 0 {
                without += usize::from(light.shadow_maps() > 0);
                continue;
            }
            for view in scene.views(light) {
                maps.push(ShadowMap {
                    light: light.entity,
                    face: view.face,
                    clip_from_world: view.view.clip_from_world(),
                    content: view.content,
                    drawn: None,
                    waits: false,
                    draw_now: false,
                });
                wanted.push(view.wanted(light.entity, shadows.size));
            }
        }
    }
    warn_of_lights(
        &statistics,
        without,
        "bounce without shadows",
        settings.max_shadow_maps,
    );
    for (new, old) in maps.iter_mut().zip(&shadows.maps) {
        if (new.light, new.face) == (old.light, old.face) {
            new.drawn = old.drawn;
            new.waits = old.waits;
        }
    }
    shadows.maps = maps;
    sync_views(&mut commands, &mut views, &mut phases, &support, wanted);
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn prepare_shadows(
    mut shadows: ResMut<SceneShadows>,
    settings: Res<GiSettings>,
    views: Res<CaptureViews<ShadowCapture>>,
    mut queue: ResMut<CaptureQueue>,
    statistics: Res<GiStatistics>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    render_queue: Res<RenderQueue>,
) {
    let shadows = &mut *shadows;
    shadows.sampler.get_or_insert_with(|| {
        device.create_sampler(&SamplerDescriptor {
            label: Some("gi/scene/shadow_sampler"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            compare: Some(CompareFunction::GreaterEqual),
            ..Default::default()
        })
    });
    let layers = shadows.maps.len().max(1) as u32;
    if shadows
        .texture
        .as_ref()
        .map(|t| t.size().depth_or_array_layers)
        != Some(layers)
    {
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("gi/scene/shadow_maps"),
            size: Extent3d {
                width: shadows.size,
                height: shadows.size,
                depth_or_array_layers: layers,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: CORE_3D_DEPTH_FORMAT,
            usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let texture = statistics.texture("scene/shadow_maps", texture);
        shadows.view = Some(texture.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2Array),
            ..Default::default()
        }));
        shadows.layers = (0..layers)
            .map(|layer| {
                texture.create_view(&TextureViewDescriptor {
                    dimension: Some(TextureViewDimension::D2),
                    base_array_layer: layer,
                    array_layer_count: Some(1),
                    ..Default::default()
                })
            })
            .collect();
        shadows.texture = Some(texture);
        for map in &mut shadows.maps {
            map.drawn = None;
        }
    }
    let ready = views.ready(&cache);
    let mut matrices_changed = shadows.matrices.get().is_empty();
    for (i, map) in shadows.maps.iter_mut().enumerate() {
        let current = (map.clip_from_world, map.content);
        let frozen = settings.freeze_capture && map.drawn.is_some() && !map.waits;
        let changed = views.changed(map.light, map.face);
        map.draw_now = !frozen && (map.drawn != Some(current) || changed);
        if map.draw_now {
            map.drawn = (ready && !changed).then_some(current);
            map.waits = views.waits(map.light, map.face);
            queue.0.extend(views.get(map.light, map.face));
            shadows.version += 1;
        }
        matrices_changed |= shadows.matrices.get().get(i) != Some(&map.shown());
    }
    if matrices_changed {
        let mut matrices: Vec<_> = shadows.maps.iter().map(ShadowMap::shown).collect();
        matrices.push(Mat4::IDENTITY);
        shadows.matrices.set(matrices);
        shadows.matrices.write_buffer(&device, &render_queue);
    }
}

fn draw_shadows(
    world: &World,
    shadows: Res<SceneShadows>,
    views: Res<CaptureViews<ShadowCapture>>,
    phases: Res<CapturePhases<ShadowCapture>>,
    extracted: Query<&ExtractedView>,
    mut ctx: RenderContext,
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    if !shadows.maps.iter().any(|map| map.draw_now) {
        return;
    }
    let span = diagnostics.time_span(ctx.command_encoder(), "gi/scene/shadow_maps");
    for (map, layer) in shadows.maps.iter().zip(&shadows.layers) {
        if !map.draw_now {
            continue;
        }
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("gi/scene/shadow_maps"),
            color_attachments: &[],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: layer,
                depth_ops: Some(Operations {
                    load: LoadOp::Clear(0.0),
                    store: StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let Some(view) = views.get(map.light, map.face) else {
            continue;
        };
        let phase = extracted
            .get(view)
            .ok()
            .and_then(|v| phases.get(&v.retained_view_entity));
        if let Some(phase) = phase
            && let Err(error) = phase.render(&mut pass, world, view)
        {
            bevy::log::error!("drawing a shadow map failed: {error:?}");
        }
    }
    span.end(ctx.command_encoder());
}
