//! Layouts and pipelines of light maps, and how meshes are drawn into them.

use std::sync::Arc;

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    core_pipeline::core_3d::CORE_3D_DEPTH_FORMAT,
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{DrawDepthOnlyPrepass, DrawPrepass, MeshPipelineKey},
    render::{
        render_phase::DrawFunctions,
        render_resource::{binding_types::*, *},
    },
    shader::ShaderDefVal,
};

use super::types::{GpuLightMaps, GpuMapResolve, GpuVpl, GpuVpls};
use crate::{
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, loaded, storage_read, storage_write, uniform},
    },
    scene::{
        views::{CaptureKind, CapturePhase, CapturePipeline, PrepassPipelines},
        world::lights,
    },
    settings::LightShare,
};

/// Depth alone: Bevy's depth-only prepass.
pub(crate) struct DepthCapture;

impl CaptureKind for DepthCapture {
    type Param = (
        PrepassPipelines<'static>,
        SRes<DrawFunctions<CapturePhase<Self>>>,
    );
    const KEY: MeshPipelineKey = MeshPipelineKey::DEPTH_PREPASS;

    fn specialize(
        (prepass, draws): &mut SystemParamItem<Self::Param>,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        mesh_key: MeshPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CapturePipeline> {
        let reads_material = mesh_key
            .intersects(MeshPipelineKey::MAY_DISCARD | MeshPipelineKey::PREPASS_READS_MATERIAL);
        let draws = draws.read();
        Some(CapturePipeline {
            pipeline: prepass.specialize(cache, key, material, layout)?,
            draw: if reads_material {
                draws.id::<DrawPrepass>()
            } else {
                draws.id::<DrawDepthOnlyPrepass>()
            },
            reads_material,
        })
    }
}

/// Depth and a G-buffer of what is seen: Bevy's deferred prepass.
pub(crate) struct SurfaceCapture;

impl CaptureKind for SurfaceCapture {
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
pub(crate) struct LightMapPipelines {
    pub resolve_layout: GroupLayout,
    pub sum_layout: GroupLayout,
    pub vpls_layout: GroupLayout,
    /// Empties a tile of depth: a render pass can only clear all of a page.
    pub clear: CachedRenderPipelineId,
    pub resolve: ComputePass,
    pub sum: ComputePass,
    pub weigh: ComputePass,
    pub vpls: ComputePass,
}

impl LightMapPipelines {
    /// Whether all that draws depth, or surfaces too, is compiled.
    pub fn ready(&self, surfaces: bool, cache: &PipelineCache) -> bool {
        let passes = [self.resolve, self.sum, self.weigh, self.vpls];
        cache.get_render_pipeline(self.clear).is_some()
            && (!surfaces || passes.iter().all(|pass| pass.ready(cache)))
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

/// Layout of group 3 of whoever reads surfaces or virtual point lights; `lookup.wgsl` is its twin.
pub(crate) fn rsm_layout() -> GroupLayout {
    GroupLayout::new(
        "gi/scene/rsm",
        // Debug views look them up, too.
        ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
    )
    .with("maps", storage_read::<GpuLightMaps>())
    .with("texels", texture_2d_array(TextureSampleType::Uint))
    .with("flux", texture_2d_array(loaded()))
    .with("vpls", storage_read::<Vec<GpuVpl>>())
}

pub(super) fn init_pipelines(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let texels = || texture_2d_array(TextureSampleType::Uint);
    let flux = || texture_2d_array(loaded());
    let written = StorageTextureAccess::WriteOnly;
    let compute = ShaderStages::COMPUTE;
    let resolve_layout = GroupLayout::new("gi/scene/rsm_resolve", compute)
        .with("resolve_", uniform::<GpuMapResolve>())
        .with("maps", storage_read::<GpuLightMaps>())
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
        .with("maps", storage_read::<GpuLightMaps>())
        .with("texels", texels())
        .with("flux", flux())
        .with("vpls", storage_write::<Vec<GpuVpl>>())
        .with("sums", storage_write::<Vec<f32>>())
        .with("weights", storage_read::<Vec<f32>>());
    let pass = |name, block, layout: &GroupLayout, shader, entry| {
        ComputePass::new(&cache, name, block, &[layout], shader, entry, shader_defs())
    };
    let server = server.as_ref();
    let clear = cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("gi/scene/light_maps_clear".into()),
        vertex: VertexState {
            shader: load_embedded_asset!(server, "clear.wgsl"),
            entry_point: Some("far_away".into()),
            ..Default::default()
        },
        depth_stencil: Some(DepthStencilState {
            format: CORE_3D_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        ..Default::default()
    });
    commands.insert_resource(LightMapPipelines {
        clear,
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
