//! The radiance cache, as cubes.

use std::sync::Arc;

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    core_pipeline::FullscreenShader,
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    render::{
        Render, RenderApp, RenderStartup,
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
    shader::ShaderDefVal,
};

use super::{
    cache::VctCache,
    pipelines::{self, cache_layout},
    settings::VoxelConeTracing,
};
use crate::{
    debug::{
        GiDebugSettings, GiView, ShownView,
        voxels::{GpuVoxelView, VoxelView, voxel_view_pass, voxel_view_uniform},
    },
    gpu::{
        fullscreen::FullscreenPass,
        layout::{GroupLayout, uniform},
    },
    scene::bind_group::SceneBindGroup,
    schedule::GiPrepare,
    technique::{Cache, TechniqueView, possible},
};

const NAME: &str = "gi/vct/show_cells";

impl VoxelConeTracing {
    /// Radiance of cells of voxels towards the viewer.
    pub const RADIANCE: GiView = GiView::new("voxel-radiance");
    /// Opacity of cells of voxels along the view direction, unexposed.
    pub const OPACITY: GiView = GiView::new("voxel-opacity");
}

/// In the shader, a view is its place in this list.
pub(super) const VIEWS: [TechniqueView; 2] = [
    TechniqueView::cells(
        VoxelConeTracing::RADIANCE,
        "light that cells of voxels send to the viewer, exposed",
        true,
    ),
    TechniqueView::cells(
        VoxelConeTracing::OPACITY,
        "opacity of cells along the view: black 0, white 1",
        false,
    ),
];

fn shader_defs() -> Vec<ShaderDefVal> {
    let numbers = ["SHOW_RADIANCE", "SHOW_OPACITY"].into_iter().zip(0..);
    let numbers = numbers.map(|(name, number)| ShaderDefVal::UInt(name.into(), number));
    pipelines::shader_defs()
        .into_iter()
        .chain(numbers)
        .collect()
}

#[derive(Resource)]
struct CellsView {
    shader: Arc<FullscreenPass>,
    /// Group 3.
    layout: GroupLayout,
}

pub(super) struct CellsViewPlugin;

impl Plugin for CellsViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "debug.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(
                RenderStartup,
                init_view.run_if(possible::<VoxelConeTracing>),
            )
            .add_systems(
                Render,
                show_cells
                    .in_set(GiPrepare::Composite)
                    .run_if(|shown: ShownView| VIEWS.iter().any(|own| own.view == shown.view())),
            );
    }
}

fn init_view(mut commands: Commands, server: Res<AssetServer>, fullscreen: Res<FullscreenShader>) {
    let layout =
        GroupLayout::new(NAME, ShaderStages::FRAGMENT).with("shown", uniform::<GpuVoxelView>());
    let shader = load_embedded_asset!(server.as_ref(), "debug.wgsl");
    commands.insert_resource(CellsView {
        shader: voxel_view_pass(
            &fullscreen,
            &[cache_layout(), layout.clone()],
            shader,
            shader_defs(),
        ),
        layout,
    });
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn show_cells(
    mut commands: Commands,
    volumes: Query<(Entity, &VctCache, &SceneBindGroup)>,
    debug: Res<GiDebugSettings>,
    view: Option<Res<CellsView>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(view) = view else { return };
    let content = VIEWS.iter().position(|own| own.view == debug.view);
    let uniform = voxel_view_uniform(content.unwrap_or(0) as u32, &debug, &device, &queue);
    for (entity, cells, scene) in &volumes {
        let Some(lookup) = cells.bind_group() else {
            continue;
        };
        let own = view
            .layout
            .bind(&device, &cache)
            .with("shown", &uniform)
            .build();
        commands.entity(entity).insert(VoxelView {
            name: NAME,
            shader: view.shader.clone(),
            groups: vec![scene.0.clone(), lookup.clone(), own],
        });
    }
}
