//! Pipelines and passes of reflective shadow maps.

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    ecs::prelude::*,
    math::UVec3,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{binding_types::*, *},
        renderer::RenderContext,
        view::ExtractedView,
    },
    shader::ShaderDefVal,
};

use super::{
    capture::RsmCapture,
    prepare::SceneRsm,
    types::{GpuRsmMaps, GpuRsmResolve, GpuVpls},
};
use crate::{
    gpu::compute::{ComputePass, Groups, Recorder, groups},
    scene::{
        capture::{CapturePhases, CaptureViews},
        lights,
    },
    settings::LightShare,
};

const NAME: &str = "gi/scene/rsm";

/// Pipelines and layouts.
#[derive(Resource)]
pub(crate) struct RsmPipelines {
    pub resolve_layout: BindGroupLayoutDescriptor,
    pub sum_layout: BindGroupLayoutDescriptor,
    pub vpls_layout: BindGroupLayoutDescriptor,
    resolve: ComputePass,
    sum: ComputePass,
    weigh: ComputePass,
    vpls: ComputePass,
}

impl RsmPipelines {
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        [self.resolve, self.sum, self.weigh, self.vpls]
            .iter()
            .all(|pass| pass.ready(cache))
    }
}

/// Constants of the shaders.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    let mut defs = Vec::from(lights::shader_defs());
    defs.push(ShaderDefVal::UInt(
        "SHARE_EVEN".into(),
        LightShare::Even as u32,
    ));
    defs
}

/// Layout of group 3 of whoever reads the maps; `lookup.wgsl` is its twin.
pub(crate) fn rsm_layout() -> BindGroupLayoutDescriptor {
    let read = || storage_buffer_read_only_sized(false, None);
    BindGroupLayoutDescriptor::new(
        NAME,
        &BindGroupLayoutEntries::sequential(
            // Debug views look them up, too.
            ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
            (
                read(),
                texture_2d_array(TextureSampleType::Uint),
                texture_2d_array(TextureSampleType::Float { filterable: false }),
                read(),
            ),
        ),
    )
}

pub(crate) fn init_rsm(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let maps = || storage_buffer_read_only::<GpuRsmMaps>(false);
    let texels = || texture_2d_array(TextureSampleType::Uint);
    let flux = || texture_2d_array(TextureSampleType::Float { filterable: false });
    let written = StorageTextureAccess::WriteOnly;
    let compute = ShaderStages::COMPUTE;
    let resolve_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/rsm_resolve",
        &BindGroupLayoutEntries::sequential(
            compute,
            (
                uniform_buffer::<GpuRsmResolve>(false),
                maps(),
                texture_2d(TextureSampleType::Depth),
                texture_2d(TextureSampleType::Uint),
                texture_storage_2d(TextureFormat::Rgba32Uint, written),
                texture_storage_2d(TextureFormat::R32Float, written),
            ),
        ),
    );
    let sum_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/rsm_sum",
        &BindGroupLayoutEntries::sequential(
            compute,
            (
                flux(),
                texture_storage_2d_array(TextureFormat::R32Float, written),
            ),
        ),
    );
    let vpls_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/rsm_vpls",
        &BindGroupLayoutEntries::sequential(
            compute,
            (
                uniform_buffer::<GpuVpls>(false),
                maps(),
                texels(),
                flux(),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_read_only_sized(false, None),
            ),
        ),
    );
    let pass = |name, layout: &BindGroupLayoutDescriptor, shader, entry| {
        ComputePass::new(&cache, name, &[layout], shader, entry, shader_defs())
    };
    let server = server.as_ref();
    commands.insert_resource(RsmPipelines {
        resolve: pass(
            "gi/scene/rsm_resolve",
            &resolve_layout,
            load_embedded_asset!(server, "resolve.wgsl"),
            "resolve",
        ),
        sum: pass(
            "gi/scene/rsm_sum",
            &sum_layout,
            load_embedded_asset!(server, "sum.wgsl"),
            "sum",
        ),
        weigh: pass(
            "gi/scene/rsm_weigh",
            &vpls_layout,
            load_embedded_asset!(server, "vpls.wgsl"),
            "weigh",
        ),
        vpls: pass(
            "gi/scene/rsm_vpls",
            &vpls_layout,
            load_embedded_asset!(server, "vpls.wgsl"),
            "choose",
        ),
        resolve_layout,
        sum_layout,
        vpls_layout,
    });
}

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
    let block = UVec3::new(8, 8, 1);
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
            groups(UVec3::new(texels, texels, 1), block),
            &[group],
        );
    }
    let mut record = Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics,
    };
    let levels = job.sum.iter();
    let levels = levels.map(|(threads, group)| (groups(*threads, block), [group]));
    if !job.sum.is_empty() {
        record.run_all(&pipelines.sum, None, levels);
    }
    let [count, volumes] = job.vpl_count.to_array();
    record.run(
        &pipelines.weigh,
        Groups::Direct(UVec3::new(volumes, 1, 1)),
        &[&job.vpls],
    );
    record.run(
        &pipelines.vpls,
        groups(UVec3::new(count, volumes, 1), UVec3::new(64, 1, 1)),
        &[&job.vpls],
    );
}
