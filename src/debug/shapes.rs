//! Spheres at points of space, with light from six sides: one instanced pass for whatever has such
//! points.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, Handle, embedded_asset, load_embedded_asset},
    core_pipeline::{core_3d::CORE_3D_DEPTH_FORMAT, schedule::Core3d},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    math::{Vec3, Vec4},
    render::{
        RenderApp, RenderStartup,
        camera::ExtractedCamera,
        render_resource::*,
        renderer::{RenderContext, RenderDevice, RenderGraph, ViewQuery},
        view::{ExtractedView, ViewDepthTexture, ViewTarget, ViewUniformOffset},
    },
    shader::{Shader, load_shader_library},
};

use super::{Painter, ShownView, fill::FillPass, light_maps::DebugMarks};
use crate::{
    gpu::{
        caps::supported,
        compute::{Dispatch, Recorder},
        fullscreen::camera_pass,
        layout::{GroupLayout, storage_read},
    },
    schedule::GiSystems,
    surface::{ViewSurface, surface_layout},
};

const NAME: &str = "gi/debug/shapes";

/// A sphere. `types.wgsl` is its twin.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(crate) struct GpuShape {
    /// Metres.
    pub center: Vec3,
    pub radius: f32,
    /// Nits, seen from +x, -x, +y, -y, +z, -z; with a fourth component of 0, plain numbers that are not exposed.
    pub sides: [Vec4; 6],
}

/// Spheres that all GI cameras show. The hook for techniques: whatever is to be seen at points of space
/// goes into such a component of some entity of the render world.
#[derive(Component)]
pub(crate) struct DebugShapes {
    /// `array<GpuShape>`.
    shapes: Buffer,
    count: u32,
    fill: Vec<FillPass>,
}

impl DebugShapes {
    /// So many spheres, in the buffer of `before` if it has that size. `fill` gets the buffer.
    pub fn new(
        count: u32,
        before: Option<&Self>,
        device: &RenderDevice,
        fill: impl FnOnce(&Buffer) -> Vec<FillPass>,
    ) -> Self {
        let shapes = match before.filter(|before| before.count == count) {
            Some(before) => before.shapes.clone(),
            None => device.create_buffer(&BufferDescriptor {
                label: Some(NAME),
                size: u64::from(count.max(1)) * u64::from(GpuShape::min_size()),
                usage: BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
        };
        Self {
            count,
            fill: fill(&shapes),
            shapes,
        }
    }
}

#[derive(Resource)]
struct ShapesPipeline {
    surface: GroupLayout,
    layout: GroupLayout,
    shader: Handle<Shader>,
    pipelines: SpecializedRenderPipelines<ShapesSpecializer>,
}

#[derive(Clone)]
struct ShapesSpecializer {
    layout: Vec<BindGroupLayoutDescriptor>,
    shader: Handle<Shader>,
}

impl SpecializedRenderPipeline for ShapesSpecializer {
    type Key = TextureFormat;

    fn specialize(&self, format: Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some(NAME.into()),
            layout: self.layout.clone(),
            vertex: VertexState {
                shader: self.shader.clone(),
                entry_point: Some("vertex".into()),
                ..Default::default()
            },
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                entry_point: Some("fragment".into()),
                targets: vec![Some(format.into())],
                ..Default::default()
            }),
            depth_stencil: Some(DepthStencilState {
                format: CORE_3D_DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(CompareFunction::GreaterEqual),
                stencil: StencilState::default(),
                bias: DepthBiasState::default(),
            }),
            ..Default::default()
        }
    }
}

pub(super) struct ShapesPlugin;

impl Plugin for ShapesPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        embedded_asset!(app, "shapes.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_pipeline.run_if(supported))
            .add_systems(
                RenderGraph,
                fill_shapes.in_set(GiSystems::FillDebug).run_if(
                    any_with_component::<DebugShapes>.or_else(any_with_component::<DebugMarks>),
                ),
            )
            .add_systems(
                Core3d,
                draw_shapes
                    .in_set(GiSystems::ShowDebug)
                    .run_if(any_with_component::<DebugShapes>)
                    // Other painters cover the scene, and its depth.
                    .run_if(|shown: ShownView| {
                        matches!(shown.painter(), Painter::Bevy | Painter::Composite)
                    }),
            );
    }
}

fn init_pipeline(mut commands: Commands, server: Res<AssetServer>) {
    commands.insert_resource(ShapesPipeline {
        surface: surface_layout(),
        layout: GroupLayout::new(NAME, ShaderStages::VERTEX_FRAGMENT)
            .with("shapes", storage_read::<Vec<GpuShape>>()),
        shader: load_embedded_asset!(server.as_ref(), "shapes.wgsl"),
        pipelines: Default::default(),
    });
}

type View<'a> = (
    &'a ExtractedView,
    &'a ViewTarget,
    &'a ViewDepthTexture,
    &'a ExtractedCamera,
    &'a ViewSurface,
    &'a ViewUniformOffset,
);

fn draw_shapes(
    view: ViewQuery<View>,
    all: Query<&DebugShapes>,
    pipeline: Option<ResMut<ShapesPipeline>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (extracted, target, depth, camera, surface, offset) = view.into_inner();
    let Some(mut pipeline) = pipeline else { return };
    let specializer = ShapesSpecializer {
        layout: vec![pipeline.surface.descriptor(), pipeline.layout.descriptor()],
        shader: pipeline.shader.clone(),
    };
    let id = pipeline
        .pipelines
        .specialize(&cache, &specializer, extracted.target_format);
    let Some(render_pipeline) = cache.get_render_pipeline(id) else {
        return;
    };
    let groups: Vec<_> = all
        .iter()
        .map(|shapes| {
            let group = pipeline
                .layout
                .bind(&device, &cache)
                .with("shapes", shapes.shapes.as_entire_binding())
                .build();
            (group, shapes.count)
        })
        .collect();
    let color = target.get_color_attachment();
    let depth = Some(depth.get_attachment(StoreOp::Store));
    camera_pass(&mut ctx, NAME, camera, color, depth, |pass| {
        pass.set_render_pipeline(render_pipeline);
        pass.set_bind_group(0, &surface.bind_group, &[offset.offset]);
        for (group, count) in &groups {
            pass.set_bind_group(1, group, &[]);
            pass.draw(0..6, 0..*count);
        }
    });
}

/// Brings all spheres and marks up to date.
fn fill_shapes(
    all: Query<&DebugShapes>,
    marks: Query<&DebugMarks>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let diagnostics = ctx.diagnostic_recorder();
    let mut recorder = Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics: diagnostics.as_deref(),
    };
    let shapes = all.iter().flat_map(|shapes| &shapes.fill);
    let marks = marks.iter().flat_map(|marks| &marks.fill);
    for fill in shapes.chain(marks) {
        let groups: Vec<_> = fill.bind_groups.iter().collect();
        recorder.run(&fill.pass, Dispatch::Threads(fill.threads), &groups);
    }
}
