//! The frame, as one list.
//!
//! Every pass of the crate is a system in one of these sets, and the sets are chained once, in
//! [`SchedulePlugin`]. To follow a frame, read this file and then the `node.rs` of the technique.

use bevy::{
    app::{App, Plugin},
    core_pipeline::{
        core_3d::main_opaque_pass_3d,
        schedule::{Core3d, Core3dSystems, camera_driver},
    },
    ecs::schedule::{IntoScheduleConfigs, SystemSet},
    pbr::deferred::deferred_lighting,
    render::{
        RenderApp,
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

/// Orders [`GiSystems`] among themselves and against Bevy's own passes.
pub(crate) struct SchedulePlugin;

impl Plugin for SchedulePlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
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
