//! Layouts and pipelines of opacity.

use bevy::{
    asset::{AssetServer, load_embedded_asset},
    ecs::prelude::*,
    render::render_resource::{binding_types::*, *},
};

use super::types::GpuOpacityLevel;
use crate::{
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, loaded, storage_read, uniform},
    },
    scene::voxels::shader_defs,
};

/// Format of all levels.
pub(super) const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// Pipelines and layouts.
#[derive(Resource)]
pub(crate) struct OpacityPipelines {
    pub clear_layout: GroupLayout,
    pub voxels_layout: GroupLayout,
    pub cells_layout: GroupLayout,
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
    let written = || texture_storage_3d(FORMAT, StorageTextureAccess::WriteOnly);
    let layout = |name| {
        GroupLayout::new(name, ShaderStages::COMPUTE)
            .with("level", uniform::<GpuOpacityLevel>())
            .with("destination", written())
    };
    let clear_layout = layout("gi/scene/clear_opacity");
    let voxels_layout = layout("gi/scene/opacity_voxels")
        .with("pool", storage_read::<Vec<u32>>())
        .with("brick_list", storage_read::<Vec<u32>>())
        .with("counters", storage_read::<Vec<u32>>());
    let cells_layout = layout("gi/scene/opacity_cells").with("finer", texture_3d(loaded()));
    let pass = |name, block, layout: &GroupLayout, entry, def: &str| {
        let shader = load_embedded_asset!(server.as_ref(), "filter.wgsl");
        let mut defs = shader_defs();
        defs.push(def.into());
        ComputePass::new(&cache, name, block, &[layout], shader, entry, defs)
    };
    commands.insert_resource(OpacityPipelines {
        clear: pass(
            "gi/scene/clear_opacity",
            block::CUBE,
            &clear_layout,
            "clear_opacity",
            "CLEAR",
        ),
        voxels: pass(
            "gi/scene/opacity_voxels",
            block::LINE,
            &voxels_layout,
            "filter_voxels",
            "VOXELS",
        ),
        cells: pass(
            "gi/scene/opacity_cells",
            block::CUBE,
            &cells_layout,
            "filter_cells",
            "CELLS",
        ),
        clear_layout,
        voxels_layout,
        cells_layout,
    });
}
