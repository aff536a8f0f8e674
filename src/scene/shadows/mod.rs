//! `SceneShadows`: the depth of the scene as each light sees it.
//!
//! Bevy's own shadow maps cover the camera's frustum only, and only lights that a camera sees have
//! any; bounced light needs all of each volume. A directional light has one map for each volume, orthographic,
//! along the volume's own extent; a spot one perspective; a point or rect light the six faces of a cube. Which maps
//! there are, how large they are and when they are drawn is in `light_maps`.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    camera::Camera,
    core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    math::{Mat4, Vec2},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{DrawDepthOnlyPrepass, DrawPrepass, MeshPipelineKey},
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup,
        batching::gpu_preprocessing::GpuPreprocessingSupport,
        diagnostic::RecordDiagnostics,
        render_phase::{AddRenderCommand, DrawFunctions},
        render_resource::*,
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue},
        view::ExtractedView,
    },
    transform::components::GlobalTransform,
};

use super::{
    capture::{
        CaptureKind, CaptureKindPlugin, CapturePhase, CapturePhases, CapturePipeline, CaptureQueue,
        CaptureViews, PrepassPipelines, preprocess_captures, sync_views,
    },
    light_maps::{LightMap, LightMaps, Limits, atlas::Tile},
    light_views::LitScene,
    lights::{SceneLights, warn_of_lights},
    needs::{NeedsKnown, SceneNeeds},
    visibility::SceneCasters,
    volume::VolumeGrid,
};
use crate::{
    camera::GiCamera,
    gpu::{
        caps::supported,
        statistics::{GiStatistics, Tracked},
    },
    schedule::{GiPrepare, GiSystems},
    settings::GiCaptureSettings,
};

const NAME: &str = "gi/scene/shadow_maps";

/// Maps that are drawn again in a frame at most.
const UPDATES: usize = 48;

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

/// A shadow map as shaders see it.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuShadowView {
    /// Of what the tile shows.
    pub clip_from_world: Mat4,
    /// Corner of the tile, over the side of a page.
    pub origin: Vec2,
    /// Side of the tile, over that of a page.
    pub size: f32,
    /// Half a texel, over the side of the tile.
    pub inset: f32,
    /// Layer of the texture array.
    pub page: u32,
    /// Whether the tile shows anything yet.
    pub drawn: u32,
}

impl GpuShadowView {
    fn new(map: &LightMap, side: u32) -> Self {
        let Some((drawn, tile)) = map.shown() else {
            return Self::default();
        };
        Self {
            clip_from_world: drawn.clip_from_world,
            origin: tile.origin.as_vec2() / side as f32,
            size: tile.size as f32 / side as f32,
            inset: 0.5 / tile.size as f32,
            page: tile.page,
            drawn: 1,
        }
    }
}

/// All shadow maps, in the render world.
#[derive(Resource, Default)]
pub struct SceneShadows {
    maps: LightMaps,
    /// A view of each page.
    pages: Vec<TextureView>,
    texture: Option<Tracked<Texture>>,
    /// The texture of before, which is copied into the new one.
    copy: Option<Tracked<Texture>>,
    /// [`LightMaps::layout`] of the texture.
    layout: u64,
    /// All pages.
    pub view: Option<TextureView>,
    /// Compares depths, reverse-Z, bilinear.
    pub sampler: Option<Sampler>,
    /// `array<GpuShadowView>`, an empty one at its end.
    pub views: StorageBuffer<Vec<GpuShadowView>>,
    /// Grows whenever a map is drawn, comes or goes.
    pub version: u64,
}

impl SceneShadows {
    /// Number of maps.
    pub(crate) fn count(&self) -> u32 {
        self.maps.maps.len() as u32
    }

    /// First map of a light by its number, -1 if it has none.
    pub(crate) fn first_map(&self, number: usize) -> i32 {
        self.maps.first(number)
    }
}

pub(crate) struct ShadowsPlugin;

impl Plugin for ShadowsPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "clear.wgsl");
        app.add_plugins(CaptureKindPlugin::<ShadowCapture, DrawPrepass>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SceneShadows>()
            .add_render_command::<CapturePhase<ShadowCapture>, DrawDepthOnlyPrepass>()
            .add_systems(RenderStartup, init_clear.run_if(supported))
            .add_systems(
                ExtractSchedule,
                extract_shadow_views
                    .after(super::lights::extract_lights)
                    .after(NeedsKnown),
            )
            .add_systems(Render, prepare_shadows.in_set(GiPrepare::ShadowMaps))
            .add_systems(
                RenderGraph,
                draw_shadows
                    .in_set(GiSystems::CaptureScene)
                    .after(preprocess_captures),
            );
    }
}

/// Empties a tile: a render pass can only clear all of a page.
#[derive(Resource)]
struct ClearPipeline(CachedRenderPipelineId);

