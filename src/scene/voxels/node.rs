//! Pipelines and passes of the voxelizer.

use std::sync::Arc;

use bevy::{
    asset::{AssetServer, Handle, load_embedded_asset},
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    math::UVec3,
    mesh::MeshVertexBufferLayoutRef,
    pbr::{
        DrawMesh, MeshPipelineKey, PrepassPipeline, PrepassPipelineSpecializer,
        SetMaterialBindGroup, SetMeshBindGroup, SetPrepassViewBindGroup,
    },
    render::{
        diagnostic::RecordDiagnostics,
        render_phase::*,
        render_resource::{binding_types::*, *},
        renderer::RenderContext,
        view::ExtractedView,
    },
    shader::Shader,
};

use super::{
    prepare::SceneVoxels,
    types::{GpuVoxelize, argument, shader_defs},
};
use crate::{
    gpu::compute::{ComputePass, Groups, Recorder},
    scene::{
        capture::{CaptureKind, CapturePhase, CapturePhases, CapturePipeline},
        material::MaterialShaders,
    },
};

/// Surfaces into voxels: Bevy's prepass with a fragment shader of our own.
pub(crate) struct VoxelCapture;

impl CaptureKind for VoxelCapture {
    type Param = (
        SRes<PrepassPipeline>,
        SRes<VoxelPipelines>,
        SResMut<SpecializedMeshPipelines<VoxelSpecializer>>,
        SRes<DrawFunctions<CapturePhase<Self>>>,
        SRes<MaterialShaders>,
    );
    // The deferred prepass hands normals, uvs and colours to its fragment shader.
    const KEY: MeshPipelineKey = MeshPipelineKey::DEFERRED_PREPASS
        .union(MeshPipelineKey::DEPTH_PREPASS)
        .union(MeshPipelineKey::VIEW_PROJECTION_ORTHOGRAPHIC);

    fn specialize(
        (prepass, voxels, pipelines, draws, materials): &mut SystemParamItem<Self::Param>,
        cache: &PipelineCache,
        key: ErasedMaterialPipelineKey,
        _: MeshPipelineKey,
        material: &Arc<MaterialProperties>,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Option<CapturePipeline> {
        let shader = match materials.0.get(&key.type_id) {
            Some(Some(own)) => own,
            Some(None) => &voxels.shader,
            None => {
                bevy::log::warn_once!(
                    "a material bounces light as plain grey; GiMaterialPlugin lets it bounce as it \
                     looks"
                );
                &voxels.unknown_shader
            }
        };
        let specializer = VoxelSpecializer {
            prepass: (**prepass).clone(),
            material: material.clone(),
            layout: voxels.draw_layout.clone(),
            shader: shader.clone(),
        };
        Some(CapturePipeline {
            pipeline: pipelines
                .specialize(cache, &specializer, key, layout)
                .ok()?,
            draw: draws.read().id::<DrawVoxelize>(),
            reads_material: true,
        })
    }
}

/// Makes the voxelizer's pipeline for a mesh layout and material.
pub(crate) struct VoxelSpecializer {
    prepass: PrepassPipeline,
    material: Arc<MaterialProperties>,
    layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
}

impl SpecializedMeshPipeline for VoxelSpecializer {
    type Key = ErasedMaterialPipelineKey;

    fn specialize(
        &self,
        key: Self::Key,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Result<RenderPipelineDescriptor, SpecializedMeshPipelineError> {
        let prepass = PrepassPipelineSpecializer {
            pipeline: self.prepass.clone(),
            properties: self.material.clone(),
        };
        let mut descriptor = prepass.specialize(key, layout)?;
        descriptor.label = Some("gi/scene/voxelize".into());
        // Group 1 is empty in Bevy's prepass.
        descriptor.layout[1] = self.layout.clone();
        descriptor.primitive.cull_mode = None;
        descriptor.depth_stencil = None;
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.shader = self.shader.clone();
            fragment.shader_defs.extend(shader_defs());
            fragment.targets = vec![Some(ColorTargetState {
                format: TextureFormat::R8Unorm,
                blend: None,
                write_mask: ColorWrites::empty(),
            })];
        }
        Ok(descriptor)
    }
}

/// Draws a mesh into the voxels. Group 1 is bound by [`voxelize`], once a pass.
pub(crate) type DrawVoxelize = (
    SetItemPipeline,
    SetPrepassViewBindGroup<0>,
    SetMeshBindGroup<2>,
    SetMaterialBindGroup<3>,
    DrawMesh,
);

/// Pipelines and layouts of the voxelizer.
#[derive(Resource)]
pub(crate) struct VoxelPipelines {
    pub draw_layout: BindGroupLayoutDescriptor,
    pub allocate_layout: BindGroupLayoutDescriptor,
    pub resolve_layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
    unknown_shader: Handle<Shader>,
    allocate: ComputePass,
    brick_arguments: ComputePass,
    resolve: ComputePass,
    slice_arguments: ComputePass,
    list: ComputePass,
}

impl VoxelPipelines {
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        [
            self.allocate,
            self.brick_arguments,
            self.resolve,
            self.slice_arguments,
            self.list,
        ]
        .iter()
        .all(|pass| pass.ready(cache))
    }
}

