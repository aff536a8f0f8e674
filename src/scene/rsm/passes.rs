//! Passes of reflective shadow maps.

use bevy::{
    ecs::prelude::*,
    math::UVec3,
    render::{
        diagnostic::RecordDiagnostics, render_resource::*, renderer::RenderContext,
        view::ExtractedView,
    },
};

use super::{
    cache::SceneRsm,
    pipelines::{NAME, RsmCapture, RsmPipelines},
};
use crate::{
    gpu::compute::{Dispatch, Recorder},
    scene::capture::{CapturePhases, CaptureViews},
};

/// Draws the maps whose turn it is, and chooses virtual point lights from all of them.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn draw_rsm(
    world: &World,
    rsm: Res<SceneRsm>,
    pipelines: Option<Res<RsmPipelines>>,
    views: Res<CaptureViews<RsmCapture>>,
    phases: Res<CapturePhases<RsmCapture>>,
    extracted: Query<&ExtractedView>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(pipelines), Some(job), Some(textures)) = (pipelines, &rsm.job, &rsm.textures) else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for copy in &job.copies {
        copy.record(ctx.command_encoder());
    }
    // One after the other: they share a G-buffer.
    for (i, group) in &job.draw {
        let map = &rsm.maps.maps[*i];
        let texels = map.tile.map_or(0, |tile| tile.size);
        let view = views.get(map.light, map.view.face);
        let phase = view
            .and_then(|view| extracted.get(view).ok())
            .and_then(|view| phases.get(&view.retained_view_entity));
        let span = diagnostics.time_span(ctx.command_encoder(), NAME);
        let color = |view| {
            Some(RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations {
                    load: LoadOp::Clear(Default::default()),
                    store: StoreOp::Store,
                },
            })
        };
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some(NAME),
            // As Bevy's prepass has them: normals and motion are not wanted.
            color_attachments: &[
                None,
                None,
                color(&textures.gbuffer),
                color(&textures.pass_id),
            ],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &textures.depth,
                depth_ops: Some(Operations {
                    load: LoadOp::Clear(0.0),
                    store: StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let size = texels as f32;
        pass.set_viewport(0.0, 0.0, size, size, 0.0, 1.0);
        pass.set_scissor_rect(0, 0, texels, texels);
        if let (Some(phase), Some(view)) = (phase, view)
            && let Err(error) = phase.render(&mut pass, world, view)
        {
            bevy::log::error!("drawing a reflective shadow map failed: {error:?}");
        }
        drop(pass);
        span.end(ctx.command_encoder());
        Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics,
        }
        .run(
            &pipelines.resolve,
            Dispatch::Threads(UVec3::new(texels, texels, 1)),
            &[group],
        );
    }
    let mut record = Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics,
    };
    let levels = job.sum.iter();
    let levels = levels.map(|(threads, group)| (Dispatch::Threads(*threads), [group]));
    if !job.sum.is_empty() {
        record.run_all(&pipelines.sum, None, levels);
    }
    let [count, volumes] = job.vpl_count.to_array();
    record.run(
        &pipelines.weigh,
        Dispatch::Workgroups(UVec3::new(volumes, 1, 1)),
        &[&job.vpls],
    );
    record.run(
        &pipelines.vpls,
        Dispatch::Threads(UVec3::new(count, volumes, 1)),
        &[&job.vpls],
    );
}
