//! Layouts and pipelines of the probes.

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    ecs::prelude::*,
    render::render_resource::{binding_types::*, *},
    shader::ShaderDefVal,
};

use super::types::{self, GpuProbes};
use crate::{
    gpu::compute::ComputePass,
    scene::{volume::GpuVolume, voxels::shader_defs as voxel_shader_defs},
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
    pub place: ComputePass,
    pub look: ComputePass,
    pub moments: ComputePass,
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
