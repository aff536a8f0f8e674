//! The view of all shadow maps.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    core_pipeline::{FullscreenShader, schedule::Core3d},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    render::{
        RenderApp, RenderStartup,
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::{ExtractedView, ViewTarget, ViewUniformOffset},
    },
};

use super::{GiDebugSettings, Painter};
use crate::{
    gpu::fullscreen::FullscreenPass,
    scene::{
        bind_group::{SceneBindGroup, SceneLayout, init_scene_layout},
        shadows::SceneShadows,
    },
    schedule::GiSystems,
    surface::{SurfaceLayout, ViewSurface, init_surface_layout},
};

const NAME: &str = "gi/debug/shadow_maps";

/// Uniform of `shadow_maps.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuTiles {
    count: u32,
    size: u32,
}

#[derive(Resource)]
struct ShadowMapsPass {
    pass: FullscreenPass,
    tiles: BindGroupLayoutDescriptor,
    pipelines: SpecializedRenderPipelines<FullscreenPass>,
}

pub(super) struct ShadowMapsViewPlugin;

impl Plugin for ShadowMapsViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "shadow_maps.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(
                RenderStartup,
                init_pass
                    .after(init_surface_layout)
                    .after(init_scene_layout),
            )
            .add_systems(
                Core3d,
                draw.in_set(GiSystems::ShowDebug)
                    .run_if(|debug: Res<GiDebugSettings>| {
                        debug.view.painter() == Painter::ShadowMaps
                    }),
            );
    }
}

fn init_pass(
    mut commands: Commands,
    server: Res<AssetServer>,
    fullscreen: Res<FullscreenShader>,
    surface: Res<SurfaceLayout>,
    scene: Res<SceneLayout>,
) {
    let tiles = BindGroupLayoutDescriptor::new(
        NAME,
        &BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, uniform_buffer::<GpuTiles>(false)),
    );
    commands.insert_resource(ShadowMapsPass {
        pass: FullscreenPass {
            layout: vec![surface.0.clone(), scene.layout.clone(), tiles.clone()],
            fullscreen: fullscreen.clone(),
            shader: load_embedded_asset!(server.as_ref(), "shadow_maps.wgsl"),
            shader_defs: Vec::new(),
            depth: None,
        },
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

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn draw(
    view: ViewQuery<View>,
    scenes: Query<&SceneBindGroup>,
    shadows: Res<SceneShadows>,
    pass: Option<ResMut<ShadowMapsPass>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut ctx: RenderContext,
) {
    let (extracted, target, camera, surface, offset) = view.into_inner();
    let (Some(mut pass), Some(scene)) = (pass, scenes.iter().next()) else {
        return;
    };
    let ShadowMapsPass {
        pass,
        tiles,
        pipelines,
    } = &mut *pass;
    let pipeline = pipelines.specialize(&cache, pass, (NAME, extracted.target_format));
    let Some(pipeline) = cache.get_render_pipeline(pipeline) else {
        return;
    };
    let mut uniform = UniformBuffer::from(GpuTiles {
        count: shadows.count(),
        size: shadows.size(),
    });
    uniform.write_buffer(&device, &queue);
    let group = device.create_bind_group(
        NAME,
        &cache.get_bind_group_layout(tiles),
        &BindGroupEntries::single(&uniform),
    );
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some(NAME),
        color_attachments: &[Some(target.get_color_attachment())],
        ..Default::default()
    });
    let span = diagnostics.pass_span(&mut pass, NAME);
    if let Some(viewport) = &camera.viewport {
        pass.set_camera_viewport(viewport);
    }
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, &surface.bind_group, &[offset.offset]);
    pass.set_bind_group(1, &scene.0, &[]);
    pass.set_bind_group(2, &group, &[]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
