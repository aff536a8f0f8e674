//! Which meshes each view draws, and with which pipelines.

use std::marker::PhantomData;

use bevy::{
    core_pipeline::prepass::{OpaqueNoLightmap3dBatchSetKey, OpaqueNoLightmap3dBinKey},
    ecs::{prelude::*, system::StaticSystemParam},
    material::{
        AlphaMode,
        key::{ErasedMaterialPipelineKey, ErasedMeshPipelineKey},
    },
    mesh::Mesh3d,
    pbr::{
        MeshPipelineKey, PreparedMaterial, PrepassFragmentShader, PrepassVertexShader,
        PreprocessPipelines, RenderMaterialInstances, RenderMeshInstances,
    },
    render::{
        batching::gpu_preprocessing::GpuPreprocessingSupport,
        camera::{DirtySpecializations, PendingQueues},
        erased_render_asset::ErasedRenderAssets,
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_phase::BinnedRenderPhaseType,
        render_resource::PipelineCache,
        sync_world::MainEntityHashMap,
        view::{ExtractedView, RenderVisibleEntities},
    },
};

use super::{
    kind::{CaptureKind, CapturePhases},
    list::{CaptureView, CaptureViews, Drawn},
};

#[derive(Resource)]
pub(super) struct PendingCaptures<K: CaptureKind>(PendingQueues, PhantomData<K>);

impl<K: CaptureKind> Default for PendingCaptures<K> {
    fn default() -> Self {
        Self(PendingQueues::default(), PhantomData)
    }
}

/// Adds meshes that are new in a view to its phase, and removes those that left.
///
/// Long, as it follows Bevy's `queue_prepass_material_meshes` step by step.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn queue_captures<K: CaptureKind>(
    views: Query<(Entity, &ExtractedView, &RenderVisibleEntities), With<CaptureView<K>>>,
    mut capture: ResMut<CaptureViews<K>>,
    mut phases: ResMut<CapturePhases<K>>,
    mut pending: ResMut<PendingCaptures<K>>,
    param: StaticSystemParam<K::Param>,
    (cache, preprocess): (Res<PipelineCache>, Option<Res<PreprocessPipelines>>),
    (support, allocator, dirty): (
        Res<GpuPreprocessingSupport>,
        Res<MeshAllocator>,
        Res<DirtySpecializations>,
    ),
    meshes: Res<RenderAssets<RenderMesh>>,
    mesh_instances: Res<RenderMeshInstances>,
    material_instances: Res<RenderMaterialInstances>,
    materials: Res<ErasedRenderAssets<PreparedMaterial>>,
) {
    let mut param = param.into_inner();
    let capture = capture.bypass_change_detection();
    capture.changed.clear();
    capture.waiting.clear();
    // Without the resource, Bevy computes transforms on the CPU.
    capture.places_instances = preprocess.is_none_or(|preprocess| {
        let pass = preprocess.direct_preprocess.pipeline_id;
        pass.is_some_and(|id| cache.get_compute_pipeline(id).is_some())
    });
    let all_views = views.iter().map(|(_, view, _)| view.retained_view_entity);
    pending.0.expire_stale_views(&all_views.collect());
    for (id, view, visible) in &views {
        let retained = view.retained_view_entity;
        let (Some(class), Some(phase)) = (visible.get::<Mesh3d>(), phases.get_mut(&retained))
        else {
            continue;
        };
        let drawn = capture.drawn.entry(id).or_default();
        // Those that are queued again below leave this list.
        let mut dequeued = MainEntityHashMap::default();
        for &entity in dirty.iter_to_dequeue(retained, class) {
            phase.remove(entity);
            dequeued.extend(drawn.remove(&entity).map(|drawn| (entity, drawn)));
        }
        let queue = pending.0.prepare_for_new_frame(retained);
        for (render_entity, main_entity) in dirty.iter_to_queue(retained, class, &queue.prev_frame)
        {
            // Without a material of Bevy's a mesh is not drawn; it is queued again should it get one.
            let Some(material_instance) = material_instances.instances.get(main_entity) else {
                continue;
            };
            let prepare = || {
                let mesh_instance = mesh_instances.render_mesh_queue_data(*main_entity)?;
                let material = materials.get(material_instance.asset_id)?;
                let mesh = meshes.get(mesh_instance.mesh_asset_id())?;
                let slabs = allocator.mesh_slabs(&mesh_instance.mesh_asset_id())?;
                Some((mesh_instance, material, mesh, slabs))
            };
            let Some((mesh_instance, material, mesh, slabs)) = prepare() else {
                queue.current_frame.insert((*render_entity, *main_entity));
                capture.waiting.insert(id);
                continue;
            };
            let mut mesh_key = K::KEY | MeshPipelineKey::from_bits_retain(mesh.key_bits.bits());
            match material.properties.alpha_mode {
                AlphaMode::Opaque => {}
                AlphaMode::Mask(_) | AlphaMode::AlphaToCoverage => {
                    mesh_key |= MeshPipelineKey::MAY_DISCARD;
                }
                // What is see-through neither blocks nor bounces.
                _ => continue,
            }
            // Bevy asks the same of a material before it binds it (`prepass_reads_material`).
            let shaders = &material.properties;
            if shaders.get_shader(PrepassVertexShader).is_some()
                || shaders.get_shader(PrepassFragmentShader).is_some()
            {
                mesh_key |= MeshPipelineKey::PREPASS_READS_MATERIAL;
            }
            if mesh_instance.lightmap_slab_index().is_some() {
                mesh_key |= MeshPipelineKey::LIGHTMAPPED;
            }
            let key = ErasedMaterialPipelineKey {
                type_id: material_instance.asset_id.type_id(),
                mesh_key: ErasedMeshPipelineKey::new(mesh_key),
                material_key: material.properties.material_key.clone(),
            };
            let Some(pipeline) = K::specialize(
                &mut param,
                &cache,
                key,
                mesh_key,
                &material.properties,
                &mesh.layout,
            ) else {
                continue;
            };
            capture.pipelines.insert(pipeline.pipeline);
            let key = OpaqueNoLightmap3dBatchSetKey {
                pipeline: pipeline.pipeline,
                draw_function: pipeline.draw,
                material_bind_group_index: pipeline
                    .reads_material
                    .then_some(material.binding.group.0),
                slabs,
            };
            let now = Drawn {
                material: material_instance.asset_id,
                binding: (material.binding.group.0, material.binding.slot.0),
                mesh: mesh_instance.mesh_asset_id(),
                key: key.clone(),
            };
            let before = dequeued.remove(main_entity);
            // One that was waiting and has changed comes twice.
            let before = before.or_else(|| drawn.remove(main_entity));
            if before.as_ref() != Some(&now) {
                capture.changed.insert(id);
            }
            drawn.insert(*main_entity, now);
            phase.add(
                key,
                OpaqueNoLightmap3dBinKey {
                    asset_id: mesh_instance.mesh_asset_id().into(),
                },
                (*render_entity, *main_entity),
                mesh_instance.current_uniform_index,
                BinnedRenderPhaseType::mesh(mesh_instance.should_batch(), &support),
            );
        }
        if !dequeued.is_empty() {
            capture.changed.insert(id);
        }
    }
}