fn init_clear(mut commands: Commands, server: Res<AssetServer>, cache: Res<PipelineCache>) {
    let shader = load_embedded_asset!(server.as_ref(), "clear.wgsl");
    let pipeline = cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("gi/scene/shadow_maps_clear".into()),
        vertex: VertexState {
            shader,
            entry_point: Some("far_away".into()),
            ..Default::default()
        },
        depth_stencil: Some(DepthStencilState {
            format: CORE_3D_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        ..Default::default()
    });
    commands.insert_resource(ClearPipeline(pipeline));
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn extract_shadow_views(
    mut commands: Commands,
    settings: Extract<Res<GiCaptureSettings>>,
    casters: Extract<Res<SceneCasters>>,
    grids: Extract<Query<(Entity, &VolumeGrid)>>,
    cameras: Extract<Query<(&Camera, &GlobalTransform), With<GiCamera>>>,
    lights: Res<SceneLights>,
    mut shadows: ResMut<SceneShadows>,
    mut views: ResMut<CaptureViews<ShadowCapture>>,
    mut phases: ResMut<CapturePhases<ShadowCapture>>,
    support: Res<GpuPreprocessingSupport>,
    needs: Res<SceneNeeds>,
    statistics: Res<GiStatistics>,
) {
    let maps = &mut shadows.maps;
    let scene = LitScene::new(&grids, &casters, &cameras).filter(|_| needs.shadows);
    let wanted = match scene {
        Some(scene) => {
            let limits = Limits {
                size: settings.shadow_map_size,
                own_size: |_| None,
                interval: |_| 1,
                maps: settings.max_shadow_maps,
                updates: UPDATES,
                frozen: settings.freeze,
            };
            maps.update(&scene, &lights.lights, |light| light.shadows, &limits)
        }
        None => {
            maps.clear();
            Vec::new()
        }
    };
    warn_of_lights(&statistics, maps.without(), "shadow maps");
    sync_views(&mut commands, &mut views, &mut phases, &support, wanted);
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn prepare_shadows(
    mut shadows: ResMut<SceneShadows>,
    views: Res<CaptureViews<ShadowCapture>>,
    clear: Option<Res<ClearPipeline>>,
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
    shadows.allocate(&device, &statistics);
    let ready = clear.is_some_and(|clear| cache.get_render_pipeline(clear.0).is_some());
    let drawn = shadows.maps.finish(&views, &cache, ready, &mut queue);
    statistics.count("scene/shadow_maps", shadows.maps.maps.len() as u64);
    statistics.count("scene/shadow_maps_drawn", drawn as u64);
    let side = shadows.maps.atlas.side();
    let maps = shadows.maps.maps.iter();
    let mut array: Vec<_> = maps.map(|map| GpuShadowView::new(map, side)).collect();
    array.push(GpuShadowView::default());
    let changed = *shadows.views.get() != array;
    shadows.version += u64::from(drawn > 0 || changed);
    if changed {
        shadows.views.set(array);
        shadows.views.write_buffer(&device, &render_queue);
    }
}

impl SceneShadows {
    /// Makes room for all tiles; what is drawn stays.
    fn allocate(&mut self, device: &RenderDevice, statistics: &GiStatistics) {
        self.copy = None;
        let pages = self.maps.atlas.pages().max(1);
        let side = self.maps.atlas.side().max(1);
        let stays = self.layout == self.maps.layout;
        let size = self.texture.as_ref().map(|texture| texture.size());
        let size = size.map(|size| (size.width, size.depth_or_array_layers));
        if size.is_some_and(|size| size == (side, pages)) {
            self.layout = self.maps.layout;
            return;
        }
        let texture = device.create_texture(&TextureDescriptor {
            label: Some(NAME),
            size: Extent3d {
                width: side,
                height: side,
                depth_or_array_layers: pages,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: CORE_3D_DEPTH_FORMAT,
            usage: TextureUsages::RENDER_ATTACHMENT
                | TextureUsages::TEXTURE_BINDING
                | TextureUsages::COPY_SRC
                | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let texture = statistics.texture("scene/shadow_maps", texture);
        self.view = Some(texture.create_view(&TextureViewDescriptor {
            dimension: Some(TextureViewDimension::D2Array),
            ..Default::default()
        }));
        let page = |page| {
            texture.create_view(&TextureViewDescriptor {
                dimension: Some(TextureViewDimension::D2),
                base_array_layer: page,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        self.pages = (0..pages).map(page).collect();
        let before = self.texture.replace(texture);
        self.copy = before.filter(|before| stays && before.width() == side);
        self.layout = self.maps.layout;
    }

    /// Copies what is drawn into a texture of another number of pages.
    fn copy_pages(&self, encoder: &mut CommandEncoder) {
        let (Some(before), Some(now)) = (&self.copy, &self.texture) else {
            return;
        };
        let whole = |texture| TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: Origin3d::ZERO,
            aspect: TextureAspect::All,
        };
        let pages = before
            .depth_or_array_layers()
            .min(now.depth_or_array_layers());
        encoder.copy_texture_to_texture(
            whole(&***before),
            whole(&***now),
            Extent3d {
                depth_or_array_layers: pages,
                ..before.size()
            },
        );
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn draw_shadows(
    world: &World,
    shadows: Res<SceneShadows>,
    views: Res<CaptureViews<ShadowCapture>>,
    phases: Res<CapturePhases<ShadowCapture>>,
    extracted: Query<&ExtractedView>,
    clear: Option<Res<ClearPipeline>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    shadows.copy_pages(ctx.command_encoder());
    let clear = clear.and_then(|clear| cache.get_render_pipeline(clear.0));
    let maps = shadows.maps.maps.iter().filter(|map| map.draw_now);
    let tiles: Vec<(&LightMap, Tile)> = maps.filter_map(|map| Some((map, map.tile?))).collect();
    let (Some(clear), false) = (clear, tiles.is_empty()) else {
        return;
    };
    let span = diagnostics.time_span(ctx.command_encoder(), NAME);
    for (map, tile) in tiles {
        let Some(page) = shadows.pages.get(tile.page as usize) else {
            continue;
        };
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some(NAME),
            color_attachments: &[],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: page,
                depth_ops: Some(Operations {
                    load: LoadOp::Load,
                    store: StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let (at, size) = (tile.origin, tile.size);
        let [x, y, side] = [at.x, at.y, size].map(|texels| texels as f32);
        pass.set_viewport(x, y, side, side, 0.0, 1.0);
        pass.set_scissor_rect(at.x, at.y, size, size);
        pass.set_render_pipeline(clear);
        pass.draw(0..3, 0..1);
        let Some(view) = views.get(map.light, map.view.face) else {
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
