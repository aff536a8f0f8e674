//! Views of voxels: one pass for whatever has cells to show, and the surfaces in voxels as its first user.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, Handle, embedded_asset, load_embedded_asset},
    core_pipeline::{FullscreenShader, schedule::Core3d},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup,
        camera::ExtractedCamera,
        render_resource::*,
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        texture::{CachedTexture, TextureCache},
        view::{ExtractedView, ViewTarget, ViewUniformOffset},
    },
    shader::{Shader, ShaderDefVal, load_shader_library},
};

use super::{GiDebugSettings, GiView, Painter, ShownView, paints};
use crate::{
    gpu::{
        caps::supported,
        fullscreen::{FullscreenPass, camera_pass},
        layout::{GroupLayout, storage_read, uniform},
    },
    scene::{
        bind_group::{SceneBindGroup, scene_layout},
        needs::{NeedsKnown, SceneNeeds},
        voxels::{SceneVoxels, shader_defs},
    },
    schedule::{GiPrepare, GiSystems},
    surface::{ViewSurface, surface_layout},
};

const NAME: &str = "gi/debug/voxels";
/// Distances, so that of several volumes the nearest surface is seen.
const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// What is shown. Twin of `VoxelView` in `cubes.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(crate) struct GpuVoxelView {
    content: u32,
    level: u32,
    slice: u32,
    slice_at: f32,
}

/// Cells of a volume, to be shown in this frame: on the volume's entity in the render world. The hook for
/// techniques, whose systems put it there in `PrepareBindGroups` while one of their views is chosen.
#[derive(Component)]
pub(crate) struct VoxelView {
    /// Label of the shader's pipeline.
    pub name: &'static str,
    pub shader: Arc<FullscreenPass>,
    /// From group 1 on, which is the scene's.
    pub groups: Vec<BindGroup>,
}

/// Pipelines of all shaders of cells, for each format of a target.
#[derive(Resource, Default)]
struct VoxelViewPipelines(SpecializedRenderPipelines<FullscreenPass>);

/// A pass of cells whose fragment shader has these groups from 2 on.
pub(crate) fn voxel_view_pass(
    fullscreen: &FullscreenShader,
    groups: &[GroupLayout],
    shader: Handle<Shader>,
    shader_defs: Vec<ShaderDefVal>,
) -> Arc<FullscreenPass> {
    Arc::new(FullscreenPass {
        layouts: [&[surface_layout(), scene_layout()], groups].concat(),
        fullscreen: fullscreen.clone(),
        shader,
        shader_defs: [GiView::shader_defs(), shader_defs].concat(),
        depth: Some(DEPTH),
    })
}

/// The uniform for the view that is chosen, which the shader knows as `content`.
pub(crate) fn voxel_view_uniform(
    content: u32,
    debug: &GiDebugSettings,
    device: &RenderDevice,
    queue: &RenderQueue,
) -> UniformBuffer<GpuVoxelView> {
    let mut uniform = UniformBuffer::from(GpuVoxelView {
        content,
        level: debug.voxel_level,
        slice: debug.slice as u32,
        slice_at: debug.slice_at,
    });
    uniform.write_buffer(device, queue);
    uniform
}

/// The shader for surfaces in voxels.
#[derive(Resource)]
struct SurfaceView {
    shader: Arc<FullscreenPass>,
    layout: GroupLayout,
}

/// A camera's buffer of distances.
#[derive(Component)]
struct VoxelViewTarget(CachedTexture);

pub(super) struct VoxelViewPlugin;

fn shows_cells(shown: ShownView) -> bool {
    matches!(shown.painter(), Painter::Voxels | Painter::Cells)
}

impl Plugin for VoxelViewPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "cubes.wgsl");
        embedded_asset!(app, "voxels.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<VoxelViewPipelines>()
            .add_systems(RenderStartup, init_surface_view.run_if(supported))
            .add_systems(
                ExtractSchedule,
                extract_needs.in_set(NeedsKnown).run_if(supported),
            )
            .add_systems(
                Render,
                (
                    forget
                        .in_set(GiPrepare::Voxels)
                        .run_if(any_with_component::<VoxelView>),
                    prepare_targets
                        .in_set(GiPrepare::Voxels)
                        .run_if(shows_cells),
                    show_surfaces
                        .in_set(GiPrepare::Composite)
                        .run_if(paints(Painter::Voxels)),
                ),
            )
            .add_systems(
                Core3d,
                draw.in_set(GiSystems::ShowDebug).run_if(shows_cells),
            );
    }
}

