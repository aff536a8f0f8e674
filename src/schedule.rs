//! The frame, as two lists.
//!
//! [`GiPrepare`] decides what a frame does, and makes memory and bind groups for it; [`GiSystems`] records its
//! passes. Every system of either kind is in one of these sets, and the sets are chained once, in
//! [`SchedulePlugin`].
//!
//! A change in the main world is visible in the same frame: it is extracted, prepared, captured, lit and
//! gathered in this order. Three things arrive a frame late, because the GPU knows them first: the number of
//! bricks that the voxels need, the depth that the primary camera saw, and a cache or a history that has just
//! been made.

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
    /// Once per frame, independent of views: voxels, shadow maps and lights are updated. Nothing is captured
    /// again while nothing has changed.
    CaptureScene,
    /// Once per frame: each technique in use updates its caches from the capture.
    UpdateCaches,
    /// Once per frame: the caches are looked up for the ambient cubes of Bevy's irradiance volumes, for
    /// forward-rendered objects.
    Export,
    /// Per GI camera: its technique updates what it stores for this camera.
    UpdateViewCaches,
    /// Per GI camera: the caches of its technique are looked up for every gathered pixel.
    Gather,
    /// Per GI camera: temporal accumulation of the gathered light, then a spatial filter.
    Denoise,
    /// Per GI camera: light is upsampled to full resolution and added to the HDR target.
    Composite,
    /// Per GI camera: the irradiance volumes are filled, once deferred pixels have their light.
    ShowExport,
    /// Per GI camera: the irradiance volumes are emptied, once forward-rendered objects have their light.
    HideExport,
    /// Once per frame: data of debug views at points in space are collected.
    FillDebug,
    /// Per GI camera: debug views that are not part of the composite are drawn.
    ShowDebug,
}

#[cfg(test)]
impl GiSystems {
    /// All of them.
    pub(crate) const ALL: [Self; 11] = [
        Self::CaptureScene,
        Self::UpdateCaches,
        Self::Export,
        Self::UpdateViewCaches,
        Self::Gather,
        Self::Denoise,
        Self::Composite,
        Self::ShowExport,
        Self::HideExport,
        Self::FillDebug,
        Self::ShowDebug,
    ];
}

/// Steps of preparation in the render world, in the order in which they run.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GiPrepare {
    /// Memory of the light maps, and which of them are rendered again. This and the following steps, up to
    /// [`Units`](Self::Units), are in
    /// [`RenderSystems::PrepareResources`](bevy::render::RenderSystems::PrepareResources).
    LightMaps,
    /// Memory of the voxels, and which volumes are voxelized again.
    Voxels,
    /// Lights, which name their shadow maps, and the sky.
    Lights,
    /// Units in which light is stored, from lights, sky and voxels.
    Units,
    /// Bind groups of the scene and of the surfaces that cameras see. This and the following steps are in
    /// [`RenderSystems::PrepareBindGroups`](bevy::render::RenderSystems::PrepareBindGroups).
    Bindings,
    /// Which probes of volumes trace rays.
    Probes,
    /// What each technique computes.
    Caches,
    /// Gather, history and filter of each GI camera; export of each volume.
    Views,
    /// Composite of each GI camera, and debug views.
    Composite,
}

#[cfg(test)]
impl GiPrepare {
    /// All of them.
    pub(crate) const ALL: [Self; 9] = [
        Self::LightMaps,
        Self::Voxels,
        Self::Lights,
        Self::Units,
        Self::Bindings,
        Self::Probes,
        Self::Caches,
        Self::Views,
        Self::Composite,
    ];
}

/// Orders [`GiPrepare`] and [`GiSystems`] among themselves and against Bevy's own passes.
#[derive(Default)]
pub struct SchedulePlugin;

impl Plugin for SchedulePlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .configure_sets(
                Render,
                (
                    GiPrepare::LightMaps,
                    GiPrepare::Voxels,
                    GiPrepare::Lights,
                    GiPrepare::Units,
                )
                    .chain()
                    .in_set(RenderSystems::PrepareResources),
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
                    (
                        GiSystems::UpdateViewCaches,
                        GiSystems::Gather,
                        GiSystems::Denoise,
                    )
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
