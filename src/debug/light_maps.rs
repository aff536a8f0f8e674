//! Views of what the lights see: all shadow maps, or layers of all reflective ones, side by side.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    core_pipeline::{FullscreenShader, schedule::Core3d},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    math::Vec2,
    render::{
        Extract, ExtractSchedule, RenderApp, RenderStartup,
        camera::ExtractedCamera,
        render_resource::*,
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::{ExtractedView, ViewTarget, ViewUniformOffset},
    },
};

use super::{GiDebugSettings, GiView, Painter, ShownView, fill::FillPass, paints};
use crate::{
    gpu::{
        caps::supported,
        fullscreen::{FullscreenPass, camera_pass},
        layout::{GroupLayout, storage_read, uniform},
    },
    scene::{
        bind_group::{SceneBindGroup, scene_layout},
        light_maps::{self, SceneLightMaps, rsm_layout},
        needs::{NeedsKnown, SceneNeeds},
    },
    schedule::GiSystems,
    surface::{ViewSurface, surface_layout},
};

const NAME: &str = "gi/debug/light_maps";

/// Uniform of `light_maps.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuTiles {
    count: u32,
    /// A [`GiView`].
    content: u32,
    /// Marks in reflective shadow maps.
    marks: u32,
}

/// A place in a reflective shadow map. Twin of `Mark` in `types.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(crate) struct GpuMark {
    /// 0..1 over the map.
    uv: Vec2,
    /// Of a circle around it, in the same unit; 0: a point; negative: nothing.
    radius: f32,
    map: u32,
}

/// Places in reflective shadow maps that their views show: on some entity of the render world, for whoever
/// reads the maps there.
#[derive(Component)]
pub(crate) struct DebugMarks {
    /// `array<GpuMark>`.
    marks: Buffer,
    count: u32,
    pub(super) fill: Vec<FillPass>,
}

impl DebugMarks {
    /// So many places. `fill` gets their buffer.
    pub fn new(
        count: u32,
        device: &RenderDevice,
        fill: impl FnOnce(&Buffer) -> Vec<FillPass>,
    ) -> Self {
        let marks = marks_buffer(count, device);
        Self {
            count,
            fill: fill(&marks),
            marks,
        }
    }
}

fn marks_buffer(count: u32, device: &RenderDevice) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some("gi/debug/marks"),
        size: u64::from(count.max(1)) * GpuMark::min_size().get(),
        usage: BufferUsages::STORAGE,
        mapped_at_creation: false,
    })
}

#[derive(Resource)]
struct LightMapsPass {
    shadows: FullscreenPass,
    rsm: FullscreenPass,
    tiles: GroupLayout,
    pipelines: SpecializedRenderPipelines<FullscreenPass>,
}

pub(super) struct LightMapsViewPlugin;

impl Plugin for LightMapsViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "light_maps.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_pass.run_if(supported))
            .add_systems(
                ExtractSchedule,
                extract_needs.in_set(NeedsKnown).run_if(supported),
            )
            .add_systems(
                Core3d,
                draw.in_set(GiSystems::ShowDebug)
                    .run_if(paints(Painter::LightMaps)),
            );
    }
}

fn init_pass(mut commands: Commands, server: Res<AssetServer>, fullscreen: Res<FullscreenShader>) {
    let tiles = GroupLayout::new(NAME, ShaderStages::FRAGMENT)
        .with("tiles", uniform::<GpuTiles>())
        .with("marks", storage_read::<Vec<GpuMark>>());
    let shadows = FullscreenPass {
        layouts: vec![surface_layout(), scene_layout(), tiles.clone()],
        fullscreen: fullscreen.clone(),
        shader: load_embedded_asset!(server.as_ref(), "light_maps.wgsl"),
        shader_defs: Vec::new(),
        depth: None,
    };
    let mut rsm = shadows.clone();
    rsm.layouts.push(rsm_layout());
    rsm.shader_defs = light_maps::shader_defs();
    rsm.shader_defs.extend(GiView::shader_defs());
    rsm.shader_defs.push("RSM".into());
    commands.insert_resource(LightMapsPass {
        shadows,
        rsm,
        tiles,
        pipelines: Default::default(),
    });
}

type View<'a> = (
    &'a ExtractedView,
    &'a ViewTarget,
    &'a ExtractedCamera,
    &'a ViewSurface,
    &'a ViewUniformOffset,
);

/// Has the lights captured as the view wants it, whatever the technique needs.
fn extract_needs(shown: Extract<ShownView>, mut needs: ResMut<SceneNeeds>) {
    if shown.painter() == Painter::LightMaps {
        needs.add(SceneNeeds {
            shadows: shown.view() == GiView::ShadowMaps,
            rsm: shown.view() != GiView::ShadowMaps,
            ..Default::default()
        });
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn draw(
    view: ViewQuery<View>,
    scenes: Query<&SceneBindGroup>,
    maps: Res<SceneLightMaps>,
    marks: Query<&DebugMarks>,
    debug: Res<GiDebugSettings>,
    pass: Option<ResMut<LightMapsPass>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut ctx: RenderContext,
) {
    let (extracted, target, camera, surface, offset) = view.into_inner();
    let (Some(mut pass), Some(scene)) = (pass, scenes.iter().next()) else {
        return;
    };
    let pass = &mut *pass;
    // Without any map, there is nothing to bind; the empty picture is that of shadow maps.
    let reflective = maps
        .rsm_bind_group
        .as_ref()
        .filter(|_| debug.view != GiView::ShadowMaps);
    let (shader, name, count) = match reflective {
        Some(_) => (&pass.rsm, "gi/debug/rsm", maps.count()),
        None if debug.view == GiView::ShadowMaps => (&pass.shadows, NAME, maps.count()),
        None => (&pass.shadows, NAME, 0),
    };
    let pipeline = pass
        .pipelines
        .specialize(&cache, shader, (name, extracted.target_format));
    let Some(pipeline) = cache.get_render_pipeline(pipeline) else {
        return;
    };
    let mut uniform = UniformBuffer::from(GpuTiles {
        count,
        content: debug.view.number(),
        marks: marks.iter().next().map_or(0, |marks| marks.count),
    });
    uniform.write_buffer(&device, &queue);
    let group = pass
        .tiles
        .bind(&device, &cache)
        .with("tiles", &uniform)
        .with(
            "marks",
            match marks.iter().next() {
                Some(marks) => marks.marks.clone(),
                None => marks_buffer(0, &device),
            }
            .as_entire_binding(),
        )
        .build();
    let color = target.get_color_attachment();
    camera_pass(&mut ctx, NAME, camera, color, None, |pass| {
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, &surface.bind_group, &[offset.offset]);
        pass.set_bind_group(1, &scene.0, &[]);
        pass.set_bind_group(2, &group, &[]);
        if let Some(rsm) = reflective {
            pass.set_bind_group(3, rsm, &[]);
        }
        pass.draw(0..3, 0..1);
    });
}
