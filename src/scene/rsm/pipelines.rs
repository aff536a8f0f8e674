//! Layouts and pipelines of reflective shadow maps, and how meshes are drawn into them.

use std::sync::Arc;

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{DrawPrepass, MeshPipelineKey},
    render::{
        render_phase::DrawFunctions,
        render_resource::{binding_types::*, *},
    },
    shader::ShaderDefVal,
};

use super::types::{GpuRsmMaps, GpuRsmResolve, GpuVpl, GpuVpls};
use crate::{
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, loaded, storage_read, storage_write, uniform},
    },
    scene::{
        capture::{CaptureKind, CapturePhase, CapturePipeline, PrepassPipelines},
        lights,
    },
    settings::LightShare,
};

/// The name of the pass that draws, and the label of group 3.
pub(super) const NAME: &str = "gi/scene/rsm";

/// The G-buffer from the lights: Bevy's deferred prepass as it is.
pub(crate) struct RsmCapture;

impl CaptureKind for RsmCapture {
    type Param = (
        PrepassPipelines<'static>,
        SRes<DrawFunctions<CapturePhase<Self>>>,
    );
    const KEY: MeshPipelineKey =
        MeshPipelineKey::DEPTH_PREPASS.union(MeshPipelineKey::DEFERRED_PREPASS);

    fn specialize(
        (prepass, draws): &mut SystemParamItem<Self::Param>,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        _: MeshPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CapturePipeline> {
        Some(CapturePipeline {
            pipeline: prepass.specialize(cache, key, material, layout)?,
            draw: draws.read().id::<DrawPrepass>(),
            reads_material: true,
        })
    }
}

/// Pipelines and layouts.
#[derive(Resource)]
pub(crate) struct RsmPipelines {
    pub resolve_layout: GroupLayout,
    pub sum_layout: GroupLayout,
    pub vpls_layout: GroupLayout,
    pub resolve: ComputePass,
    pub sum: ComputePass,
    pub weigh: ComputePass,
    pub vpls: ComputePass,
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
pub(crate) fn rsm_layout() -> GroupLayout {
    GroupLayout::new(
        NAME,
        // Debug views look them up, too.
        ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
    )
    .with("maps", storage_read::<GpuRsmMaps>())
    .with("texels", texture_2d_array(TextureSampleType::Uint))
    .with("flux", texture_2d_array(loaded()))
    .with("vpls", storage_read::<Vec<GpuVpl>>())
}

pub(crate) fn init_rsm(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let texels = || texture_2d_array(TextureSampleType::Uint);
    let flux = || texture_2d_array(loaded());
    let written = StorageTextureAccess::WriteOnly;
    let compute = ShaderStages::COMPUTE;
    let resolve_layout = GroupLayout::new("gi/scene/rsm_resolve", compute)
        .with("resolve_", uniform::<GpuRsmResolve>())
        .with("maps", storage_read::<GpuRsmMaps>())
        .with("depth_texture", texture_2d(TextureSampleType::Depth))
        .with("deferred_texture", texture_2d(TextureSampleType::Uint))
        .with(
            "texels",
            texture_storage_2d(TextureFormat::Rgba32Uint, written),
        )
        .with("flux", texture_storage_2d(TextureFormat::R32Float, written));
    let sum_layout = GroupLayout::new("gi/scene/rsm_sum", compute)
        .with("finer", flux())
        .with(
            "coarser",
            texture_storage_2d_array(TextureFormat::R32Float, written),
        );
    let vpls_layout = GroupLayout::new("gi/scene/rsm_vpls", compute)
        .with("vpls_", uniform::<GpuVpls>())
        .with("maps", storage_read::<GpuRsmMaps>())
        .with("texels", texels())
        .with("flux", flux())
        .with("vpls", storage_write::<Vec<GpuVpl>>())
        .with("sums", storage_write::<Vec<f32>>())
        .with("weights", storage_read::<Vec<f32>>());
    let pass = |name, block, layout: &GroupLayout, shader, entry| {
        ComputePass::new(&cache, name, block, &[layout], shader, entry, shader_defs())
    };
    let server = server.as_ref();
    commands.insert_resource(RsmPipelines {
        resolve: pass(
            "gi/scene/rsm_resolve",
            block::TILE,
            &resolve_layout,
            load_embedded_asset!(server, "resolve.wgsl"),
            "resolve",
        ),
        sum: pass(
            "gi/scene/rsm_sum",
            block::TILE,
            &sum_layout,
            load_embedded_asset!(server, "sum.wgsl"),
            "sum",
        ),
        weigh: pass(
            "gi/scene/rsm_weigh",
            block::LINE,
            &vpls_layout,
            load_embedded_asset!(server, "vpls.wgsl"),
            "weigh",
        ),
        vpls: pass(
            "gi/scene/rsm_vpls",
            block::LINE,
            &vpls_layout,
            load_embedded_asset!(server, "vpls.wgsl"),
            "choose",
        ),
        resolve_layout,
        sum_layout,
        vpls_layout,
    });
}
