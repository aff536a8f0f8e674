//! Layouts and pipelines of voxel cone tracing.

use bevy::{
    asset::{AssetServer, Handle, load_embedded_asset},
    ecs::prelude::*,
    math::UVec2,
    render::render_resource::{binding_types::*, *},
    shader::{Shader, ShaderDefVal},
};

use super::{
    settings::ConeLayout,
    types::{DIRECTIONS, GpuCones, GpuMip, GpuVoxelPass},
};
use crate::{
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, filtered, loaded, storage_read, storage_write, uniform},
    },
    scene::{bind_group::scene_layout, voxels::shader_defs as voxel_shader_defs, world::lights},
    technique::Pipelines,
};

/// Pipelines of voxel cone tracing, and the layouts of what they alone bind.
#[derive(Resource)]
pub struct VctPipelines {
    pub(super) voxel_layout: GroupLayout,
    pub(super) carry_layout: GroupLayout,
    pub(super) clear_cells_layout: GroupLayout,
    pub(super) filter_voxels_layout: GroupLayout,
    pub(super) filter_cells_layout: GroupLayout,
    pub(super) carry: ComputePass,
    pub(super) bounce: ComputePass,
    pub(super) light: ComputePass,
    pub(super) clear_cells: ComputePass,
    pub(super) filter_voxels: ComputePass,
    pub(super) filter_cells: ComputePass,
}

/// Constants of `lookup.wgsl` and `filter.wgsl`, and of what they import.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    let mut defs = voxel_shader_defs();
    defs.extend(lights::shader_defs());
    defs.push(ShaderDefVal::UInt("DIRECTIONS".into(), DIRECTIONS));
    defs.push(ShaderDefVal::UInt(
        "LAYOUT_FREED".into(),
        ConeLayout::Freed2018 as u32,
    ));
    defs
}

/// Group 2 of whatever looks the cache up; `bindings.wgsl` is its twin.
pub(crate) fn cache_layout() -> GroupLayout {
    GroupLayout::new(
        "gi/vct/cache",
        // Debug views look it up, too.
        ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
    )
    .with("cones", uniform::<GpuCones>())
    .with("cells", texture_3d(filtered()))
    .with("cell_sampler", sampler(SamplerBindingType::Filtering))
}

impl Pipelines for VctPipelines {
    fn new(server: &AssetServer, cache: &PipelineCache) -> Self {
        let cell_texture =
            || texture_storage_3d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
        let compute = ShaderStages::COMPUTE;
        let cache_layout = cache_layout();
        let voxel_layout = GroupLayout::new("gi/vct/voxels", compute)
            .with("pass_", uniform::<GpuVoxelPass>())
            .with("brick_list", storage_read::<Vec<u32>>())
            .with("pool", storage_read::<Vec<u32>>())
            .with("voxel_list", storage_read::<Vec<u32>>())
            .with("counters", storage_read::<Vec<u32>>())
            .with("bounced", storage_write::<Vec<UVec2>>())
            .with("other", storage_write::<Vec<UVec2>>());
        let carry_layout = GroupLayout::new("gi/vct/carry", compute)
            .with("pass_", uniform::<GpuVoxelPass>())
            .with("brick_list", storage_read::<Vec<u32>>())
            .with("previous_brick_map", storage_read::<Vec<u32>>())
            .with("voxel_list", storage_read::<Vec<u32>>())
            .with("counters", storage_read::<Vec<u32>>())
            .with("bounced", storage_write::<Vec<UVec2>>())
            .with("other", storage_write::<Vec<UVec2>>());
        let filter_voxels_layout = GroupLayout::new("gi/vct/filter_voxels", compute)
            .with("mip", uniform::<GpuMip>())
            .with("destination", cell_texture())
            .with("pool", storage_read::<Vec<u32>>())
            .with("brick_list", storage_read::<Vec<u32>>())
            .with("radiance", storage_read::<Vec<UVec2>>())
            .with("counters", storage_read::<Vec<u32>>());
        let clear_cells_layout = GroupLayout::new("gi/vct/clear_cells", compute)
            .with("mip", uniform::<GpuMip>())
            .with("destination", cell_texture());
        let filter_cells_layout = GroupLayout::new("gi/vct/filter_cells", compute)
            .with("mip", uniform::<GpuMip>())
            .with("destination", cell_texture())
            .with("finer", texture_3d(loaded()));
        let light_shader: Handle<Shader> = load_embedded_asset!(server, "light.wgsl");
        let filter_shader: Handle<Shader> = load_embedded_asset!(server, "filter.wgsl");
        let pass =
            |name, block, layouts: &[&GroupLayout], shader: &Handle<Shader>, entry, def: &str| {
                let mut defs = shader_defs();
                defs.push(def.into());
                ComputePass::new(cache, name, block, layouts, shader.clone(), entry, defs)
            };
        Self {
            carry: pass(
                "gi/vct/carry",
                block::LINE,
                &[&carry_layout],
                &light_shader,
                "carry",
                "CARRY",
            ),
            bounce: pass(
                "gi/vct/bounce",
                block::LINE,
                &[&voxel_layout, &scene_layout(), &cache_layout],
                &light_shader,
                "bounce",
                "BOUNCE",
            ),
            light: pass(
                "gi/vct/light",
                block::LINE,
                &[&voxel_layout, &scene_layout()],
                &light_shader,
                "light",
                "LIGHT",
            ),
            clear_cells: pass(
                "gi/vct/clear_cells",
                block::CUBE,
                &[&clear_cells_layout],
                &filter_shader,
                "clear_cells",
                "CLEAR",
            ),
            filter_voxels: pass(
                "gi/vct/filter_voxels",
                block::LINE,
                &[&filter_voxels_layout],
                &filter_shader,
                "filter_voxels",
                "VOXELS",
            ),
            filter_cells: pass(
                "gi/vct/filter_cells",
                block::CUBE,
                &[&filter_cells_layout],
                &filter_shader,
                "filter_cells",
                "CELLS",
            ),
            voxel_layout,
            carry_layout,
            clear_cells_layout,
            filter_voxels_layout,
            filter_cells_layout,
        }
    }

    fn passes(&self) -> Vec<ComputePass> {
        vec![
            self.carry,
            self.bounce,
            self.light,
            self.clear_cells,
            self.filter_voxels,
            self.filter_cells,
        ]
    }
}
