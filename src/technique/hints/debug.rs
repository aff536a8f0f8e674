//! Debug views: the hints as spheres, the taps over a picked surface, and the samples of a picked hint.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    math::{UVec3, Vec4},
    render::{
        Render, RenderApp, RenderStartup,
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    cache::HintsCache,
    pipelines::{SLOTS, cache_layout, shader_defs},
    settings::RadianceHints,
    types::{GpuHintsView, GpuPicked, slots_of},
    view::RadianceHintsDebugSettings,
};
use crate::{
    debug::{
        GiDebugSettings,
        fill::FillPass,
        light_maps::{DebugMarks, GpuMark},
        shapes::{DebugShapes, GpuShape},
    },
    gpu::{
        compute::{ComputePass, block},
        layout::{GroupLayout, storage_read, storage_write, uniform},
    },
    scene::{
        bind_group::{SceneBindGroup, scene_layout},
        light_maps::{SceneLightMaps, rsm_layout},
        probes::SceneProbes,
        voxels::SceneVoxels,
    },
    schedule::GiPrepare,
    technique::{Cache, possible},
};

const NAME: &str = "gi/hints/show_hints";
/// Seven taps at most, the surface and the hint.
const TAPS: u32 = 9;
/// Disks and samples of a hint that are marked at most.
const MARKS: u32 = 512;

#[derive(Resource)]
struct HintsViewPasses {
    pick: ComputePass,
    hints: ComputePass,
    taps: ComputePass,
    marks: ComputePass,
    pick_layout: GroupLayout,
    shapes_layout: GroupLayout,
    marks_layout: GroupLayout,
}

/// What of a volume is shown.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Shown {
    Hints,
    Taps,
    Samples,
}

impl Shown {
    const ALL: [Self; 3] = [Self::Hints, Self::Taps, Self::Samples];

    fn is_wanted(self, debug: &GiDebugSettings, own: &RadianceHintsDebugSettings) -> bool {
        match self {
            Self::Hints => own.show,
            Self::Taps | Self::Samples => debug.show_picked,
        }
    }
}

/// The entity that has it, and of which volume it is.
#[derive(Component)]
struct ShownOf(Entity, Shown);

pub(super) struct HintsViewPlugin;

impl Plugin for HintsViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "debug.wgsl");
        embedded_asset!(app, "marks.wgsl");
        embedded_asset!(app, "pick.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_view.run_if(possible::<RadianceHints>))
            .add_systems(Render, show_hints.in_set(GiPrepare::Composite));
    }
}

fn init_view(mut commands: Commands, server: Res<AssetServer>, cache: Res<PipelineCache>) {
    let compute = ShaderStages::COMPUTE;
    let pick_layout = GroupLayout::new("gi/hints/pick", compute)
        .with("brick_map", storage_read::<Vec<u32>>())
        .with("occupancy", storage_read::<Vec<u32>>())
        .with("pool", storage_read::<Vec<u32>>())
        .with("picked", storage_write::<GpuPicked>())
        .with("shown", uniform::<GpuHintsView>());
    let shapes_layout = GroupLayout::new(NAME, compute)
        .with("shapes", storage_write::<Vec<GpuShape>>())
        .with("shown", uniform::<GpuHintsView>())
        .with("picked", storage_read::<GpuPicked>())
        .with_at(SLOTS, "slots", storage_write::<Vec<Vec4>>());
    let marks_layout = GroupLayout::new("gi/hints/mark_samples", compute)
        .with("marks", storage_write::<Vec<GpuMark>>())
        .with("shown", uniform::<GpuHintsView>())
        .with("picked", storage_read::<GpuPicked>());
    let (scene, cache_layout) = (scene_layout(), cache_layout());
    let pass = |name, block, layout: &GroupLayout, more: &[&_], shader, entry| {
        let layouts = [&[layout, &scene, &cache_layout], more].concat();
        ComputePass::new(&cache, name, block, &layouts, shader, entry, shader_defs())
    };
    let shapes = load_embedded_asset!(server.as_ref(), "debug.wgsl");
    commands.insert_resource(HintsViewPasses {
        pick: pass(
            "gi/hints/pick",
            block::ONE,
            &pick_layout,
            &[],
            load_embedded_asset!(server.as_ref(), "pick.wgsl"),
            "pick",
        ),
        hints: pass(
            NAME,
            block::LINE,
            &shapes_layout,
            &[],
            shapes.clone(),
            "show_hints",
        ),
        taps: pass(
            "gi/hints/show_taps",
            block::LINE,
            &shapes_layout,
            &[],
            shapes,
            "show_taps",
        ),
        marks: pass(
            "gi/hints/mark_samples",
            block::LINE,
            &marks_layout,
            &[&rsm_layout()],
            load_embedded_asset!(server.as_ref(), "marks.wgsl"),
            "mark_samples",
        ),
        pick_layout,
        shapes_layout,
        marks_layout,
    });
}

