//! Passes of opacity.

use bevy::{
    ecs::prelude::*,
    render::{render_resource::PipelineCache, renderer::RenderContext},
};

use super::{cache::SceneOpacity, pipelines::OpacityPipelines};
use crate::{
    gpu::compute::{Dispatch, Recorder},
    scene::voxels::{SceneVoxels, argument},
};

/// Builds the opacity of every volume that has a job.
pub(super) fn filter_opacity(
    volumes: Query<(&SceneOpacity, &SceneVoxels)>,
    pipelines: Option<Res<OpacityPipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else { return };
    let diagnostics = ctx.diagnostic_recorder();
    for (opacity, voxels) in &volumes {
        let Some(job) = &opacity.job else { continue };
        let mut record = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics: diagnostics.as_deref(),
        };
        let finest = Dispatch::Threads(job.sizes[0]);
        record.run(&pipelines.clear, finest, &[&job.clear]);
        let per_cell = Dispatch::Indirect(&voxels.arguments, 4 * u64::from(argument::CELLS));
        record.run(&pipelines.voxels, per_cell, &[&job.voxels]);
        let levels = job.sizes[1..].iter().zip(&job.cells);
        let levels = levels.map(|(size, group)| (Dispatch::Threads(*size), [group]));
        record.run_all(&pipelines.cells, None, levels);
    }
}
