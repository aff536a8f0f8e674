//! Passes of the voxelizer.

use bevy::{
    ecs::prelude::*,
    render::{
        diagnostic::RecordDiagnostics, render_resource::*, renderer::RenderContext,
        view::ExtractedView,
    },
};

use super::{
    cache::SceneVoxels,
    pipelines::{VoxelCapture, VoxelPipelines},
    types::argument,
};
use crate::{
    gpu::compute::{Dispatch, Recorder},
    scene::views::CapturePhases,
};

/// Captures every volume that has a job.
pub(crate) fn voxelize(
    world: &World,
    volumes: Query<&SceneVoxels>,
    views: Query<&ExtractedView>,
    phases: Res<CapturePhases<VoxelCapture>>,
    pipelines: Option<Res<VoxelPipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else { return };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for voxels in &volumes {
        let Some(job) = &voxels.job else {
            if voxels.readback.is_owed() {
                voxels
                    .readback
                    .copy(ctx.command_encoder(), &voxels.counters);
            }
            continue;
        };

        let encoder = ctx.command_encoder();
        encoder.clear_buffer(voxels.brick_map(), 0, None);
        encoder.clear_buffer(&voxels.pool, 0, None);
        encoder.clear_buffer(&voxels.occupancy, 0, None);
        encoder.clear_buffer(&voxels.counters, 0, None);

        let draw = |ctx: &mut RenderContext, name: &'static str, step: usize| {
            let span = diagnostics.time_span(ctx.command_encoder(), name);
            for axis in 0..3 {
                let Some(phase) = views
                    .get(job.views[axis])
                    .ok()
                    .and_then(|view| phases.get(&view.retained_view_entity))
                else {
                    continue;
                };
                let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
                    label: Some(name),
                    color_attachments: &[Some(RenderPassColorAttachment {
                        view: &job.targets[axis],
                        depth_slice: None,
                        resolve_target: None,
                        ops: Operations {
                            load: LoadOp::Clear(Default::default()),
                            store: StoreOp::Discard,
                        },
                    })],
                    ..Default::default()
                });
                pass.set_bind_group(1, &job.draw[step][axis], &[]);
                if let Err(error) = phase.render(&mut pass, world, job.views[axis]) {
                    bevy::log::error!("voxelizing failed: {error:?}");
                }
            }
            span.end(ctx.command_encoder());
        };
        draw(&mut ctx, "gi/scene/mark_bricks", 0);
        {
            let mut record = Recorder {
                encoder: ctx.command_encoder(),
                cache: &cache,
                diagnostics,
            };
            let bricks = Dispatch::Row(voxels.grid.bricks().element_product());
            record.run(&pipelines.allocate, bricks, &[&job.allocate]);
            record.run(
                &pipelines.brick_arguments,
                Dispatch::Row(1),
                &[&job.allocate],
            );
        }
        draw(&mut ctx, "gi/scene/voxelize", 1);
        let mut record = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics,
        };
        let per_brick = Dispatch::Indirect(&voxels.arguments, 4 * u64::from(argument::BRICKS));
        record.run(&pipelines.resolve, per_brick, &[&job.resolve]);
        record.run(
            &pipelines.slice_arguments,
            Dispatch::Row(1),
            &[&job.allocate],
        );
        record.run(&pipelines.list, per_brick, &[&job.resolve]);
        voxels.readback.copy(record.encoder, &voxels.counters);
    }
}
