//! The view of ambient occlusion: cones from what the camera sees through the opacity of the volumes.

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    color::LinearRgba,
    core_pipeline::{FullscreenShader, schedule::Core3d},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    render::{
        Extract, ExtractSchedule, RenderApp, RenderStartup,
        camera::ExtractedCamera,
        render_resource::*,
        renderer::{RenderContext, ViewQuery},
        view::{ExtractedView, ViewTarget, ViewUniformOffset},
    },
};

use super::{Painter, ShownView, paints};
use crate::{
    gpu::{
        caps::supported,
        fullscreen::{FullscreenPass, camera_pass},
    },
    scene::{
        bind_group::{SceneBindGroup, scene_layout},
        needs::{NeedsKnown, SceneNeeds},
        volume::ExtractedVolume,
    },
    schedule::GiSystems,
    surface::{ViewSurface, surface_layout},
};

const NAME: &str = "gi/debug/opacity";

#[derive(Resource)]
struct OpacityPass {
    pass: FullscreenPass,
    pipelines: SpecializedRenderPipelines<FullscreenPass>,
}

pub(super) struct OpacityViewPlugin;

impl Plugin for OpacityViewPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "opacity.wgsl");
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
                    .run_if(paints(Painter::Opacity)),
            );
    }
}

fn init_pass(mut commands: Commands, server: Res<AssetServer>, fullscreen: Res<FullscreenShader>) {
    commands.insert_resource(OpacityPass {
        pass: FullscreenPass {
            layouts: vec![surface_layout(), scene_layout()],
            fullscreen: fullscreen.clone(),
            shader: load_embedded_asset!(server.as_ref(), "opacity.wgsl"),
            shader_defs: Vec::new(),
            depth: None,
        },
        pipelines: Default::default(),
    });
}

/// Has the opacity built, whatever the technique needs.
fn extract_needs(shown: Extract<ShownView>, mut needs: ResMut<SceneNeeds>) {
    if shown.painter() == Painter::Opacity {
        needs.add(SceneNeeds {
            voxels: true,
            opacity: true,
            ..Default::default()
        });
    }
}

type View<'a> = (
    &'a ExtractedView,
    &'a ViewTarget,
    &'a ExtractedCamera,
    &'a ViewSurface,
    &'a ViewUniformOffset,
);

fn draw(
    view: ViewQuery<View>,
    volumes: Query<(&ExtractedVolume, &SceneBindGroup)>,
    pass: Option<ResMut<OpacityPass>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (extracted, target, camera, surface, offset) = view.into_inner();
    let Some(mut pass) = pass else { return };
    let OpacityPass { pass, pipelines } = &mut *pass;
    let pipeline = pipelines.specialize(&cache, pass, (NAME, extracted.target_format));
    let Some(pipeline) = cache.get_render_pipeline(pipeline) else {
        return;
    };
    // Finer volumes are drawn over coarser ones. Outside of all, nothing is known to block.
    let mut volumes: Vec<_> = volumes.iter().collect();
    volumes.sort_by_key(|(volume, _)| std::cmp::Reverse(volume.rank));
    let mut color = target.get_color_attachment();
    color.ops.load = LoadOp::Clear(LinearRgba::WHITE.into());
    camera_pass(&mut ctx, NAME, camera, color, None, |pass| {
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, &surface.bind_group, &[offset.offset]);
        for (_, scene) in &volumes {
            pass.set_bind_group(1, &scene.0, &[]);
            pass.draw(0..3, 0..1);
        }
    });
}
