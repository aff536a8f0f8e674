//! Layouts and pipelines of the probes.

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    ecs::prelude::*,
    math::{UVec2, Vec4},
    render::render_resource::{binding_types::*, *},
    shader::ShaderDefVal,
};

use super::types::{self, GpuProbes};
use crate::{
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, filtered, storage_read, storage_write, uniform},
    },
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
    pub look_layout: GroupLayout,
    pub moments_layout: GroupLayout,
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

/// Begins group 2 of whoever looks probes up; `bindings.wgsl` is its twin.
pub(crate) fn cache_layout(label: &'static str) -> GroupLayout {
    // Debug views look them up, too.
    GroupLayout::new(label, ShaderStages::COMPUTE | ShaderStages::FRAGMENT)
        .with("probes", uniform::<GpuProbes>())
        .with("offsets", storage_read::<Vec<Vec4>>())
        .with("moments", texture_2d_array(filtered()))
        .with("probe_sampler", sampler(SamplerBindingType::Filtering))
}

pub(crate) fn init_probe_pipelines(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let look_layout = GroupLayout::new("gi/scene/place_probes", ShaderStages::COMPUTE)
        .with("brick_map", storage_read::<Vec<u32>>())
        .with("occupancy", storage_read::<Vec<u32>>())
        .with("pool", storage_read::<Vec<u32>>())
        .with("pass_", uniform::<GpuProbePass>())
        .with("offsets", storage_write::<Vec<Vec4>>())
        .with("hits", storage_write::<Vec<UVec2>>())
        .with("pins", storage_read::<Vec<Vec4>>());
    let moments_layout = GroupLayout::new("gi/scene/probe_moments", ShaderStages::COMPUTE)
        .with("probes", uniform::<GpuProbes>())
        .with("hits", storage_read::<Vec<UVec2>>())
        .with(
            "moments",
            texture_storage_2d_array(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
        );
    let place = load_embedded_asset!(server.as_ref(), "place.wgsl");
    let pass = |name, block, layout, shader, entry| {
        ComputePass::new(&cache, name, block, &[layout], shader, entry, shader_defs())
    };
    commands.insert_resource(ProbePipelines {
        place: pass(
            "gi/scene/place_probes",
            block::LINE,
            &look_layout,
            place.clone(),
            "place",
        ),
        look: pass(
            "gi/scene/trace_probes",
            block::LINE,
            &look_layout,
            place,
            "look_at_scene",
        ),
        moments: pass(
            "gi/scene/probe_moments",
            block::TILE,
            &moments_layout,
            load_embedded_asset!(server.as_ref(), "moments.wgsl"),
            "store_moments",
        ),
        look_layout,
        moments_layout,
    });
}
