//! Composite: indirect light at full resolution, times albedo, added to the HDR target.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, Handle, embedded_asset, load_embedded_asset},
    core_pipeline::{FullscreenShader, schedule::Core3d},
    ecs::prelude::*,
    math::UVec2,
    pbr::{DistanceFog, ScreenSpaceAmbientOcclusionResources},
    render::{
        Render, RenderApp, RenderStartup,
        camera::ExtractedCamera,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        texture::FallbackImage,
        view::{ExtractedView, ViewTarget, ViewUniformOffset},
    },
    shader::Shader,
};

use super::{
    denoise::{ViewDenoised, prepare_denoise},
    fog::{self, GpuFog},
    gather::ViewIndirect,
    temporal::ViewHistory,
};
use crate::{
    camera::ExtractedGiCamera,
    debug::{GATHERED, GiView, Painter, ShownView},
    gpu::{
        caps::supported,
        fullscreen::camera_pass,
        layout::{GroupLayout, loaded, uniform},
    },
    schedule::{GiPrepare, GiSystems},
    surface::{ViewSurface, surface_layout},
};

/// Uniform of the composite.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuComposite {
    size: UVec2,
    divisor: u32,
    /// A [`GiView`].
    mode: u32,
    strength: f32,
    /// Whether there is a texture of screen-space ambient occlusion.
    ssao: u32,
    /// Frames in a full history.
    history_frames: u32,
    /// Nits of a unit of the gathered light.
    unit: f32,
    fog: GpuFog,
}

/// The composite of a camera.
#[derive(Component)]
pub(crate) struct ViewComposite {
    bind_group: BindGroup,
    pipeline: CachedRenderPipelineId,
}

#[derive(Resource)]
struct CompositePipeline {
    surface: GroupLayout,
    layout: GroupLayout,
    fullscreen: FullscreenShader,
    shader: Handle<Shader>,
}

/// Format of the target, and whether the picture is replaced rather than added to.
type CompositeKey = (TextureFormat, bool);

impl SpecializedRenderPipeline for CompositePipeline {
    type Key = CompositeKey;

    fn specialize(&self, (format, replace): Self::Key) -> RenderPipelineDescriptor {
        let add = BlendState {
            color: BlendComponent {
                src_factor: BlendFactor::One,
                dst_factor: BlendFactor::One,
                operation: BlendOperation::Add,
            },
            alpha: BlendComponent {
                src_factor: BlendFactor::Zero,
                dst_factor: BlendFactor::One,
                operation: BlendOperation::Add,
            },
        };
        RenderPipelineDescriptor {
            label: Some("gi/apply/composite".into()),
            layout: vec![self.surface.descriptor(), self.layout.descriptor()],
            vertex: self.fullscreen.to_vertex_state(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: GiView::shader_defs()
                    .into_iter()
                    .chain(fog::shader_defs())
                    .collect(),
                targets: vec![Some(ColorTargetState {
                    format,
                    blend: (!replace).then_some(add),
                    write_mask: ColorWrites::ALL,
                })],
                ..Default::default()
            }),
            ..Default::default()
        }
    }
}

pub(crate) struct CompositePlugin;

impl Plugin for CompositePlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "composite.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SpecializedRenderPipelines<CompositePipeline>>()
            .add_systems(RenderStartup, init_composite_pipeline.run_if(supported))
            .add_systems(
                Render,
                prepare_composite
                    .in_set(GiPrepare::Composite)
                    .after(prepare_denoise)
                    .run_if(supported),
            )
            .add_systems(Core3d, composite.in_set(GiSystems::Composite));
    }
}

