//! Layouts and pipelines of radiance hints.

use bevy::{
    asset::{AssetServer, Handle, load_embedded_asset},
    ecs::prelude::*,
    math::{UVec2, Vec4},
    render::render_resource::{binding_types::*, *},
    shader::{Shader, ShaderDefVal},
};

use super::types::{self, GpuCarry, GpuHints, GpuStage};
use crate::{
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, filtered, loaded, storage_read, storage_write, uniform},
    },
    scene::{
        bind_group::scene_layout,
        light_maps::{rsm_layout, shader_defs as rsm_shader_defs},
        probes::{cache_layout as probes_layout, shader_defs as probe_shader_defs},
    },
    surface::depth::GpuCameraDepth,
    technique::Pipelines,
};

/// Pipelines of radiance hints, and the layouts of what they alone bind.
#[derive(Resource)]
pub struct HintsPipelines {
    pub(super) lights_layout: GroupLayout,
    pub(super) surfaces_layout: GroupLayout,
    pub(super) collect_layout: GroupLayout,
    pub(super) sum_layout: GroupLayout,
    pub(super) exchange_layout: GroupLayout,
    pub(super) carry_layout: GroupLayout,
    pub(super) albedo_layout: GroupLayout,
    pub(super) carry: ComputePass,
    pub(super) albedo: ComputePass,
    pub(super) lights: ComputePass,
    pub(super) surfaces: ComputePass,
    pub(super) bounce: ComputePass,
    pub(super) sum: ComputePass,
    pub(super) exchange: ComputePass,
}

/// Where `slots.wgsl` has the slots in group 0, after the pool of voxels.
pub(super) const SLOTS: u32 = 3;

/// Constants of the shaders, and of what they import.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    let mut defs = probe_shader_defs();
    // With those of lights.
    defs.extend(rsm_shader_defs());
    defs.extend(types::shader_defs());
    defs
}

/// Group 2 of whatever looks the hints up; `bindings.wgsl` is its twin.
pub(crate) fn cache_layout() -> GroupLayout {
    probes_layout("gi/hints/cache")
        .with("hints", uniform::<GpuHints>())
        .with("coefficients", texture_3d(filtered()))
}

impl Pipelines for HintsPipelines {
    fn new(server: &AssetServer, cache: &PipelineCache) -> Self {
        let compute = ShaderStages::COMPUTE;
        let cache_layout = cache_layout();
        let slots = storage_write::<Vec<Vec4>>;
        let lights_layout = GroupLayout::new("gi/hints/lights", compute)
            .with("brick_map", storage_read::<Vec<u32>>())
            .with("occupancy", storage_read::<Vec<u32>>())
            .with_at(SLOTS, "slots", slots())
            .with("camera_depth", texture_2d(loaded()))
            .with("camera", uniform::<GpuCameraDepth>());
        let surfaces_layout = GroupLayout::new("gi/hints/surfaces", compute)
            .with("brick_list", storage_read::<Vec<u32>>())
            .with("reflected", storage_write::<Vec<UVec2>>())
            .with("pool", storage_read::<Vec<u32>>())
            .with("voxel_list", storage_read::<Vec<u32>>())
            .with("counters", storage_read::<Vec<u32>>());
        let collect_layout = GroupLayout::new("gi/hints/bounce", compute)
            .with("stage", uniform::<GpuStage>())
            .with("reflected", storage_read::<Vec<UVec2>>())
            .with("pool", storage_read::<Vec<u32>>())
            .with_at(SLOTS, "slots", slots())
            .with("hits", storage_read::<Vec<UVec2>>());
        let target =
            texture_storage_3d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
        let sum_layout = GroupLayout::new("gi/hints/sum", compute)
            .with("stage", uniform::<GpuStage>())
            .with("target_", target)
            .with("albedos", storage_read::<Vec<Vec4>>())
            .with_at(SLOTS, "slots", slots());
        let exchange_layout = GroupLayout::new("gi/hints/exchange", compute)
            .with("stage", uniform::<GpuStage>())
            .with_at(SLOTS, "slots", slots());
        let carry_layout = GroupLayout::new("gi/hints/carry", compute)
            .with("carry_", uniform::<GpuCarry>())
            .with("before", storage_read::<Vec<Vec4>>())
            .with_at(SLOTS, "slots", slots());
        let albedo_layout = GroupLayout::new("gi/hints/albedo", compute)
            .with("hits", storage_read::<Vec<UVec2>>())
            .with("albedos", storage_write::<Vec<Vec4>>())
            .with("pool", storage_read::<Vec<u32>>());
        let rsm = rsm_layout();
        let bounce_shader: Handle<Shader> = load_embedded_asset!(server, "bounce.wgsl");
        let pass = |name, block, layouts: &[&GroupLayout], shader, entry, def: Option<&str>| {
            let mut defs = shader_defs();
            defs.extend(def.map(ShaderDefVal::from));
            ComputePass::new(cache, name, block, layouts, shader, entry, defs)
        };
        Self {
            carry: pass(
                "gi/hints/carry",
                block::LINE,
                &[&carry_layout],
                load_embedded_asset!(server, "carry.wgsl"),
                "carry",
                None,
            ),
            lights: pass(
                "gi/hints/lights",
                block::LINE,
                &[&lights_layout, &scene_layout(), &cache_layout, &rsm],
                load_embedded_asset!(server, "lights.wgsl"),
                "collect_lights",
                None,
            ),
            surfaces: pass(
                "gi/hints/surfaces",
                block::LINE,
                &[&surfaces_layout, &scene_layout(), &cache_layout],
                bounce_shader.clone(),
                "light_surfaces",
                Some("SURFACES"),
            ),
            bounce: pass(
                "gi/hints/bounce",
                block::LINE,
                &[&collect_layout, &scene_layout(), &cache_layout],
                bounce_shader,
                "collect_surfaces",
                None,
            ),
            sum: pass(
                "gi/hints/sum",
                block::CUBE,
                &[&sum_layout],
                load_embedded_asset!(server, "sum.wgsl"),
                "sum_slots",
                None,
            ),
            exchange: pass(
                "gi/hints/exchange",
                block::LINE,
                &[&exchange_layout, &scene_layout(), &cache_layout],
                load_embedded_asset!(server, "exchange.wgsl"),
                "collect_hints_around",
                None,
            ),
            albedo: pass(
                "gi/hints/albedo",
                block::LINE,
                &[&albedo_layout, &scene_layout(), &cache_layout],
                load_embedded_asset!(server, "albedo.wgsl"),
                "average_albedo",
                None,
            ),
            albedo_layout,
            carry_layout,
            exchange_layout,
            lights_layout,
            surfaces_layout,
            collect_layout,
            sum_layout,
        }
    }

    fn passes(&self) -> Vec<ComputePass> {
        vec![
            self.carry,
            self.albedo,
            self.lights,
            self.surfaces,
            self.bounce,
            self.sum,
            self.exchange,
        ]
    }
}