/// Has the voxels captured, whatever the technique needs.
fn extract_needs(shown: Extract<ShownView>, mut needs: ResMut<SceneNeeds>) {
    needs.voxels |= shown.painter() == Painter::Voxels;
}

fn init_surface_view(
    mut commands: Commands,
    server: Res<AssetServer>,
    fullscreen: Res<FullscreenShader>,
) {
    let layout = GroupLayout::new(NAME, ShaderStages::FRAGMENT)
        .with("shown", uniform::<GpuVoxelView>())
        .with("brick_map", storage_read::<Vec<u32>>())
        .with("pool", storage_read::<Vec<u32>>());
    let shader = load_embedded_asset!(server.as_ref(), "voxels.wgsl");
    commands.insert_resource(SurfaceView {
        shader: voxel_view_pass(
            &fullscreen,
            std::slice::from_ref(&layout),
            shader,
            shader_defs(),
        ),
        layout,
    });
}

/// What the last frame showed.
fn forget(mut commands: Commands, volumes: Query<Entity, With<VoxelView>>) {
    for volume in &volumes {
        commands.entity(volume).remove::<VoxelView>();
    }
}

fn prepare_targets(
    mut commands: Commands,
    views: Query<(Entity, &ExtractedCamera), With<ViewSurface>>,
    mut textures: ResMut<TextureCache>,
    device: Res<RenderDevice>,
) {
    for (entity, camera) in &views {
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
        commands.entity(entity).insert(VoxelViewTarget(depth));
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn show_surfaces(
    mut commands: Commands,
    volumes: Query<(Entity, &SceneVoxels, &SceneBindGroup)>,
    debug: Res<GiDebugSettings>,
    view: Option<Res<SurfaceView>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(view) = view else { return };
    let uniform = voxel_view_uniform(debug.view.number(), &debug, &device, &queue);
    for (entity, voxels, scene) in &volumes {
        let own = view
            .layout
            .bind(&device, &cache)
            .with("shown", &uniform)
            .with("brick_map", voxels.brick_map().as_entire_binding())
            .with("pool", voxels.pool().as_entire_binding())
            .build();
        commands.entity(entity).insert(VoxelView {
            name: NAME,
            shader: view.shader.clone(),
            groups: vec![scene.0.clone(), own],
        });
    }
}

type View<'a> = (
    &'a ExtractedView,
    &'a ViewTarget,
    &'a VoxelViewTarget,
    &'a ExtractedCamera,
    &'a ViewSurface,
    &'a ViewUniformOffset,
);

/// Draws all volumes, or nothing but black.
fn draw(
    view: ViewQuery<View>,
    volumes: Query<&VoxelView>,
    mut pipelines: ResMut<VoxelViewPipelines>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (extracted, target, depth, camera, surface, offset) = view.into_inner();
    let format = extracted.target_format;
    let shown: Vec<_> = volumes
        .iter()
        .map(|shown| {
            let id = pipelines
                .0
                .specialize(&cache, &shown.shader, (shown.name, format));
            (id, shown)
        })
        .collect();
    let mut color = target.get_color_attachment();
    color.ops.load = LoadOp::Clear(Default::default());
    let depth = RenderPassDepthStencilAttachment {
        view: &depth.0.default_view,
        depth_ops: Some(Operations {
            load: LoadOp::Clear(0.0),
            store: StoreOp::Discard,
        }),
        stencil_ops: None,
    };
    camera_pass(&mut ctx, NAME, camera, color, Some(depth), |pass| {
        pass.set_bind_group(0, &surface.bind_group, &[offset.offset]);
        for (id, shown) in &shown {
            let Some(pipeline) = cache.get_render_pipeline(*id) else {
                continue;
            };
            pass.set_render_pipeline(pipeline);
            for (index, group) in (1..).zip(&shown.groups) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.draw(0..3, 0..1);
        }
    });
}
