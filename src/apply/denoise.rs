//! Spatial filter of the accumulated light: an edge-aware mean over neighbouring gathered pixels.
//!
//! Neighbours turn their cones differently (interleaved gradient noise), so that a block of 3x3 has
//! them spread evenly. The result is shown, but not accumulated: history stays sharp.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    core_pipeline::schedule::Core3d,
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    math::UVec2,
    render::{
        Render, RenderApp, RenderStartup,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::ViewUniformOffset,
    },
};

use super::{
    gather::ViewIndirect,
    temporal::{ViewHistory, accumulate, prepare_history},
};
use crate::{
    camera::ExtractedGiCamera,
    gpu::{
        caps::supported,
        compute::{ComputePass, Dispatch, Recorder, block},
        layout::{GroupLayout, loaded, uniform},
        statistics::Tracked,
    },
    schedule::{GiPrepare, GiSystems},
    surface::{ViewSurface, surface_layout},
    technique::ViewSettling,
};

/// Uniform of the filter.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuDenoise {
    size: UVec2,
    full_size: UVec2,
    divisor: u32,
    /// Gathered pixels to each side; at least 1.
    radius: u32,
}

/// The filtered light of a camera, as [`ViewHistory`] has it unfiltered.
#[derive(Component)]
pub(crate) struct ViewDenoised {
    size: UVec2,
    /// Diffuse and specular: the gather's textures, which have done their work.
    targets: [Tracked<TextureView>; 2],
    bind_group: BindGroup,
}

impl ViewDenoised {
    /// Diffuse and specular light.
    pub fn result(&self) -> &[Tracked<TextureView>; 2] {
        &self.targets
    }
}

#[derive(Resource)]
pub(crate) struct DenoisePipeline {
    layout: GroupLayout,
    pass: ComputePass,
}

pub(crate) struct DenoisePlugin;

impl Plugin for DenoisePlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "denoise.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_denoise_pipeline.run_if(supported))
            .add_systems(
                Render,
                prepare_denoise
                    .in_set(GiPrepare::Views)
                    .after(prepare_history)
                    .run_if(supported),
            )
            .add_systems(Core3d, denoise.in_set(GiSystems::Denoise).after(accumulate));
    }
}

fn init_denoise_pipeline(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let source = || texture_2d(loaded());
    let target = || texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let layout = GroupLayout::new("gi/apply/denoise", ShaderStages::COMPUTE)
        .with("settings", uniform::<GpuDenoise>())
        .with("diffuse_texture", source())
        .with("specular_texture", source())
        .with("surface_texture", source())
        .with("diffuse_target", target())
        .with("specular_target", target());
    let pass = ComputePass::new(
        &cache,
        "gi/apply/denoise",
        block::TILE,
        &[&surface_layout(), &layout],
        load_embedded_asset!(server.as_ref(), "denoise.wgsl"),
        "denoise",
        vec![],
    );
    commands.insert_resource(DenoisePipeline { layout, pass });
}

type ViewLight = (
    &'static ViewIndirect,
    &'static ViewHistory,
    &'static ExtractedGiCamera,
    Option<&'static ViewSettling>,
);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn prepare_denoise(
    mut commands: Commands,
    views: Query<(Entity, Option<ViewLight>, Has<ViewDenoised>)>,
    pipeline: Option<Res<DenoisePipeline>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(pipeline) = pipeline else { return };
    for (entity, light, denoised) in &views {
        let light = light.filter(|(_, _, camera, _)| camera.settings.denoise_radius > 0);
        let Some((indirect, history, camera, settling)) = light else {
            if denoised {
                commands.entity(entity).remove::<ViewDenoised>();
            }
            continue;
        };
        let settling = settling.and_then(|settling| settling.0);
        let targets = indirect.result().clone();
        let mut uniform = UniformBuffer::from(GpuDenoise {
            size: indirect.size,
            full_size: indirect.full_size,
            divisor: indirect.divisor,
            radius: camera.settings.denoise_radius + settling.map_or(0, |settling| settling.blur),
        });
        uniform.write_buffer(&device, &queue);
        let [diffuse, specular, surface] = history.result();
        let bind_group = pipeline
            .layout
            .bind(&device, &cache)
            .with("settings", &uniform)
            .with("diffuse_texture", &**diffuse)
            .with("specular_texture", &**specular)
            .with("surface_texture", &**surface)
            .with("diffuse_target", &*targets[0])
            .with("specular_target", &*targets[1])
            .build();
        commands.entity(entity).insert(ViewDenoised {
            size: indirect.size,
            targets,
            bind_group,
        });
    }
}

fn denoise(
    view: ViewQuery<(&ViewSurface, &ViewDenoised, &ViewUniformOffset)>,
    pipeline: Option<Res<DenoisePipeline>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (surface, denoised, offset) = view.into_inner();
    let Some(pipeline) = pipeline else { return };
    let diagnostics = ctx.diagnostic_recorder();
    Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics: diagnostics.as_deref(),
    }
    .run_all(
        &pipeline.pass,
        Some(offset.offset),
        [(
            Dispatch::Threads(denoised.size.extend(1)),
            [&surface.bind_group, &denoised.bind_group],
        )],
    );
}
