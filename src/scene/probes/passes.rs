//! Passes of the probes.

use bevy::{
    ecs::prelude::*,
    math::UVec3,
    render::{render_resource::PipelineCache, renderer::RenderContext},
};

use super::{cache::SceneProbes, pipelines::ProbePipelines};
use crate::gpu::compute::{Dispatch, Recorder};

/// The probes of every volume look at the scene, if they must.
pub(super) fn look_at_scene(
    volumes: Query<&SceneProbes>,
    pipelines: Option<Res<ProbePipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else { return };
    let diagnostics = ctx.diagnostic_recorder();
    for probes in &volumes {
        let Some(job) = &probes.job else { continue };
        let mut record = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics: diagnostics.as_deref(),
        };
        let count = probes.lattice.count();
        if job.moments.is_some() {
            record.run(&pipelines.place, Dispatch::Row(count), &[&job.look]);
        }
        let rays = Dispatch::Row(count * probes.rays());
        record.run(&pipelines.look, rays, &[&job.look]);
        if let Some(moments) = &job.moments {
            let tile = probes.gpu().side + 2;
            let threads = probes.dims() * UVec3::new(tile, tile, 1);
            record.run(&pipelines.moments, Dispatch::Threads(threads), &[moments]);
        }
    }
}
