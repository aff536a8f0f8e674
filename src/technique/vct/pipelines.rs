//! Layouts and pipelines of voxel cone tracing.

use bevy::{
    asset::{AssetServer, Handle, load_embedded_asset},
    ecs::prelude::*,
    render::render_resource::{binding_types::*, *},
    shader::{Shader, ShaderDefVal},
};

use super::{
    settings::ConeLayout,
    types::{DIRECTIONS, GpuCones, GpuMip, GpuVoxelPass},
};
use crate::{
    gpu::compute::ComputePass,
    scene::{bind_group::scene_layout, lights, voxels::shader_defs as voxel_shader_defs},
    technique::Pipelines,
};

/// Pipelines of voxel cone tracing, and the layouts of what they alone bind.
#[derive(Resource)]
pub struct VctPipelines {
    pub(super) voxel_layout: BindGroupLayoutDescriptor,
    pub(super) carry_layout: BindGroupLayoutDescriptor,
    pub(super) clear_cells_layout: BindGroupLayoutDescriptor,
    pub(super) filter_voxels_layout: BindGroupLayoutDescriptor,
    pub(super) filter_cells_layout: BindGroupLayoutDescriptor,
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
pub(crate) fn cache_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "gi/vct/cache",
        &BindGroupLayoutEntries::sequential(
            // Debug views look it up, too.
            ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
            (
                uniform_buffer::<GpuCones>(false),
                texture_3d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
            ),
        ),
    )
}

impl Pipelines for VctPipelines {
    fn new(server: &AssetServer, cache: &PipelineCache) -> Self {
        let read = || storage_buffer_read_only_sized(false, None);
        let write = || storage_buffer_sized(false, None);
        let cell_texture =
            || texture_storage_3d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
        let layout = |name: &'static str, entries: &[BindGroupLayoutEntry]| {
            BindGroupLayoutDescriptor::new(name, entries)
        };
        let compute = ShaderStages::COMPUTE;
        let cache_layout = cache_layout();
        let voxel_layout = layout(
            "gi/vct/voxels",
            &BindGroupLayoutEntries::sequential(
                compute,
                (
                    uniform_buffer::<GpuVoxelPass>(false),
                    read(),
                    read(),
                    read(),
                    read(),
                    write(),
                    write(),
                ),
            ),
        );
        let carry_layout = layout(
            "gi/vct/carry",
            &BindGroupLayoutEntries::sequential(
                compute,
                (
                    uniform_buffer::<GpuVoxelPass>(false),
                    read(),
                    read(),
                    read(),
                    read(),
                    write(),
                    write(),
                    read(),
                ),
            ),
        );
        let filter_voxels_layout = layout(
            "gi/vct/filter_voxels",
            &BindGroupLayoutEntries::sequential(
                compute,
                (
                    uniform_buffer::<GpuMip>(false),
                    cell_texture(),
                    read(),
                    read(),
                    read(),
                    read(),
                ),
            ),
        );
        let clear_cells_layout = layout(
            "gi/vct/clear_cells",
            &BindGroupLayoutEntries::sequential(
                compute,
                (uniform_buffer::<GpuMip>(false), cell_texture()),
            ),
        );
        let filter_cells_layout = layout(
            "gi/vct/filter_cells",
            &BindGroupLayoutEntries::sequential(
                compute,
                (
                    uniform_buffer::<GpuMip>(false),
                    cell_texture(),
                    texture_3d(TextureSampleType::Float { filterable: false }),
                ),
            ),
        );
        let light_shader: Handle<Shader> = load_embedded_asset!(server, "light.wgsl");
        let filter_shader: Handle<Shader> = load_embedded_asset!(server, "filter.wgsl");
        let pass = |name,
                    layouts: &[&BindGroupLayoutDescriptor],
                    shader: &Handle<Shader>,
                    entry,
                    def: &str| {
            let mut defs = shader_defs();
            defs.push(def.into());
            ComputePass::new(cache, name, layouts, shader.clone(), entry, defs)
        };
        Self {
            carry: pass(
                "gi/vct/carry",
                &[&carry_layout],
                &light_shader,
                "carry",
                "CARRY",
            ),
            bounce: pass(
                "gi/vct/bounce",
                &[&voxel_layout, &scene_layout(), &cache_layout],
                &light_shader,
                "bounce",
                "BOUNCE",
            ),
            light: pass(
                "gi/vct/light",
                &[&voxel_layout, &scene_layout()],
                &light_shader,
                "light",
                "LIGHT",
            ),
            clear_cells: pass(
                "gi/vct/clear_cells",
                &[&clear_cells_layout],
                &filter_shader,
                "clear_cells",
                "CLEAR",
            ),
            filter_voxels: pass(
                "gi/vct/filter_voxels",
                &[&filter_voxels_layout],
                &filter_shader,
                "filter_voxels",
                "VOXELS",
            ),
            filter_cells: pass(
                "gi/vct/filter_cells",
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
