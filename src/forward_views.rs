//! Cameras that are not deferred, in an app whose opaque materials are.
//!
//! Bevy decides per material, not per camera, whether it is drawn forward or deferred: with
//! `DefaultOpaqueRendererMethod::deferred()`, which GI cameras need, opaque meshes vanish from every
//! camera that has no deferred prepass. Here they are queued for those cameras, as Bevy would.

use bevy::{
    app::{App, Plugin},
    core_pipeline::{
        core_3d::{Opaque3d, Opaque3dBatchSetKey, Opaque3dBinKey},
        prepass::DeferredPrepass,
    },
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    material::{OpaqueRendererMethod, RenderPhaseType},
    mesh::Mesh3d,
    pbr::{
        MainPassOpaqueDrawFunction, PreparedMaterial, RenderMaterialInstances, RenderMeshInstances,
        SpecializedMaterialPipelineCache, queue_material_meshes,
    },
    render::{
        Render, RenderApp, RenderSystems,
        batching::gpu_preprocessing::GpuPreprocessingSupport,
        camera::{DirtySpecializations, PendingQueues},
        erased_render_asset::ErasedRenderAssets,
        mesh::allocator::MeshAllocator,
        render_phase::{BinnedRenderPhaseType, ViewBinnedRenderPhases},
        view::{ExtractedView, RenderVisibleEntities},
    },
};

/// Draws opaque materials that are deferred by default in cameras that are not deferred. Without it, such cameras show
/// only what is rendered forward.
#[derive(Default)]
pub struct ForwardViewsPlugin;

impl Plugin for ForwardViewsPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.init_resource::<PendingForward>().add_systems(
            Render,
            queue_deferred_materials_forward
                .in_set(RenderSystems::QueueMeshes)
                .after(queue_material_meshes),
        );
    }
}

/// Meshes whose assets have not arrived.
#[derive(Resource, Default)]
struct PendingForward(PendingQueues);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn queue_deferred_materials_forward(
    views: Query<(&ExtractedView, &RenderVisibleEntities), Without<DeferredPrepass>>,
    mut phases: ResMut<ViewBinnedRenderPhases<Opaque3d>>,
    mut pending: ResMut<PendingForward>,
    pipelines: Res<SpecializedMaterialPipelineCache>,
    dirty: Res<DirtySpecializations>,
    materials: Res<ErasedRenderAssets<PreparedMaterial>>,
    material_instances: Res<RenderMaterialInstances>,
    mesh_instances: Res<RenderMeshInstances>,
    allocator: Res<MeshAllocator>,
    support: Res<GpuPreprocessingSupport>,
) {
    for (view, visible) in &views {
        let retained = view.retained_view_entity;
        let (Some(phase), Some(pipelines), Some(class)) = (
            phases.get_mut(&retained),
            pipelines.get(&retained),
            visible.get::<Mesh3d>(),
        ) else {
            continue;
        };
        let queue = pending.0.prepare_for_new_frame(retained);
        for (render_entity, main_entity) in dirty.iter_to_queue(retained, class, &queue.prev_frame)
        {
            let prepare = || {
                let pipeline = *pipelines.get(main_entity)?;
                let instance = material_instances.instances.get(main_entity)?;
                let mesh = mesh_instances.render_mesh_queue_data(*main_entity)?;
                let material = materials.get(instance.asset_id)?;
                let slabs = allocator.mesh_slabs(&mesh.mesh_asset_id())?;
                Some((pipeline, mesh, material, slabs))
            };
            let Some((pipeline, mesh, material, slabs)) = prepare() else {
                queue.current_frame.insert((*render_entity, *main_entity));
                continue;
            };
            let deferred = material.properties.render_method == OpaqueRendererMethod::Deferred
                && matches!(
                    material.properties.render_phase_type,
                    RenderPhaseType::Opaque
                );
            let draw_function = material
                .properties
                .get_draw_function(MainPassOpaqueDrawFunction);
            let (true, Some(draw_function)) = (deferred, draw_function) else {
                continue;
            };
            // A mesh may wait here and be queued twice: the first entry goes.
            phase.remove(*main_entity);
            phase.add(
                Opaque3dBatchSetKey {
                    pipeline,
                    draw_function,
                    material_bind_group_index: Some(material.binding.group.0),
                    slabs,
                    lightmap_slab: mesh.lightmap_slab_index().map(|index| *index),
                },
                Opaque3dBinKey {
                    asset_id: mesh.mesh_asset_id().into(),
                },
                (*render_entity, *main_entity),
                mesh.current_uniform_index,
                BinnedRenderPhaseType::mesh(mesh.should_batch(), &support),
            );
        }
    }
}
