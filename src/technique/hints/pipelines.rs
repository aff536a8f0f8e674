//! Layouts and pipelines of radiance hints.

use bevy::{
    asset::{AssetServer, Handle, load_embedded_asset},
    ecs::prelude::*,
    render::render_resource::{binding_types::*, *},
    shader::{Shader, ShaderDefVal},
};

use super::types::{self, GpuCarry, GpuHints, GpuStage};
use crate::{
    gpu::compute::ComputePass,
    scene::{
        bind_group::scene_layout,
        light_maps::{rsm_layout, shader_defs as rsm_shader_defs},
        probes::{cache_entries, shader_defs as probe_shader_defs},
    },
    technique::Pipelines,
};

/// Pipelines of radiance hints, and the layouts of what they alone bind.
#[derive(Resource)]
pub struct HintsPipelines {
    pub(super) lights_layout: BindGroupLayoutDescriptor,
    pub(super) surfaces_layout: BindGroupLayoutDescriptor,
    pub(super) gather_layout: BindGroupLayoutDescriptor,
    pub(super) sum_layout: BindGroupLayoutDescriptor,
    pub(super) exchange_layout: BindGroupLayoutDescriptor,
    pub(super) carry_layout: BindGroupLayoutDescriptor,
    pub(super) albedo_layout: BindGroupLayoutDescriptor,
    pub(super) carry: ComputePass,
    pub(super) albedo: ComputePass,
    pub(super) lights: ComputePass,
    pub(super) surfaces: ComputePass,
    pub(super) bounce: ComputePass,
    pub(super) sum: ComputePass,
    pub(super) exchange: ComputePass,
}

/// Constants of the shaders, and of what they import.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    let mut defs = probe_shader_defs();
    // With those of lights.
    defs.extend(rsm_shader_defs());
    defs.extend(types::shader_defs());
    defs
}

/// Group 2 of whatever looks the hints up; `bindings.wgsl` is its twin.
pub(crate) fn cache_layout() -> BindGroupLayoutDescriptor {
    let [probes, offsets, moments, sampler] = cache_entries();
    BindGroupLayoutDescriptor::new(
        "gi/hints/cache",
        &BindGroupLayoutEntries::sequential(
            // Debug views look them up, too.
            ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
            (
                probes,
                offsets,
                moments,
                sampler,
                uniform_buffer::<GpuHints>(false),
                texture_3d(TextureSampleType::Float { filterable: true }),
            ),
        ),
    )
}

impl Pipelines for HintsPipelines {
    fn new(server: &AssetServer, cache: &PipelineCache) -> Self {
        let read = || storage_buffer_read_only_sized(false, None);
        let write = || storage_buffer_sized(false, None);
        let compute = ShaderStages::COMPUTE;
        let cache_layout = cache_layout();
        let lights_layout = BindGroupLayoutDescriptor::new(
            "gi/hints/lights",
            &BindGroupLayoutEntries::with_indices(
                compute,
                (
                    (0, read()),
                    (1, read()),
                    (4, write()),
                    (
                        6,
                        texture_2d(TextureSampleType::Float { filterable: false }),
                    ),
                    (7, uniform_buffer_sized(false, None)),
                ),
            ),
        );
        let surfaces_layout = BindGroupLayoutDescriptor::new(
            "gi/hints/surfaces",
            &BindGroupLayoutEntries::sequential(
                compute,
                (
                    uniform_buffer::<GpuStage>(false),
                    read(),
                    write(),
                    read(),
                    read(),
                    read(),
                ),
            ),
        );
        let gather_layout = BindGroupLayoutDescriptor::new(
            "gi/hints/bounce",
            &BindGroupLayoutEntries::sequential(
                compute,
                (
                    uniform_buffer::<GpuStage>(false),
                    read(),
                    read(),
                    read(),
                    write(),
                ),
            ),
        );
        let target =
            texture_storage_3d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
        let sum_layout = BindGroupLayoutDescriptor::new(
            "gi/hints/sum",
            &BindGroupLayoutEntries::with_indices(
                compute,
                (
                    (0, uniform_buffer::<GpuStage>(false)),
                    (1, target),
                    (4, write()),
                    (6, read()),
                ),
            ),
        );
        let exchange_layout = BindGroupLayoutDescriptor::new(
            "gi/hints/exchange",
            &BindGroupLayoutEntries::with_indices(
                compute,
                ((0, uniform_buffer::<GpuStage>(false)), (4, write())),
            ),
        );
        let carry_layout = BindGroupLayoutDescriptor::new(
            "gi/hints/carry",
            &BindGroupLayoutEntries::with_indices(
                compute,
                (
                    (0, uniform_buffer::<GpuCarry>(false)),
                    (1, read()),
                    (4, write()),
                ),
            ),
        );
        let albedo_layout = BindGroupLayoutDescriptor::new(
            "gi/hints/albedo",
            &BindGroupLayoutEntries::with_indices(
                compute,
                ((1, read()), (3, read()), (6, write())),
            ),
        );
        let rsm = rsm_layout();
        let bounce_shader: Handle<Shader> = load_embedded_asset!(server, "bounce.wgsl");
        let pass = |name,
                    layouts: &[&BindGroupLayoutDescriptor],
                    shader: Handle<Shader>,
                    entry,
                    def: Option<&str>| {
            let mut defs = shader_defs();
            defs.extend(def.map(ShaderDefVal::from));
            ComputePass::new(cache, name, layouts, shader, entry, defs)
        };
        Self {
            carry: pass(
                "gi/hints/carry",
                &[&carry_layout],
                load_embedded_asset!(server, "carry.wgsl"),
                "carry",
                None,
            ),
            lights: pass(
                "gi/hints/lights",
                &[&lights_layout, &scene_layout(), &cache_layout, &rsm],
                load_embedded_asset!(server, "lights.wgsl"),
                "gather_lights",
                None,
            ),
            surfaces: pass(
                "gi/hints/surfaces",
                &[&surfaces_layout, &scene_layout(), &cache_layout],
                bounce_shader.clone(),
                "light_surfaces",
                Some("SURFACES"),
            ),
            bounce: pass(
                "gi/hints/bounce",
                &[&gather_layout, &scene_layout(), &cache_layout],
                bounce_shader,
                "gather_surfaces",
                None,
            ),
            sum: pass(
                "gi/hints/sum",
                &[&sum_layout],
                load_embedded_asset!(server, "sum.wgsl"),
                "sum_slots",
                None,
            ),
            exchange: pass(
                "gi/hints/exchange",
                &[&exchange_layout, &scene_layout(), &cache_layout],
                load_embedded_asset!(server, "exchange.wgsl"),
                "gather_hints_around",
                None,
            ),
            albedo: pass(
                "gi/hints/albedo",
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
            gather_layout,
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