fn init_composite_pipeline(
    mut commands: Commands,
    server: Res<AssetServer>,
    fullscreen: Res<FullscreenShader>,
) {
    let source = || texture_2d(loaded());
    commands.insert_resource(CompositePipeline {
        surface: surface_layout(),
        layout: GroupLayout::new("gi/apply/composite", ShaderStages::FRAGMENT)
            .with("composite", uniform::<GpuComposite>())
            .with("diffuse_texture", source())
            .with("specular_texture", source())
            .with("surface_texture", source())
            .with("ssao_texture", source()),
        fullscreen: fullscreen.clone(),
        shader: load_embedded_asset!(server.as_ref(), "composite.wgsl"),
    });
}

type CompositeData = (
    Entity,
    &'static ExtractedView,
    Option<(&'static ViewIndirect, &'static ExtractedGiCamera)>,
    Option<&'static ViewHistory>,
    Option<&'static ViewDenoised>,
    Option<&'static DistanceFog>,
    Option<&'static ScreenSpaceAmbientOcclusionResources>,
    Has<ViewComposite>,
);

/// What the shader writes. What a technique has gathered for a view of its own is shown as it is.
fn mode(shown: &ShownView) -> u32 {
    match (shown.painter(), shown.entry().is_luminance) {
        (Painter::Gather, true) => GiView::Irradiance.number(),
        (Painter::Gather, false) => GATHERED,
        _ => shown.view().number(),
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn prepare_composite(
    mut commands: Commands,
    views: Query<CompositeData>,
    shown: ShownView,
    pipeline: Option<Res<CompositePipeline>>,
    mut pipelines: ResMut<SpecializedRenderPipelines<CompositePipeline>>,
    cache: Res<PipelineCache>,
    fallback: Res<FallbackImage>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(pipeline) = pipeline else { return };
    for (entity, view, indirect, history, denoised, fog, ssao, exists) in &views {
        let (Some((indirect, camera)), Some(history)) = (indirect, history) else {
            if exists {
                commands.entity(entity).remove::<ViewComposite>();
            }
            continue;
        };
        let mut uniform = UniformBuffer::from(GpuComposite {
            size: indirect.size,
            divisor: indirect.divisor,
            mode: mode(&shown),
            strength: camera.settings.strength,
            ssao: ssao.is_some().into(),
            history_frames: camera.settings.history_frames,
            unit: indirect.unit,
            fog: fog.into(),
        });
        uniform.write_buffer(&device, &queue);
        let [mut diffuse, mut specular, surface] = history.result().each_ref();
        if let Some(denoised) = denoised {
            [diffuse, specular] = denoised.result().each_ref();
        }
        let ssao = match ssao {
            Some(ssao) => &ssao.screen_space_ambient_occlusion_texture.default_view,
            None => &fallback.d2.texture_view,
        };
        let bind_group = pipeline
            .layout
            .bind(&device, &cache)
            .with("composite", &uniform)
            .with("diffuse_texture", &**diffuse)
            .with("specular_texture", &**specular)
            .with("surface_texture", &**surface)
            .with("ssao_texture", ssao)
            .build();
        let key = (view.target_format, shown.view() != GiView::Full);
        commands.entity(entity).insert(ViewComposite {
            bind_group,
            pipeline: pipelines.specialize(&cache, &pipeline, key),
        });
    }
}

fn composite(
    view: ViewQuery<(
        &ViewTarget,
        &ExtractedCamera,
        &ViewSurface,
        &ViewComposite,
        &ViewUniformOffset,
    )>,
    shown: ShownView,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (target, camera, surface, composite, offset) = view.into_inner();
    let Some(pipeline) = cache.get_render_pipeline(composite.pipeline) else {
        return;
    };
    if !matches!(shown.painter(), Painter::Composite | Painter::Gather) {
        return;
    }
    let color = target.get_color_attachment();
    camera_pass(
        &mut ctx,
        "gi/apply/composite",
        camera,
        color,
        None,
        |pass| {
            pass.set_render_pipeline(pipeline);
            pass.set_bind_group(0, &surface.bind_group, &[offset.offset]);
            pass.set_bind_group(1, &composite.bind_group, &[]);
            pass.draw(0..3, 0..1);
        },
    );
}
