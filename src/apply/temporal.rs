//! Temporal accumulation: each gathered pixel follows its surface into the last frame.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    core_pipeline::schedule::Core3d,
    ecs::prelude::*,
    math::UVec2,
    render::{
        Render, RenderApp, RenderStartup,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::ViewUniformOffset,
    },
};

use super::gather::{ViewIndirect, gather_texture, prepare_view_indirect};
use crate::{
    camera::ExtractedGiCamera,
    gpu::{
        caps::supported,
        compute::{ComputePass, Dispatch, Recorder, block},
        layout::{GroupLayout, loaded, uniform},
        statistics::{GiStatistics, Tracked},
    },
    schedule::{GiPrepare, GiSystems},
    surface::{ViewSurface, surface_layout},
    technique::ViewSettling,
};

/// Uniform of the accumulation.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuTemporal {
    size: UVec2,
    full_size: UVec2,
    divisor: u32,
    /// Most frames to blend; 1 ignores the history.
    history_frames: u32,
    /// Units of now in one of the last frame.
    rescale: f32,
    /// 1 while the light of a volume or of the camera's own cache has not settled.
    light_changes: u32,
    /// Counts frames since the history was reset.
    frame: u32,
}

/// What a camera remembers of past frames.
#[derive(Component)]
pub(crate) struct ViewHistory {
    size: UVec2,
    /// Of this frame and the last: diffuse, specular (history length in alpha), and the surface
    /// (octahedral normal, depth, 1).
    frames: [[Tracked<TextureView>; 3]; 2],
    current: usize,
    /// Nits of a unit of the light of this frame.
    unit: f32,
    bind_group: BindGroup,
}

impl ViewHistory {
    /// Accumulated diffuse and specular light, and the surfaces they belong to.
    pub fn result(&self) -> &[Tracked<TextureView>; 3] {
        &self.frames[self.current]
    }
}

#[derive(Resource)]
pub(crate) struct TemporalPipeline {
    layout: GroupLayout,
    pass: ComputePass,
}

pub(crate) struct TemporalPlugin;

impl Plugin for TemporalPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "temporal.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_temporal_pipeline.run_if(supported))
            .add_systems(
                Render,
                // Between the two, the commands of the first are applied.
                prepare_history
                    .in_set(GiPrepare::Views)
                    .after(prepare_view_indirect)
                    .run_if(supported),
            )
            .add_systems(Core3d, accumulate.in_set(GiSystems::Denoise));
    }
}

fn init_temporal_pipeline(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let source = || texture_2d(loaded());
    let target = || texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let layout = GroupLayout::new("gi/apply/temporal", ShaderStages::COMPUTE)
        .with("temporal", uniform::<GpuTemporal>())
        .with("new_diffuse", source())
        .with("new_specular", source())
        .with("old_diffuse", source())
        .with("old_specular", source())
        .with("old_surface", source())
        .with("diffuse_target", target())
        .with("specular_target", target())
        .with("surface_target", target());
    let pass = ComputePass::new(
        &cache,
        "gi/apply/temporal",
        block::TILE,
        &[&surface_layout(), &layout],
        load_embedded_asset!(server.as_ref(), "temporal.wgsl"),
        "accumulate",
        vec![],
    );
    commands.insert_resource(TemporalPipeline { layout, pass });
}

type ViewLight = (
    &'static ViewIndirect,
    &'static ExtractedGiCamera,
    Option<&'static ViewSettling>,
);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn prepare_history(
    mut commands: Commands,
    views: Query<(Entity, Option<ViewLight>, Option<&ViewHistory>)>,
    pipeline: Option<Res<TemporalPipeline>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
) {
    let Some(pipeline) = pipeline else { return };
    for (entity, indirect, history) in &views {
        let Some((indirect, camera, settling)) = indirect else {
            if history.is_some() {
                commands.entity(entity).remove::<ViewHistory>();
            }
            continue;
        };
        let (frames, current) = match history {
            Some(old) if old.size == indirect.size => (old.frames.clone(), 1 - old.current),
            _ => {
                let texture = |name| gather_texture(&device, &statistics, name, indirect.size);
                let names = [
                    "apply/history_diffuse",
                    "apply/history_specular",
                    "apply/history_surface",
                ];
                ([names.map(texture), names.map(texture)], 0)
            }
        };
        let settling = settling.and_then(|settling| settling.0);
        let most = settling.map_or(u32::MAX, |settling| settling.history_frames);
        let history_frames = match indirect.frame {
            0 => 1,
            _ => camera.settings.history_frames.min(most),
        };
        let mut uniform = UniformBuffer::from(GpuTemporal {
            size: indirect.size,
            full_size: indirect.full_size,
            divisor: indirect.divisor,
            history_frames,
            rescale: history.map_or(1.0, |old| old.unit / indirect.unit),
            light_changes: settling.is_some().into(),
            frame: indirect.frame,
        });
        uniform.write_buffer(&device, &queue);
        let [to, from] = [&frames[current], &frames[1 - current]];
        let [diffuse, specular] = indirect.result();
        let bind_group = pipeline
            .layout
            .bind(&device, &cache)
            .with("temporal", &uniform)
            .with("new_diffuse", &**diffuse)
            .with("new_specular", &**specular)
            .with("old_diffuse", &*from[0])
            .with("old_specular", &*from[1])
            .with("old_surface", &*from[2])
            .with("diffuse_target", &*to[0])
            .with("specular_target", &*to[1])
            .with("surface_target", &*to[2])
            .build();
        commands.entity(entity).insert(ViewHistory {
            size: indirect.size,
            frames,
            current,
            unit: indirect.unit,
            bind_group,
        });
    }
}

pub(crate) fn accumulate(
    view: ViewQuery<(&ViewSurface, &ViewHistory, &ViewUniformOffset)>,
    pipeline: Option<Res<TemporalPipeline>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (surface, history, offset) = view.into_inner();
    let Some(pipeline) = pipeline else { return };
    let diagnostics = ctx.diagnostic_recorder();
    let threads = Dispatch::Threads(history.size.extend(1));
    Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics: diagnostics.as_deref(),
    }
    .run_all(
        &pipeline.pass,
        Some(offset.offset),
        [(threads, [&surface.bind_group, &history.bind_group])],
    );
}