type VolumeData<'a> = (
    Entity,
    &'a SceneVoxels,
    &'a SceneProbes,
    &'a SceneBindGroup,
    &'a HintsCache,
);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn show_hints(
    mut commands: Commands,
    volumes: Query<VolumeData>,
    shown: Query<(Entity, &ShownOf, Option<&DebugShapes>)>,
    (debug, own): (Res<GiDebugSettings>, Res<RadianceHintsDebugSettings>),
    maps: Res<SceneLightMaps>,
    view: Option<Res<HintsViewPasses>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let Some(view) = view else { return };
    for (entity, ShownOf(volume, what), _) in &shown {
        if !what.is_wanted(&debug, &own) || !volumes.contains(*volume) {
            commands.entity(entity).despawn();
        }
    }
    if !Shown::ALL.iter().any(|what| what.is_wanted(&debug, &own)) {
        return;
    }
    for (volume, voxels, probes, scene, hints) in &volumes {
        let Some(lookup) = hints.bind_group() else {
            continue;
        };
        let slots = slots_of(own.view, hints.slots());
        let mut uniform = UniformBuffer::from(GpuHintsView {
            pick_from: debug.pick_from,
            content: own.view as u32,
            pick_to: debug.pick_to,
            slots: hints.slots(),
            slice: debug.slice as u32,
            slice_at: debug.slice_at,
            marks: MARKS,
            taps: TAPS,
            mask: slots.unwrap_or(0),
            is_light: slots.is_some().into(),
        });
        uniform.write_buffer(&device, &queue);
        let picked = device.create_buffer(&BufferDescriptor {
            label: Some("gi/hints/picked"),
            size: GpuPicked::min_size().get(),
            usage: BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let pick = || FillPass {
            pass: view.pick,
            threads: UVec3::ONE,
            bind_groups: vec![
                view.pick_layout
                    .bind(&device, &cache)
                    .with("brick_map", voxels.brick_map().as_entire_binding())
                    .with("occupancy", voxels.occupancy.as_entire_binding())
                    .with("pool", voxels.pool().as_entire_binding())
                    .with("picked", picked.as_entire_binding())
                    .with("shown", &uniform)
                    .build(),
                scene.0.clone(),
                lookup.clone(),
            ],
        };
        let fill = |pass: ComputePass, own: BindGroup, count: u32| FillPass {
            pass,
            threads: UVec3::new(count, 1, 1),
            bind_groups: vec![own, scene.0.clone(), lookup.clone()],
        };
        let shapes = |pass: ComputePass, count: u32, before: Option<&DebugShapes>| {
            DebugShapes::new(count, before, &device, |shapes| {
                let own = view
                    .shapes_layout
                    .bind(&device, &cache)
                    .with("shapes", shapes.as_entire_binding())
                    .with("shown", &uniform)
                    .with("picked", picked.as_entire_binding())
                    .with("slots", hints.slot_light.as_entire_binding())
                    .build();
                vec![pick(), fill(pass, own, count)]
            })
        };
        for what in Shown::ALL {
            if !what.is_wanted(&debug, &own) {
                continue;
            }
            let before = shown
                .iter()
                .find(|(_, of, _)| (of.0, of.1) == (volume, what));
            let shapes_before = before.and_then(|before| before.2);
            let mut entity = match before {
                Some((entity, ..)) => commands.entity(entity),
                None => commands.spawn(ShownOf(volume, what)),
            };
            match (what, &maps.rsm_bind_group) {
                (Shown::Hints, _) => {
                    entity.insert(shapes(view.hints, probes.lattice.count(), shapes_before));
                }
                (Shown::Taps, _) => {
                    entity.insert(shapes(view.taps, TAPS, shapes_before));
                }
                (Shown::Samples, Some(rsm)) => {
                    entity.insert(DebugMarks::new(MARKS, &device, |marks| {
                        let own = view
                            .marks_layout
                            .bind(&device, &cache)
                            .with("marks", marks.as_entire_binding())
                            .with("shown", &uniform)
                            .with("picked", picked.as_entire_binding())
                            .build();
                        let mut mark = fill(view.marks, own, MARKS);
                        mark.bind_groups.push(rsm.clone());
                        vec![pick(), mark]
                    }));
                }
                (Shown::Samples, None) => {
                    entity.remove::<DebugMarks>();
                }
            }
        }
    }
}
