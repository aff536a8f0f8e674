//! Drawing the scene from views that are no cameras: the voxelizer's three axes, and lights.
//!
//! Geometry goes through Bevy's own batching, skinning, morphing and material pipelines. A *capture
//! view* is a persistent entity of the render world with an [`ExtractedView`](bevy::render::view::ExtractedView)
//! and a list of meshes; a [`CaptureKind`] says with which pipeline meshes are drawn from it. Captures are rare:
//! views are extracted each frame, which costs little, but their GPU work runs only for the views in
//! [`CaptureQueue`].

mod kind;
mod list;
mod queue;

pub(crate) use kind::{
    CaptureKind, CapturePhase, CapturePhases, CapturePipeline, PrepassPipelines,
};
pub(crate) use list::{CaptureViews, WantedView, sync_views};

use std::marker::PhantomData;

use bevy::{
    app::{App, Plugin},
    ecs::{prelude::*, schedule::IntoScheduleConfigs, system::ReadOnlySystemParam},
    pbr::{MeshPipeline, PreprocessPipelines, early_gpu_preprocess},
    render::{
        Render, RenderApp, RenderSystems,
        render_phase::{AddRenderCommand, BinnedRenderPhasePlugin, DrawFunctions, RenderCommand},
        renderer::{CurrentView, RenderGraph},
    },
};

use crate::{gpu::caps::supported, schedule::GiSystems};

/// Adds a kind of capture view, drawn by the render command `C`.
pub(crate) struct CaptureKindPlugin<K, C>(PhantomData<(K, C)>);

impl<K, C> Default for CaptureKindPlugin<K, C> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<K, C> Plugin for CaptureKindPlugin<K, C>
where
    K: CaptureKind,
    C: RenderCommand<CapturePhase<K>, Param: ReadOnlySystemParam> + Send + Sync + 'static,
{
    fn build(&self, app: &mut App) {
        app.add_plugins(
            BinnedRenderPhasePlugin::<CapturePhase<K>, MeshPipeline>::new(Default::default()),
        );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<DrawFunctions<CapturePhase<K>>>()
            .init_resource::<CaptureViews<K>>()
            .init_resource::<queue::PendingCaptures<K>>()
            .add_render_command::<CapturePhase<K>, C>()
            .add_systems(
                Render,
                queue::queue_captures::<K>
                    .in_set(RenderSystems::QueueMeshes)
                    .run_if(supported),
            );
    }
}

/// Views whose meshes are drawn this frame. Filled while preparing.
#[derive(Resource, Default)]
pub(crate) struct CaptureQueue(pub Vec<Entity>);

pub(crate) struct ViewsPlugin;

impl Plugin for ViewsPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.init_resource::<CaptureQueue>().add_systems(
            RenderGraph,
            preprocess_captures.in_set(GiSystems::CaptureScene),
        );
    }
}

/// Lets Bevy compute the instance transforms of each queued view, as it does for its cameras.
pub(crate) fn preprocess_captures(world: &mut World) {
    let queue = std::mem::take(&mut world.resource_mut::<CaptureQueue>().0);
    if queue.is_empty() || !world.contains_resource::<PreprocessPipelines>() {
        return;
    }
    for view in queue {
        world.insert_resource(CurrentView(view));
        if let Err(error) = world.run_system_cached(early_gpu_preprocess) {
            bevy::log::error!("mesh preprocessing of a capture view failed: {error}");
        }
    }
    world.remove_resource::<CurrentView>();
}
