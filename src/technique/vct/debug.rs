//! Views of voxels and of the radiance cache.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    core_pipeline::{FullscreenShader, schedule::Core3d},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        camera::ExtractedCamera,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        texture::{CachedTexture, TextureCache},
        view::{ExtractedView, ViewTarget, ViewUniformOffset},
    },
};

use super::{node, prepare::VctCache};
use crate::{
    debug::{GiDebugSettings, GiView, Painter},
    gpu::fullscreen::{FullscreenPass, camera_pass},
    scene::{
        bind_group::{SceneBindGroup, SceneLayout, init_scene_layout},
        voxels::SceneVoxels,
    },
    schedule::GiSystems,
    surface::{SurfaceLayout, ViewSurface, init_surface_layout},
    technique::TechniqueCache,
};

const NAME: &str = "gi/vct/debug_voxels";
/// Distances, so that of several volumes the nearest surface is seen.
const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// Uniform of `debug.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuVoxelView {
    content: u32,
    level: u32,
    slice: u32,
    slice_at: f32,
}

/// Group 3, on a volume's entity.
#[derive(Component)]
struct VoxelView(BindGroup);

/// A camera's buffer of distances, and the pass for its format.
#[derive(Component)]
struct VoxelViewTarget {
    depth: CachedTexture,
    pipeline: CachedRenderPipelineId,
}

#[derive(Resource)]
struct VoxelViewPass {
    pass: FullscreenPass,
    layout: BindGroupLayoutDescriptor,
    pipelines: SpecializedRenderPipelines<FullscreenPass>,
}

pub(super) struct VoxelViewPlugin;

fn is_shown(debug: Res<GiDebugSettings>) -> bool {
    debug.view.painter() == Painter::Voxels
}

impl Plugin for VoxelViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "debug.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(
                RenderStartup,
                init_pass
                    .after(init_surface_layout)
                    .after(init_scene_layout),
            )
            .add_systems(
                Render,
                prepare
                    .in_set(RenderSystems::PrepareBindGroups)
                    .run_if(is_shown),
            )
            .add_systems(Core3d, draw.in_set(GiSystems::ShowDebug).run_if(is_shown));
    }
}

fn init_pass(
    mut commands: Commands,
    server: Res<AssetServer>,
    fullscreen: Res<FullscreenShader>,
    surface: Res<SurfaceLayout>,
    scene: Res<SceneLayout>,
) {
    let read = || storage_buffer_read_only_sized(false, None);
    let layout = BindGroupLayoutDescriptor::new(
        NAME,
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (uniform_buffer::<GpuVoxelView>(false), read(), read()),
        ),
    );
    commands.insert_resource(VoxelViewPass {
        pass: FullscreenPass {
            layout: vec![
                surface.0.clone(),
                scene.layout.clone(),
                node::cache_layout(),
                layout.clone(),
            ],
            fullscreen: fullscreen.clone(),
            shader: load_embedded_asset!(server.as_ref(), "debug.wgsl"),
            shader_defs: [GiView::shader_defs(), node::shader_defs()].concat(),
            depth: Some(DEPTH),
        },
        layout,
        pipelines: Default::default(),
    });
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn prepare(
    mut commands: Commands,
    volumes: Query<(Entity, &SceneVoxels)>,
    views: Query<(Entity, &ExtractedView, &ExtractedCamera), With<ViewSurface>>,
    debug: Res<GiDebugSettings>,
    pass: Option<ResMut<VoxelViewPass>>,
    mut textures: ResMut<TextureCache>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(mut pass) = pass else { return };
    let mut uniform = UniformBuffer::from(GpuVoxelView {
        content: debug.view as u32,
        level: debug.voxel_level,
        slice: debug.slice as u32,
        slice_at: debug.slice_at,
    });
    uniform.write_buffer(&device, &queue);
    for (entity, voxels) in &volumes {
        let group = device.create_bind_group(
            NAME,
            &cache.get_bind_group_layout(&pass.layout),
            &BindGroupEntries::sequential((
                &uniform,
                voxels.brick_map().as_entire_binding(),
                voxels.pool().as_entire_binding(),
            )),
        );
        commands.entity(entity).insert(VoxelView(group));
    }
    let VoxelViewPass {
        pass, pipelines, ..
    } = &mut *pass;
    for (entity, view, camera) in &views {
        let Some(size) = camera.physical_target_size else {
            continue;
        };
        let depth = textures.get(
            &device,
            TextureDescriptor {
                label: Some(NAME),
                size: Extent3d {
                    width: size.x,
                    height: size.y,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format: DEPTH,
                usage: TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            },
        );
        let pipeline = pipelines.specialize(&cache, pass, (NAME, view.target_format));
        let target = VoxelViewTarget { depth, pipeline };
        commands.entity(entity).insert(target);
    }
}

type View<'a> = (
    &'a ViewTarget,
    &'a VoxelViewTarget,
    &'a ExtractedCamera,
    &'a ViewSurface,
    &'a ViewUniformOffset,
);

fn draw(
    view: ViewQuery<View>,
    volumes: Query<(&SceneBindGroup, &VctCache, &VoxelView)>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (target, own, camera, surface, offset) = view.into_inner();
    let Some(pipeline) = cache.get_render_pipeline(own.pipeline) else {
        return;
    };
    let mut color = target.get_color_attachment();
    color.ops.load = LoadOp::Clear(Default::default());
    let depth = RenderPassDepthStencilAttachment {
        view: &own.depth.default_view,
        depth_ops: Some(Operations {
            load: LoadOp::Clear(0.0),
            store: StoreOp::Discard,
        }),
        stencil_ops: None,
    };
    camera_pass(&mut ctx, NAME, camera, color, Some(depth), |pass| {
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, &surface.bind_group, &[offset.offset]);
        for (scene, technique, shown) in &volumes {
            let Some(technique) = technique.bind_group() else {
                continue;
            };
            pass.set_bind_group(1, &scene.0, &[]);
            pass.set_bind_group(2, technique, &[]);
            pass.set_bind_group(3, &shown.0, &[]);
            pass.draw(0..3, 0..1);
        }
    });
}
