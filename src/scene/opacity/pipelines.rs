//! Layouts and pipelines of opacity.

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    ecs::prelude::*,
    render::render_resource::{binding_types::*, *},
};

use super::types::GpuOpacityLevel;
use crate::{gpu::compute::ComputePass, scene::voxels::shader_defs};

/// Format of all levels.
pub(super) const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// Pipelines and layouts.
#[derive(Resource)]
pub(crate) struct OpacityPipelines {
    pub clear_layout: BindGroupLayoutDescriptor,
    pub voxels_layout: BindGroupLayoutDescriptor,
    pub cells_layout: BindGroupLayoutDescriptor,
    pub clear: ComputePass,
    pub voxels: ComputePass,
    pub cells: ComputePass,
}

impl OpacityPipelines {
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        let passes = [self.clear, self.voxels, self.cells];
        passes.iter().all(|pass| pass.ready(cache))
    }
}

pub(super) fn init_opacity_pipelines(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let read = || storage_buffer_read_only_sized(false, None);
    let level = || uniform_buffer::<GpuOpacityLevel>(false);
    let written = || texture_storage_3d(FORMAT, StorageTextureAccess::WriteOnly);
    let compute = ShaderStages::COMPUTE;
    let clear_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/clear_opacity",
        &BindGroupLayoutEntries::sequential(compute, (level(), written())),
    );
    let voxels_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/opacity_voxels",
        &BindGroupLayoutEntries::sequential(compute, (level(), written(), read(), read(), read())),
    );
    let cells_layout = BindGroupLayoutDescriptor::new(
        "gi/scene/opacity_cells",
        &BindGroupLayoutEntries::sequential(
            compute,
            (
                level(),
                written(),
                texture_3d(TextureSampleType::Float { filterable: false }),
            ),
        ),
    );
    let pass = |name, layout: &BindGroupLayoutDescriptor, entry, def: &str| {
        let shader = load_embedded_asset!(server.as_ref(), "filter.wgsl");
        let mut defs = shader_defs();
        defs.push(def.into());
        ComputePass::new(&cache, name, &[layout], shader, entry, defs)
    };
    commands.insert_resource(OpacityPipelines {
        clear: pass(
            "gi/scene/clear_opacity",
            &clear_layout,
            "clear_opacity",
            "CLEAR",
        ),
        voxels: pass(
            "gi/scene/opacity",
            &voxels_layout,
            "filter_voxels",
            "VOXELS",
        ),
        cells: pass("gi/scene/opacity", &cells_layout, "filter_cells", "CELLS"),
        clear_layout,
        voxels_layout,
        cells_layout,
    });
}
