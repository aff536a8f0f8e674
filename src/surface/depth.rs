//! Depth that the primary GI camera saw in the last frame: for whoever asks, before any camera has drawn, what is
//! hidden from it.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    core_pipeline::schedule::Core3d,
    ecs::prelude::*,
    math::{Mat4, UVec2},
    render::{
        Render, RenderApp, RenderStartup,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, ViewQuery},
        view::{ExtractedView, ViewUniformOffset},
    },
    shader::load_shader_library,
};

use super::{ViewSurface, surface_layout};
use crate::{
    camera::PrimaryGiCamera,
    gpu::{
        caps::supported,
        compute::{ComputePass, Dispatch, Recorder, block},
        layout::{GroupLayout, storage_write},
        statistics::{GiStatistics, Tracked},
    },
    scene::needs::SceneNeeds,
    schedule::{GiPrepare, GiSystems},
};

/// Pixels of the camera along each axis that share a texel.
const DIVISOR: u32 = 4;

/// The camera that saw it.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(crate) struct GpuCameraDepth {
    clip_from_world: Mat4,
    /// 0 until there was a frame.
    seen: u32,
}

/// What the primary GI camera saw.
#[derive(Resource)]
pub(crate) struct CameraDepth {
    /// Whether anybody reads it in this frame.
    pub wanted: bool,
    /// That camera, as it looks now.
    pub clip_from_world: Option<Mat4>,
    camera_entity: Option<Entity>,
    /// `R32Float`, as Bevy has depth.
    pub texture: Tracked<TextureView>,
    /// A [`GpuCameraDepth`].
    pub camera: Tracked<Buffer>,
    size: UVec2,
    pass: ComputePass,
    layout: GroupLayout,
    job: Option<(Entity, BindGroup)>,
}

pub(super) struct CameraDepthPlugin;

impl Plugin for CameraDepthPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "kept_depth.wgsl");
        embedded_asset!(app, "depth.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init.run_if(supported))
            .add_systems(
                Render,
                (
                    choose_camera.in_set(GiPrepare::Lights).run_if(supported),
                    prepare.in_set(GiPrepare::Views).run_if(supported),
                ),
            )
            .add_systems(Core3d, keep_depth.in_set(GiSystems::Gather));
    }
}

fn texture(size: UVec2, device: &RenderDevice, statistics: &GiStatistics) -> Tracked<TextureView> {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("gi/surface/depth"),
        size: Extent3d {
            width: size.x,
            height: size.y,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::R32Float,
        usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    statistics
        .texture("surface/depth", texture)
        .map(|texture| texture.create_view(&TextureViewDescriptor::default()))
}

fn init(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    statistics: Res<GiStatistics>,
) {
    let layout = GroupLayout::new("gi/surface/keep_depth", ShaderStages::COMPUTE)
        .with(
            "target_",
            texture_storage_2d(TextureFormat::R32Float, StorageTextureAccess::WriteOnly),
        )
        .with("camera", storage_write::<GpuCameraDepth>());
    commands.insert_resource(CameraDepth {
        wanted: false,
        clip_from_world: None,
        camera_entity: None,
        texture: texture(UVec2::ONE, &device, &statistics),
        camera: statistics.storage_buffer(
            &device,
            "surface/depth_camera",
            GpuCameraDepth::min_size().get() / 4,
            // Written here, read as a uniform.
            BufferUsages::UNIFORM,
        ),
        size: UVec2::ONE,
        pass: ComputePass::new(
            &cache,
            "gi/surface/keep_depth",
            block::TILE,
            &[&surface_layout(), &layout],
            load_embedded_asset!(server.as_ref(), "depth.wgsl"),
            "keep_depth",
            Vec::new(),
        ),
        layout,
        job: None,
    });
}

fn choose_camera(
    depth: Option<ResMut<CameraDepth>>,
    needs: Res<SceneNeeds>,
    primary: Res<PrimaryGiCamera>,
    views: Query<&ExtractedView>,
) {
    let Some(mut depth) = depth else { return };
    depth.wanted = needs.camera_depth;
    depth.camera_entity = primary.0;
    let view = primary.0.and_then(|camera| views.get(camera).ok());
    depth.clip_from_world = view.map(|view| {
        let view_from_world = view.world_from_view.to_matrix().inverse();
        view.clip_from_view * view_from_world
    });
}

fn prepare(
    depth: Option<ResMut<CameraDepth>>,
    surfaces: Query<&ViewSurface>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    statistics: Res<GiStatistics>,
) {
    let Some(mut depth) = depth else { return };
    depth.job = None;
    let Some(entity) = depth.camera_entity.filter(|_| depth.wanted) else {
        return;
    };
    let Ok(surface) = surfaces.get(entity) else {
        return;
    };
    let size = (surface.size / DIVISOR).max(UVec2::ONE);
    if depth.size != size {
        depth.texture = texture(size, &device, &statistics);
        depth.size = size;
    }
    let group = depth
        .layout
        .bind(&device, &cache)
        .with("target_", &*depth.texture)
        .with("camera", depth.camera.as_entire_binding())
        .build();
    depth.job = Some((entity, group));
}

fn keep_depth(
    view: ViewQuery<(Entity, &ViewSurface, &ViewUniformOffset)>,
    depth: Option<Res<CameraDepth>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (entity, surface, offset) = view.into_inner();
    let Some(depth) = depth else { return };
    let Some((_, group)) = depth.job.as_ref().filter(|(camera, _)| *camera == entity) else {
        return;
    };
    let threads = Dispatch::Threads(depth.size.extend(1));
    let run = (threads, [&surface.bind_group, group]);
    let diagnostics = ctx.diagnostic_recorder();
    Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics: diagnostics.as_deref(),
    }
    .run_all(&depth.pass, Some(offset.offset), [run]);
}
