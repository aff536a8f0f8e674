//! Passes of opacity.

use bevy::{
    ecs::prelude::*,
    math::UVec3,
    render::{render_resource::PipelineCache, renderer::RenderContext},
};

use super::{cache::SceneOpacity, pipelines::OpacityPipelines};
use crate::{
    gpu::compute::{Groups, Recorder, groups},
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
    let block = UVec3::splat(4);
    for (opacity, voxels) in &volumes {
        let Some(job) = &opacity.job else { continue };
        let mut record = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics: diagnostics.as_deref(),
        };
        record.run(&pipelines.clear, groups(job.sizes[0], block), &[&job.clear]);
        let per_cell = Groups::Indirect(&voxels.arguments, 4 * u64::from(argument::CELLS));
        record.run(&pipelines.voxels, per_cell, &[&job.voxels]);
        let levels = job.sizes[1..].iter().zip(&job.cells);
        let levels = levels.map(|(size, group)| (groups(*size, block), [group]));
        record.run_all(&pipelines.cells, None, levels);
    }
}
