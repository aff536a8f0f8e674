//! [`CaptureKind`]: how meshes are drawn from a view, and the phase that holds them.

use std::{marker::PhantomData, ops::Range, sync::Arc};

use bevy::{
    core_pipeline::prepass::{OpaqueNoLightmap3dBatchSetKey, OpaqueNoLightmap3dBinKey},
    ecs::{
        prelude::*,
        system::{SystemParam, SystemParamItem},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{MeshPipelineKey, PrepassPipeline, PrepassPipelineSpecializer},
    render::{render_phase::*, render_resource::*, sync_world::MainEntity},
};

/// How meshes are drawn from a kind of capture view.
pub(crate) trait CaptureKind: Send + Sync + Sized + 'static {
    /// What [`specialize`](Self::specialize) needs.
    type Param: SystemParam + 'static;
    /// Bits of the pipeline key that are the same for all meshes.
    const KEY: MeshPipelineKey;

    /// The pipeline for a mesh; `None` if such a mesh is not drawn.
    fn specialize(
        param: &mut SystemParamItem<Self::Param>,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        mesh_key: MeshPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CapturePipeline>;
}

/// How one mesh is drawn.
pub(crate) struct CapturePipeline {
    pub pipeline: CachedRenderPipelineId,
    pub draw: DrawFunctionId,
    /// Whether the material's bind group is read.
    pub reads_material: bool,
}

/// Bevy's own prepass as the pipeline of a capture.
#[derive(SystemParam)]
pub(crate) struct PrepassPipelines<'w> {
    prepass: Res<'w, PrepassPipeline>,
    pipelines: ResMut<'w, SpecializedMeshPipelines<PrepassPipelineSpecializer>>,
}

impl PrepassPipelines<'_> {
    /// The pipeline for a mesh with a material.
    pub fn specialize(
        &mut self,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CachedRenderPipelineId> {
        let specializer = PrepassPipelineSpecializer {
            pipeline: self.prepass.clone(),
            properties: material.clone(),
        };
        let pipeline = self.pipelines.specialize(cache, &specializer, key, layout);
        pipeline.ok()
    }
}

/// A mesh in a capture view.
pub(crate) struct CapturePhase<K> {
    key: OpaqueNoLightmap3dBatchSetKey,
    entity: (Entity, MainEntity),
    batch_range: Range<u32>,
    extra_index: PhaseItemExtraIndex,
    kind: PhantomData<K>,
}

impl<K: CaptureKind> PhaseItem for CapturePhase<K> {
    fn entity(&self) -> Entity {
        self.entity.0
    }
    fn main_entity(&self) -> MainEntity {
        self.entity.1
    }
    fn draw_function(&self) -> DrawFunctionId {
        self.key.draw_function
    }
    fn batch_range(&self) -> &Range<u32> {
        &self.batch_range
    }
    fn batch_range_mut(&mut self) -> &mut Range<u32> {
        &mut self.batch_range
    }
    fn extra_index(&self) -> PhaseItemExtraIndex {
        self.extra_index.clone()
    }
    fn batch_range_and_extra_index_mut(&mut self) -> (&mut Range<u32>, &mut PhaseItemExtraIndex) {
        (&mut self.batch_range, &mut self.extra_index)
    }
}

impl<K: CaptureKind> BinnedPhaseItem for CapturePhase<K> {
    type BatchSetKey = OpaqueNoLightmap3dBatchSetKey;
    type BinKey = OpaqueNoLightmap3dBinKey;

    fn new(
        key: Self::BatchSetKey,
        _: Self::BinKey,
        entity: (Entity, MainEntity),
        batch_range: Range<u32>,
        extra_index: PhaseItemExtraIndex,
    ) -> Self {
        Self {
            key,
            entity,
            batch_range,
            extra_index,
            kind: PhantomData,
        }
    }
}

impl<K: CaptureKind> CachedRenderPipelinePhaseItem for CapturePhase<K> {
    fn cached_pipeline(&self) -> CachedRenderPipelineId {
        self.key.pipeline
    }
}

pub(crate) type CapturePhases<K> = ViewBinnedRenderPhases<CapturePhase<K>>;
