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
};

use super::{
    cache::VctCache,
    pipelines::{cache_layout, shader_defs},
    settings::VoxelConeTracing,
};
use crate::{
    debug::{
        GiDebugSettings, Painter,
        voxels::{GpuVoxelView, VoxelView, voxel_view_pass, voxel_view_uniform},
    },
    gpu::{
        fullscreen::FullscreenPass,
        layout::{GroupLayout, uniform},
    },
    scene::bind_group::SceneBindGroup,
    schedule::GiPrepare,
    technique::{Cache, possible},
};

const NAME: &str = "gi/vct/show_cells";

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
                    .run_if(|debug: Res<GiDebugSettings>| {
                        debug.view.painter() == Painter::Technique
                    }),
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
    let uniform = voxel_view_uniform(&debug, &device, &queue);
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
