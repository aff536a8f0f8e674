//! Passes of light maps.

use bevy::{
    ecs::{prelude::*, system::SystemParam},
    math::UVec3,
    render::{
        diagnostic::RecordDiagnostics, render_phase::TrackedRenderPass, render_resource::*,
        renderer::RenderContext, view::ExtractedView,
    },
};

use super::{
    atlas::Tile,
    cache::SceneLightMaps,
    choice::LightMap,
    pipelines::{DepthCapture, LightMapPipelines, SurfaceCapture},
};
use crate::{
    gpu::compute::{Dispatch, Recorder},
    scene::views::{CaptureKind, CapturePhases, CaptureViews},
};

/// What draws the meshes of maps.
#[derive(SystemParam)]
pub(super) struct Meshes<'w, 's, K: CaptureKind> {
    world: &'w World,
    views: Res<'w, CaptureViews<K>>,
    phases: Res<'w, CapturePhases<K>>,
    extracted: Query<'w, 's, &'static ExtractedView>,
}

impl<K: CaptureKind> Meshes<'_, '_, K> {
    fn draw<'a>(&'a self, map: &LightMap, pass: &mut TrackedRenderPass<'a>) {
        let Some(view) = self.views.get(map.light, map.view.face) else {
            return;
        };
        let extracted = self.extracted.get(view).ok();
        let phase = extracted.and_then(|view| self.phases.get(&view.retained_view_entity));
        if let Some(phase) = phase
            && let Err(error) = phase.render(pass, self.world, view)
        {
            bevy::log::error!("drawing a light map failed: {error:?}");
        }
    }
}

/// Only as far as a tile reaches.
fn stay_inside(pass: &mut TrackedRenderPass, tile: Tile) {
    let (at, size) = (tile.origin, tile.size);
    let [x, y, side] = [at.x, at.y, size].map(|texels| texels as f32);
    pass.set_viewport(x, y, side, side, 0.0, 1.0);
    pass.set_scissor_rect(at.x, at.y, size, size);
}

fn depth_attachment(view: &TextureView) -> RenderPassDepthStencilAttachment<'_> {
    RenderPassDepthStencilAttachment {
        view,
        // Beside the tile lie those of others.
        depth_ops: Some(Operations {
            load: LoadOp::Load,
            store: StoreOp::Store,
        }),
        stencil_ops: None,
    }
}

/// Draws the depth of the maps whose turn it is, where nobody needs more.
pub(super) fn draw_depth(
    maps: Res<SceneLightMaps>,
    pipelines: Option<Res<LightMapPipelines>>,
    meshes: Meshes<DepthCapture>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for copy in &maps.copies {
        copy.record(ctx.command_encoder());
    }
    let clear = pipelines.and_then(|p| cache.get_render_pipeline(p.clear));
    let (Some(clear), Some(depth)) = (clear, &maps.depth) else {
        return;
    };
    if maps.surfaces.is_some() || maps.maps.drawn_now().next().is_none() {
        return;
    }
    let span = diagnostics.time_span(ctx.command_encoder(), "gi/scene/light_maps");
    for (_, map, tile) in maps.maps.drawn_now() {
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("gi/scene/light_maps"),
            color_attachments: &[],
            depth_stencil_attachment: Some(depth_attachment(&depth.each[tile.page as usize])),
            ..Default::default()
        });
        stay_inside(&mut pass, tile);
        pass.set_render_pipeline(clear);
        pass.draw(0..3, 0..1);
        meshes.draw(map, &mut pass);
    }
    span.end(ctx.command_encoder());
}

/// Draws depth and surfaces of the maps whose turn it is, and chooses virtual point lights from all of them.
pub(super) fn draw_surfaces(
    maps: Res<SceneLightMaps>,
    pipelines: Option<Res<LightMapPipelines>>,
    meshes: Meshes<SurfaceCapture>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(pipelines), Some(job), Some(depth), Some(surfaces)) =
        (pipelines, &maps.job, &maps.depth, &maps.surfaces)
    else {
        return;
    };
    let Some(clear) = cache.get_render_pipeline(pipelines.clear) else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    // One after the other: they share a G-buffer.
    for ((_, map, tile), resolve) in maps.maps.drawn_now().zip(&job.resolve) {
        let page = &depth.each[tile.page as usize];
        let span = diagnostics.time_span(ctx.command_encoder(), "gi/scene/light_maps");
        let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
            label: Some("gi/scene/light_maps_clear"),
            color_attachments: &[],
            depth_stencil_attachment: Some(depth_attachment(page)),
            ..Default::default()
        });
        stay_inside(&mut pass, tile);
        pass.set_render_pipeline(clear);
        pass.draw(0..3, 0..1);
        drop(pass);
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
            label: Some("gi/scene/light_maps"),
            // As Bevy's prepass has them: normals and motion are not wanted.
            color_attachments: &[
                None,
                None,
                color(&surfaces.gbuffer),
                color(&surfaces.pass_id),
            ],
            depth_stencil_attachment: Some(depth_attachment(page)),
            ..Default::default()
        });
        stay_inside(&mut pass, tile);
        meshes.draw(map, &mut pass);
        drop(pass);
        span.end(ctx.command_encoder());
        let size = tile.size >> surfaces.shape.reduction;
        Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics,
        }
        .run(
            &pipelines.resolve,
            Dispatch::Threads(UVec3::new(size, size, 1)),
            &[resolve],
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
