//! The virtual point lights of the reflective shadow maps, as spheres.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    math::UVec3,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup,
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    GiDebugSettings,
    fill::FillPass,
    shapes::{DebugShapes, GpuShape},
};
use crate::{
    gpu::{
        caps::supported,
        compute::{ComputePass, block},
        layout::{GroupLayout, storage_write, uniform},
    },
    scene::{
        light_maps::{self, SceneLightMaps, rsm_layout},
        needs::{NeedsKnown, SceneNeeds},
    },
    schedule::GiPrepare,
};

const NAME: &str = "gi/debug/show_vpls";

/// Uniform of `vpls.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuShowVpls {
    count: u32,
}

#[derive(Resource)]
struct VplsPass {
    pass: ComputePass,
    layout: GroupLayout,
    /// Groups 1 and 2 of the pass.
    empty: BindGroup,
}

/// The entity that has the spheres.
#[derive(Component)]
struct VplShapes;

pub(super) struct VplsViewPlugin;

impl Plugin for VplsViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "vpls.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_pass.run_if(supported))
            .add_systems(
                ExtractSchedule,
                extract_needs.in_set(NeedsKnown).run_if(supported),
            )
            .add_systems(Render, prepare.in_set(GiPrepare::Composite));
    }
}

/// Has them computed, whatever the technique needs.
fn extract_needs(debug: Extract<Res<GiDebugSettings>>, mut needs: ResMut<SceneNeeds>) {
    needs.rsm |= debug.show_vpls;
}

fn init_pass(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
) {
    let own = GroupLayout::new(NAME, ShaderStages::COMPUTE)
        .with("shown", uniform::<GpuShowVpls>())
        .with("shapes", storage_write::<Vec<GpuShape>>());
    let none = GroupLayout::new("gi/debug/none", ShaderStages::COMPUTE);
    commands.insert_resource(VplsPass {
        pass: ComputePass::new(
            &cache,
            NAME,
            block::LINE,
            &[&own, &none, &none, &rsm_layout()],
            load_embedded_asset!(server.as_ref(), "vpls.wgsl"),
            "show_vpls",
            light_maps::shader_defs(),
        ),
        empty: none.bind(&device, &cache).build(),
        layout: own,
    });
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn prepare(
    mut commands: Commands,
    shown: Query<(Entity, &DebugShapes), With<VplShapes>>,
    debug: Res<GiDebugSettings>,
    maps: Res<SceneLightMaps>,
    pass: Option<Res<VplsPass>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let before = shown.iter().next();
    let (Some(pass), Some(lookup), true) = (pass, &maps.rsm_bind_group, debug.show_vpls) else {
        if let Some((entity, _)) = before {
            commands.entity(entity).despawn();
        }
        return;
    };
    let count = maps.vpl_count();
    let mut uniform = UniformBuffer::from(GpuShowVpls { count });
    uniform.write_buffer(&device, &queue);
    let shapes = DebugShapes::new(count, before.map(|b| b.1), &device, |shapes| {
        let own = pass
            .layout
            .bind(&device, &cache)
            .with("shown", &uniform)
            .with("shapes", shapes.as_entire_binding())
            .build();
        vec![FillPass {
            pass: pass.pass,
            threads: UVec3::new(count, 1, 1),
            bind_groups: vec![own, pass.empty.clone(), pass.empty.clone(), lookup.clone()],
        }]
    });
    match before {
        Some((entity, _)) => commands.entity(entity).insert(shapes),
        None => &mut commands.spawn((VplShapes, shapes)),
    };
}
