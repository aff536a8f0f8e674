//! Pipelines and passes of voxel cone tracing.

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
    prepare::VctCache,
    settings::ConeLayout,
    types::{DIRECTIONS, GpuCones, GpuMip, GpuVoxelPass},
};
use crate::{
    gpu::compute::{ComputePass, Groups, Recorder, groups},
    scene::{
        bind_group::{SceneBindGroup, SceneLayout},
        lights,
        voxels::{SceneVoxels, argument, shader_defs as voxel_shader_defs},
    },
};

/// Pipelines and layouts of voxel cone tracing.
#[derive(Resource)]
pub(crate) struct VctPipelines {
    pub cache_layout: BindGroupLayoutDescriptor,
    pub voxel_layout: BindGroupLayoutDescriptor,
    pub carry_layout: BindGroupLayoutDescriptor,
    pub clear_cells_layout: BindGroupLayoutDescriptor,
    pub filter_voxels_layout: BindGroupLayoutDescriptor,
    pub filter_cells_layout: BindGroupLayoutDescriptor,
    carry: ComputePass,
    bounce: ComputePass,
    light: ComputePass,
    clear_cells: ComputePass,
    filter_voxels: ComputePass,
    filter_cells: ComputePass,
}

impl VctPipelines {
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        [
            self.carry,
            self.bounce,
            self.light,
            self.clear_cells,
            self.filter_voxels,
            self.filter_cells,
        ]
        .iter()
        .all(|pass| pass.ready(cache))
    }
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

pub(crate) fn init_vct_pipelines(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
    scene: Res<SceneLayout>,
) {
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
    let light_shader: Handle<Shader> = load_embedded_asset!(server.as_ref(), "light.wgsl");
    let filter_shader: Handle<Shader> = load_embedded_asset!(server.as_ref(), "filter.wgsl");
    let pass = |name,
                layouts: &[&BindGroupLayoutDescriptor],
                shader: &Handle<Shader>,
                entry,
                def: &str| {
        let mut defs = shader_defs();
        defs.push(def.into());
        ComputePass::new(&cache, name, layouts, shader.clone(), entry, defs)
    };
    commands.insert_resource(VctPipelines {
        carry: pass(
            "gi/vct/carry",
            &[&carry_layout],
            &light_shader,
            "carry",
            "CARRY",
        ),
        bounce: pass(
            "gi/vct/bounce",
            &[&voxel_layout, &scene.layout, &cache_layout],
            &light_shader,
            "bounce",
            "BOUNCE",
        ),
        light: pass(
            "gi/vct/light",
            &[&voxel_layout, &scene.layout],
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
        cache_layout,
        voxel_layout,
        carry_layout,
        clear_cells_layout,
        filter_voxels_layout,
        filter_cells_layout,
    });
}

/// Brings the cache of every volume up to date; does nothing where nothing changed.
pub(crate) fn update_vct(
    volumes: Query<(&SceneVoxels, &VctCache, &SceneBindGroup)>,
    pipelines: Option<Res<VctPipelines>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else { return };
    let diagnostics = ctx.diagnostic_recorder();
    for (voxels, vct, scene) in &volumes {
        let (Some(job), Some(cache_group)) =
            (&vct.job, crate::technique::TechniqueCache::bind_group(vct))
        else {
            continue;
        };
        let mut record = Recorder {
            encoder: ctx.command_encoder(),
            cache: &cache,
            diagnostics: diagnostics.as_deref(),
        };
        let arguments = |word: u32| Groups::Indirect(&voxels.arguments, 4 * u64::from(word));

        if let Some(bounced) = &job.clear {
            record.encoder.clear_buffer(bounced, 0, None);
        }
        if let Some(carry) = &job.carry {
            record.run(&pipelines.carry, arguments(argument::VOXELS), &[carry]);
        }
        let bounce = job.bounce.iter().map(|(slice, group)| {
            let slice = arguments(argument::SLICE + 3 * slice);
            (slice, [group, &scene.0, cache_group])
        });
        record.run_all(&pipelines.bounce, None, bounce);
        record.run(
            &pipelines.light,
            arguments(argument::VOXELS),
            &[&job.light, &scene.0],
        );
        let block = UVec3::splat(4);
        if let Some(clear) = &job.clear_cells {
            record.run(
                &pipelines.clear_cells,
                groups(job.cells[0], block),
                &[clear],
            );
        }
        record.run(
            &pipelines.filter_voxels,
            arguments(argument::CELLS),
            &[&job.filter_voxels],
        );
        let levels = job.filter_cells.iter().zip(&job.cells[1..]);
        let levels = levels.map(|(group, cells)| (groups(*cells, block), [group]));
        record.run_all(&pipelines.filter_cells, None, levels);
    }
}
