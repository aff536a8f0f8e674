//! The ambient cubes of the export, as spheres.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    math::{UVec3, Vec3},
    render::{
        Render, RenderApp, RenderStartup,
        render_resource::{binding_types::*, *},
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::export::ExportCubes;
use crate::{
    debug::{
        GiDebugSettings,
        fill::FillPass,
        shapes::{DebugShapes, GpuShape},
    },
    gpu::{
        caps::supported,
        compute::{ComputePass, block},
        layout::{GroupLayout, loaded, storage_write, uniform},
    },
    scene::volume::{ExtractedVolume, with_volume},
    schedule::GiPrepare,
};

const NAME: &str = "gi/apply/show_ambient_cubes";

/// Uniform of `ambient_cubes.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuAmbientCubes {
    origin: Vec3,
    radius: f32,
    spacing: Vec3,
    /// Nits that are 1 in the ambient cubes.
    unit: f32,
    dims: UVec3,
}

#[derive(Resource)]
struct CubesPass {
    pass: ComputePass,
    layout: GroupLayout,
}

pub(crate) struct AmbientCubesPlugin;

impl Plugin for AmbientCubesPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "ambient_cubes.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_observer(with_volume::<DebugShapes>)
            .add_systems(RenderStartup, init_pass.run_if(supported))
            .add_systems(Render, prepare_cubes.in_set(GiPrepare::Composite));
    }
}

fn init_pass(mut commands: Commands, server: Res<AssetServer>, cache: Res<PipelineCache>) {
    let layout = GroupLayout::new(NAME, ShaderStages::COMPUTE)
        .with("grid", uniform::<GpuAmbientCubes>())
        .with("ambient_cubes", texture_3d(loaded()))
        .with("shapes", storage_write::<Vec<GpuShape>>());
    commands.insert_resource(CubesPass {
        pass: ComputePass::new(
            &cache,
            NAME,
            block::CUBE,
            &[&layout],
            load_embedded_asset!(server.as_ref(), "ambient_cubes.wgsl"),
            "show_ambient_cubes",
            vec![],
        ),
        layout,
    });
}

type VolumeData<'a> = (
    Entity,
    &'a ExtractedVolume,
    Option<&'a ExportCubes>,
    Option<&'a DebugShapes>,
);

fn prepare_cubes(
    mut commands: Commands,
    volumes: Query<VolumeData>,
    debug: Res<GiDebugSettings>,
    pass: Option<Res<CubesPass>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(pass) = pass else { return };
    for (entity, volume, cubes, shapes) in &volumes {
        let Some(cubes) = cubes.filter(|_| debug.show_ambient_cubes) else {
            if shapes.is_some() {
                commands.entity(entity).remove::<DebugShapes>();
            }
            continue;
        };
        let spacing = volume.grid.size() / cubes.dims.as_vec3();
        let mut uniform = UniformBuffer::from(GpuAmbientCubes {
            origin: volume.grid.origin,
            // Small enough to see what is between them.
            radius: 0.12 * spacing.min_element(),
            spacing,
            unit: cubes.unit,
            dims: cubes.dims,
        });
        uniform.write_buffer(&device, &queue);
        let count = cubes.dims.element_product();
        let shapes = DebugShapes::new(count, shapes, &device, |shapes| {
            let own = pass
                .layout
                .bind(&device, &cache)
                .with("grid", &uniform)
                .with("ambient_cubes", cubes.view())
                .with("shapes", shapes.as_entire_binding())
                .build();
            vec![FillPass {
                pass: pass.pass,
                threads: cubes.dims,
                bind_groups: vec![own],
            }]
        });
        commands.entity(entity).insert(shapes);
    }
}
