//! Pipelines and passes of the probes.

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    ecs::prelude::*,
    math::UVec3,
    render::{
        render_resource::{binding_types::*, *},
        renderer::RenderContext,
    },
    shader::ShaderDefVal,
};

use super::{
    prepare::SceneProbes,
    types::{self, GpuProbes},
};
use crate::{
    gpu::compute::{ComputePass, Groups, Recorder, groups},
    scene::{
        volume::GpuVolume,
        voxels::{argument, shader_defs as voxel_shader_defs},
    },
};

/// Uniform of `place.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(super) struct GpuProbePass {
    pub volume: GpuVolume,
    pub probes: GpuProbes,
    /// Probes placed by hand.
    pub pins: u32,
}

/// Pipelines and layouts of the probes.
#[derive(Resource)]
pub(crate) struct ProbePipelines {
    pub look_layout: BindGroupLayoutDescriptor,
    pub moments_layout: BindGroupLayoutDescriptor,
    place: ComputePass,
    look: ComputePass,
    moments: ComputePass,
}

impl ProbePipelines {
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        [self.place, self.look, self.moments]
            .iter()
            .all(|pass| pass.ready(cache))
    }
}

/// Constants of the shaders, and of what they import.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    let mut defs = voxel_shader_defs();
    defs.extend(types::shader_defs());
    defs
}

/// The first entries of group 2 of whoever looks probes up; `bindings.wgsl` is their twin.
pub(crate) fn cache_entries() -> [BindGroupLayoutEntryBuilder; 4] {
    [
        uniform_buffer::<GpuProbes>(false),
        storage_buffer_read_only_sized(false, None),
        texture_2d_array(TextureSampleType::Float { filterable: true }),
        sampler(SamplerBindingType::Filtering),
    ]
}

pub(crate) fn init_probe_pipelines(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let read = || storage_buffer_read_only_sized(false, None);
    let write = || storage_buffer_sized(false, None);
    let look_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/place_probes",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                read(),
                read(),
                read(),
                uniform_buffer::<GpuProbePass>(false),
                write(),
                write(),
                read(),
            ),
        ),
    );
    let moments_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/probe_moments",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer::<GpuProbes>(false),
                read(),
                texture_storage_2d_array(
                    TextureFormat::Rgba16Float,
                    StorageTextureAccess::WriteOnly,
                ),
            ),
        ),
    );
    let place = load_embedded_asset!(server.as_ref(), "place.wgsl");
    let pass = |name, layout, shader, entry| {
        ComputePass::new(&cache, name, &[layout], shader, entry, shader_defs())
    };
    commands.insert_resource(ProbePipelines {
        place: pass(
            "gi/scene/place_probes",
            &look_layout,
            place.clone(),
            "place",
        ),
        look: pass(
            "gi/scene/trace_probes",
            &look_layout,
            place,
            "look_at_scene",
        ),
        moments: pass(
            "gi/scene/probe_moments",
            &moments_layout,
            load_embedded_asset!(server.as_ref(), "moments.wgsl"),
            "store_moments",
        ),
        look_layout,
        moments_layout,
    });
}

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
