//! The frame, as two lists.
//!
//! [`GiPrepare`] decides what a frame does, and makes memory and bind groups for it; [`GiSystems`] records its passes.
//! Every system of either kind is in one of these sets, and the sets are chained once, in [`SchedulePlugin`].
//!
//! What changes in the main world is seen in the same frame: it is extracted, prepared, captured, lit and
//! gathered in this order. Three things arrive a frame late, because the GPU knows them first: how many bricks the
//! voxels need, the depth that the primary camera saw, and a cache or a history that has just been made.

use bevy::{
    app::{App, Plugin},
    core_pipeline::{
        core_3d::main_opaque_pass_3d,
        schedule::{Core3d, Core3dSystems, camera_driver},
    },
    ecs::schedule::{IntoScheduleConfigs, SystemSet},
    pbr::deferred::deferred_lighting,
    render::{
        Render, RenderApp, RenderSystems,
        renderer::{RenderGraph, RenderGraphSystems},
    },
};

/// Steps of one frame of global illumination, in the order in which they run.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GiSystems {
    /// Once per frame, view independent: voxels, shadow maps and lights are brought up to date.
    /// Nothing is captured again while nothing changed.
    CaptureScene,
    /// Once per frame: each active technique turns the capture into its cache.
    UpdateCaches,
    /// Once per frame: the caches are looked up at the probes of Bevy's irradiance volumes, for what is
    /// drawn forward.
    Export,
    /// Per GI camera: the technique's cache is looked up for every gathered pixel.
    Gather,
    /// Per GI camera: temporal accumulation of the gathered light, and a spatial filter of it.
    Denoise,
    /// Per GI camera: the light is brought to full resolution and added to the HDR target.
    Composite,
    /// Per GI camera: the irradiance volumes are filled, now that the deferred pixels have their light.
    ShowExport,
    /// Per GI camera: they are emptied, once all that is drawn forward has its light too.
    HideExport,
    /// Once per frame: what debug views show at points of space is gathered.
    FillDebug,
    /// Per GI camera: debug views that do not belong to the composite.
    ShowDebug,
}

/// Steps of preparation in the render world, in the order in which they run.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GiPrepare {
    /// Memory of the capture, and which parts of it are drawn anew: lights, shadow maps, voxels. In
    /// [`RenderSystems::PrepareResources`](bevy::render::RenderSystems::PrepareResources), as the only one.
    Scene,
    /// Bind groups of the scene, and of what cameras see. This and the following steps are in
    /// [`RenderSystems::PrepareBindGroups`](bevy::render::RenderSystems::PrepareBindGroups).
    Bindings,
    /// Which probes of volumes trace rays.
    Probes,
    /// What each technique computes.
    Caches,
    /// For each GI camera: gather, history and filter; for each volume: export.
    Views,
    /// The composite of each GI camera, and debug views.
    Composite,
}

/// Orders [`GiPrepare`] and [`GiSystems`] among themselves and against Bevy's own passes.
pub(crate) struct SchedulePlugin;

impl Plugin for SchedulePlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .configure_sets(
                Render,
                GiPrepare::Scene.in_set(RenderSystems::PrepareResources),
            )
            .configure_sets(
                Render,
                (
                    GiPrepare::Bindings,
                    GiPrepare::Probes,
                    GiPrepare::Caches,
                    GiPrepare::Views,
                    GiPrepare::Composite,
                )
                    .chain()
                    .in_set(RenderSystems::PrepareBindGroups),
            )
            .configure_sets(
                RenderGraph,
                (
                    GiSystems::CaptureScene,
                    GiSystems::UpdateCaches,
                    GiSystems::Export,
                    GiSystems::FillDebug,
                )
                    .chain()
                    // After what starts the frame: Bevy's record of passes, for one.
                    .in_set(RenderGraphSystems::Render)
                    .before(camera_driver),
            )
            .configure_sets(
                Core3d,
                (
                    (GiSystems::Gather, GiSystems::Denoise)
                        .chain()
                        .after(Core3dSystems::Prepass)
                        .before(Core3dSystems::MainPass),
                    (GiSystems::Composite, GiSystems::ShowExport)
                        .chain()
                        .after(deferred_lighting)
                        .before(main_opaque_pass_3d)
                        .in_set(Core3dSystems::MainPass),
                    (GiSystems::HideExport, GiSystems::ShowDebug)
                        .chain()
                        .after(Core3dSystems::MainPass)
                        .before(Core3dSystems::EarlyPostProcess),
                ),
            );
    }
}
