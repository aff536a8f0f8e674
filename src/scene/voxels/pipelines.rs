//! Layouts and pipelines of the voxelizer.

use std::sync::Arc;

use bevy::{
    asset::{AssetServer, Handle, load_embedded_asset},
    ecs::{
        prelude::*,
        system::{SystemParamItem, lifetimeless::*},
    },
    material::{MaterialProperties, key::ErasedMaterialPipelineKey},
    mesh::MeshVertexBufferLayoutRef,
    pbr::{
        DrawMesh, MeshPipelineKey, PrepassPipeline, PrepassPipelineSpecializer,
        SetMaterialBindGroup, SetMeshBindGroup, SetPrepassViewBindGroup,
    },
    render::{render_phase::*, render_resource::*},
    shader::Shader,
};

use super::types::{GpuVoxelize, shader_defs};
use crate::{
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, storage_read, storage_write, uniform},
    },
    scene::{
        views::{CaptureKind, CapturePhase, CapturePipeline},
        world::material::MaterialShaders,
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
            layout: voxels.draw_layout.descriptor(),
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

/// Draws a mesh into the voxels. Group 1 is bound once a pass.
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
    pub draw_layout: GroupLayout,
    pub allocate_layout: GroupLayout,
    pub resolve_layout: GroupLayout,
    shader: Handle<Shader>,
    unknown_shader: Handle<Shader>,
    pub allocate: ComputePass,
    pub brick_arguments: ComputePass,
    pub resolve: ComputePass,
    pub slice_arguments: ComputePass,
    pub list: ComputePass,
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
    let draw_layout = GroupLayout::new("gi/scene/voxelize", ShaderStages::FRAGMENT)
        .with("voxelize", uniform::<GpuVoxelize>())
        .with("brick_map", storage_write::<Vec<u32>>())
        .with("pool", storage_write::<Vec<u32>>())
        .with("emission_levels", storage_read::<Vec<u32>>());
    let allocate_layout = GroupLayout::new("gi/scene/allocate_bricks", ShaderStages::COMPUTE)
        .with("brick_map", storage_write::<Vec<u32>>())
        .with("brick_list", storage_write::<Vec<u32>>())
        .with("counters", storage_write::<Vec<u32>>())
        .with("arguments", storage_write::<Vec<u32>>())
        .with("emission_levels", storage_write::<Vec<u32>>());
    let resolve_layout = GroupLayout::new("gi/scene/resolve_voxels", ShaderStages::COMPUTE)
        .with("voxelize", uniform::<GpuVoxelize>())
        .with("pool", storage_write::<Vec<u32>>())
        .with("brick_list", storage_read::<Vec<u32>>())
        .with("counters", storage_write::<Vec<u32>>())
        .with("voxel_list", storage_write::<Vec<u32>>())
        .with("occupancy", storage_write::<Vec<u32>>())
        .with("emission_levels", storage_read::<Vec<u32>>());
    let allocate_shader = load_embedded_asset!(server.as_ref(), "allocate.wgsl");
    let resolve_shader = load_embedded_asset!(server.as_ref(), "resolve.wgsl");
    let pass = |name, block, layout, shader: &Handle<Shader>, entry| {
        ComputePass::new(
            &cache,
            name,
            block,
            &[layout],
            shader.clone(),
            entry,
            shader_defs(),
        )
    };
    commands.insert_resource(VoxelPipelines {
        allocate: pass(
            "gi/scene/allocate_bricks",
            block::LINE,
            &allocate_layout,
            &allocate_shader,
            "allocate",
        ),
        brick_arguments: pass(
            "gi/scene/brick_arguments",
            block::ONE,
            &allocate_layout,
            &allocate_shader,
            "brick_arguments",
        ),
        slice_arguments: pass(
            "gi/scene/slice_arguments",
            block::ONE,
            &allocate_layout,
            &allocate_shader,
            "slice_arguments",
        ),
        resolve: pass(
            "gi/scene/resolve_voxels",
            block::LINE,
            &resolve_layout,
            &resolve_shader,
            "resolve",
        ),
        list: pass(
            "gi/scene/list_voxels",
            block::LINE,
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
