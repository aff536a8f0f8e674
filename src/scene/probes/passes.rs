//! Passes of the probes.

use bevy::{
    ecs::prelude::*,
    math::UVec3,
    render::{render_resource::PipelineCache, renderer::RenderContext},
};

use super::{cache::SceneProbes, pipelines::ProbePipelines};
use crate::{
    gpu::compute::{Groups, Recorder, groups},
    scene::voxels::argument,
};

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
            let threads = UVec3::new(count, 1, 1);
            record.run(
                &pipelines.place,
                groups(threads, UVec3::new(64, 1, 1)),
                &[&job.look],
            );
        }
        record.run(&pipelines.look, rows(count * probes.rays()), &[&job.look]);
        if let Some(moments) = &job.moments {
            let tile = probes.gpu().side + 2;
            let threads = probes.dims() * UVec3::new(tile, tile, 1);
            record.run(
                &pipelines.moments,
                groups(threads, UVec3::new(8, 8, 1)),
                &[moments],
            );
        }
    }
}

/// Workgroups of 64 for a long row of threads.
fn rows(threads: u32) -> Groups<'static> {
    let workgroups = threads.div_ceil(64);
    let rows = workgroups.div_ceil(argument::ROW);
    Groups::Direct(UVec3::new(argument::ROW.min(workgroups), rows, 1))
}
