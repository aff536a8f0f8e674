//! Pipelines and passes of radiance hints.

use bevy::{
    asset::{AssetServer, Handle, load_embedded_asset},
    ecs::prelude::*,
    math::UVec3,
    render::{
        render_resource::{binding_types::*, *},
        renderer::RenderContext,
    },
    shader::{Shader, ShaderDefVal},
};

use super::{
    prepare::{BounceFrom, HintsCache},
    types::{self, GpuCarry, GpuHints, GpuStage},
};
use crate::{
    gpu::compute::{ComputePass, Groups, Recorder, groups},
    scene::{
        bind_group::{SceneBindGroup, SceneLayout},
        probes::{SceneProbes, cache_entries, shader_defs as probe_shader_defs},
        rsm::{SceneRsm, rsm_layout, shader_defs as rsm_shader_defs},
        voxels::{SceneVoxels, argument},
    },
    technique::TechniqueCache,
};

/// Pipelines and layouts of radiance hints.
#[derive(Resource)]
pub(crate) struct HintsPipelines {
    pub cache_layout: BindGroupLayoutDescriptor,
    pub lights_layout: BindGroupLayoutDescriptor,
    pub surfaces_layout: BindGroupLayoutDescriptor,
    pub gather_layout: BindGroupLayoutDescriptor,
    pub sum_layout: BindGroupLayoutDescriptor,
    pub exchange_layout: BindGroupLayoutDescriptor,
    pub carry_layout: BindGroupLayoutDescriptor,
    pub albedo_layout: BindGroupLayoutDescriptor,
    carry: ComputePass,
    albedo: ComputePass,
    lights: ComputePass,
    surfaces: ComputePass,
    bounce: ComputePass,
    sum: ComputePass,
    exchange: ComputePass,
}

impl HintsPipelines {
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        [
            self.carry,
            self.albedo,
            self.lights,
            self.surfaces,
            self.bounce,
            self.sum,
            self.exchange,
        ]
        .iter()
        .all(|pass| pass.ready(cache))
    }
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

pub(crate) fn init_hints_pipelines(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
    scene: Res<SceneLayout>,
) {
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
    let target = texture_storage_3d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
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
        &BindGroupLayoutEntries::with_indices(compute, ((1, read()), (3, read()), (6, write()))),
    );
    let rsm = rsm_layout();
    let bounce_shader: Handle<Shader> = load_embedded_asset!(server.as_ref(), "bounce.wgsl");
    let pass = |name,
                layouts: &[&BindGroupLayoutDescriptor],
                shader: Handle<Shader>,
                entry,
                def: Option<&str>| {
        let mut defs = shader_defs();
        defs.extend(def.map(ShaderDefVal::from));
        ComputePass::new(&cache, name, layouts, shader, entry, defs)
    };
    commands.insert_resource(HintsPipelines {
        carry: pass(
            "gi/hints/carry",
            &[&carry_layout],
            load_embedded_asset!(server.as_ref(), "carry.wgsl"),
            "carry",
            None,
        ),
        lights: pass(
            "gi/hints/lights",
            &[&lights_layout, &scene.layout, &cache_layout, &rsm],
            load_embedded_asset!(server.as_ref(), "lights.wgsl"),
            "gather_lights",
            None,
        ),
        surfaces: pass(
            "gi/hints/surfaces",
            &[&surfaces_layout, &scene.layout, &cache_layout],
            bounce_shader.clone(),
            "light_surfaces",
            Some("SURFACES"),
        ),
        bounce: pass(
            "gi/hints/bounce",
            &[&gather_layout, &scene.layout, &cache_layout],
            bounce_shader,
            "gather_surfaces",
            None,
        ),
        sum: pass(
            "gi/hints/sum",
            &[&sum_layout],
            load_embedded_asset!(server.as_ref(), "sum.wgsl"),
            "sum_slots",
            None,
        ),
        exchange: pass(
            "gi/hints/exchange",
            &[&exchange_layout, &scene.layout, &cache_layout],
            load_embedded_asset!(server.as_ref(), "exchange.wgsl"),
            "gather_hints_around",
            None,
        ),
        albedo: pass(
            "gi/hints/albedo",
            &[&albedo_layout, &scene.layout, &cache_layout],
            load_embedded_asset!(server.as_ref(), "albedo.wgsl"),
            "average_albedo",
            None,
        ),
        albedo_layout,
        carry_layout,
        exchange_layout,
        cache_layout,
        lights_layout,
        surfaces_layout,
        gather_layout,
        sum_layout,
    });
}

/// Brings the hints of every volume up to date; does nothing where nothing changed.
pub(crate) fn update_hints(
    volumes: Query<(&SceneVoxels, &SceneProbes, &HintsCache, &SceneBindGroup)>,
    rsm: Res<SceneRsm>,
    pipelines: Option<Res<HintsPipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else { return };
    let diagnostics = ctx.diagnostic_recorder();
    for (voxels, probes, hints, scene) in &volumes {
        let (Some(job), Some(cache_group)) = (&hints.job, hints.bind_group()) else {
            continue;
        };
        let mut record = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics: diagnostics.as_deref(),
        };
        let scene = &scene.0;
        let per_hint = || {
            let threads = UVec3::new(probes.lattice.count(), 1, 1);
            groups(threads, UVec3::new(64, 1, 1))
        };
        let per_voxel = || Groups::Indirect(&voxels.arguments, 4 * u64::from(argument::VOXELS));
        let per_cell = || groups(probes.dims(), UVec3::splat(4));

        if !job.relights {
            record.run(&pipelines.sum, per_cell(), &[&job.sum]);
            continue;
        }
        if let Some(carry) = &job.carry {
            let (slots, before) = &carry.copy;
            let encoder = &mut record.encoder;
            encoder.copy_buffer_to_buffer(slots, 0, before, 0, slots.size());
            record.run(&pipelines.carry, per_hint(), &[&carry.group]);
        }
        if let Some(albedo) = &job.albedo {
            record.run(&pipelines.albedo, per_hint(), &[albedo, scene, cache_group]);
        }
        match (&job.lights, &rsm.bind_group) {
            (Some(lights), Some(rsm)) => {
                record.run(
                    &pipelines.lights,
                    per_hint(),
                    &[lights, scene, cache_group, rsm],
                );
            }
            _ => {
                let (slots, bytes) = &job.clear;
                record.encoder.clear_buffer(slots, 0, Some(*bytes));
            }
        }
        let sources = job.sources.iter();
        let sources = sources.map(|group| (per_hint(), [group, scene, cache_group]));
        if !job.sources.is_empty() {
            record.run_all(&pipelines.bounce, None, sources);
        }
        for bounce in &job.bounces {
            record.run(&pipelines.sum, per_cell(), &[&bounce.sum]);
            match &bounce.from {
                BounceFrom::Hints(exchange) => {
                    record.run(
                        &pipelines.exchange,
                        per_hint(),
                        &[exchange, scene, cache_group],
                    );
                }
                BounceFrom::Surfaces { light, gather } => {
                    record.run(
                        &pipelines.surfaces,
                        per_voxel(),
                        &[light, scene, cache_group],
                    );
                    record.run(&pipelines.bounce, per_hint(), &[gather, scene, cache_group]);
                }
            }
        }
        record.run(&pipelines.sum, per_cell(), &[&job.sum]);
    }
}