pub(crate) fn init_voxel_pipelines(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let draw_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/voxelize",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                uniform_buffer::<GpuVoxelize>(false),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_read_only_sized(false, None),
            ),
        ),
    );
    let allocate_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/allocate_bricks",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer::<GpuVoxelize>(false),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
            ),
        ),
    );
    let resolve_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/resolve_voxels",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer::<GpuVoxelize>(false),
                storage_buffer_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_read_only_sized(false, None),
            ),
        ),
    );
    let allocate_shader = load_embedded_asset!(server.as_ref(), "allocate.wgsl");
    let resolve_shader = load_embedded_asset!(server.as_ref(), "resolve.wgsl");
    let pass = |name, layout, shader: &Handle<Shader>, entry| {
        ComputePass::new(
            &cache,
            name,
            &[layout],
            shader.clone(),
            entry,
            shader_defs(),
        )
    };
    commands.insert_resource(VoxelPipelines {
        allocate: pass(
            "gi/scene/allocate_bricks",
            &allocate_layout,
            &allocate_shader,
            "allocate",
        ),
        brick_arguments: pass(
            "gi/scene/brick_arguments",
            &allocate_layout,
            &allocate_shader,
            "brick_arguments",
        ),
        slice_arguments: pass(
            "gi/scene/slice_arguments",
            &allocate_layout,
            &allocate_shader,
            "slice_arguments",
        ),
        resolve: pass(
            "gi/scene/resolve_voxels",
            &resolve_layout,
            &resolve_shader,
            "resolve",
        ),
        list: pass(
            "gi/scene/list_voxels",
            &resolve_layout,
            &resolve_shader,
            "list",
        ),
        draw_layout,
        allocate_layout,
        resolve_layout,
        shader: load_embedded_asset!(server.as_ref(), "voxelize.wgsl"),
        unknown_shader: load_embedded_asset!(server.as_ref(), "voxelize_unknown.wgsl"),
    });
}

/// Captures every volume that has a job.
pub(crate) fn voxelize(
    world: &World,
    volumes: Query<&SceneVoxels>,
    views: Query<&ExtractedView>,
    phases: Res<CapturePhases<VoxelCapture>>,
    pipelines: Option<Res<VoxelPipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else { return };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for voxels in &volumes {
        let Some(job) = &voxels.job else {
            if voxels.readback.is_owed() {
                voxels
                    .readback
                    .copy(ctx.command_encoder(), &voxels.counters);
            }
            continue;
        };

        let encoder = ctx.command_encoder();
        encoder.clear_buffer(voxels.brick_map(), 0, None);
        encoder.clear_buffer(&voxels.pool, 0, None);
        encoder.clear_buffer(&voxels.occupancy, 0, None);
        encoder.clear_buffer(&voxels.counters, 0, None);

        let draw = |ctx: &mut RenderContext, name: &'static str, step: usize| {
            let span = diagnostics.time_span(ctx.command_encoder(), name);
            for axis in 0..3 {
                let Some(phase) = views
                    .get(job.views[axis])
                    .ok()
                    .and_then(|view| phases.get(&view.retained_view_entity))
                else {
                    continue;
                };
                let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
                    label: Some(name),
                    color_attachments: &[Some(RenderPassColorAttachment {
                        view: &job.targets[axis],
                        depth_slice: None,
                        resolve_target: None,
                        ops: Operations {
                            load: LoadOp::Clear(Default::default()),
                            store: StoreOp::Discard,
                        },
                    })],
                    ..Default::default()
                });
                pass.set_bind_group(1, &job.draw[step][axis], &[]);
                if let Err(error) = phase.render(&mut pass, world, job.views[axis]) {
                    bevy::log::error!("voxelizing failed: {error:?}");
                }
            }
            span.end(ctx.command_encoder());
        };
        draw(&mut ctx, "gi/scene/mark_bricks", 0);
        {
            let mut record = Recorder {
                encoder: ctx.command_encoder(),
                cache: &cache,
                diagnostics,
            };
            let bricks = voxels.grid.bricks().element_product().div_ceil(64);
            let rows = bricks.div_ceil(argument::ROW);
            let groups = UVec3::new(bricks.div_ceil(rows), rows, 1);
            record.run(
                &pipelines.allocate,
                Groups::Direct(groups),
                &[&job.allocate],
            );
            record.run(
                &pipelines.brick_arguments,
                Groups::Direct(UVec3::ONE),
                &[&job.allocate],
            );
        }
        draw(&mut ctx, "gi/scene/voxelize", 1);
        let mut record = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics,
        };
        let per_brick = || Groups::Indirect(&voxels.arguments, 4 * u64::from(argument::BRICKS));
        record.run(&pipelines.resolve, per_brick(), &[&job.resolve]);
        record.run(
            &pipelines.slice_arguments,
            Groups::Direct(UVec3::ONE),
            &[&job.allocate],
        );
        record.run(&pipelines.list, per_brick(), &[&job.resolve]);
        voxels.readback.copy(record.encoder, &voxels.counters);
    }
}
