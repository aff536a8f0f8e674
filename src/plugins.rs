//! The plugins of [`GiPlugins`], to disable or configure them one by one.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_gi::{
//!     plugins::{DebugPlugin, GiCameraPlugin},
//!     prelude::*,
//! };
//!
//! let plugins = GiPlugins
//!     .build()
//!     // Radiance hints alone, without debug views.
//!     .disable::<TechniquePlugin<VoxelConeTracing>>()
//!     .disable::<DebugPlugin>()
//!     // Only materials that say so are deferred.
//!     .set(GiCameraPlugin { deferred_by_default: false });
//! App::new().add_plugins((DefaultPlugins, plugins)).run();
//! ```

use bevy::app::{App, Plugin, PluginGroup, PluginGroupBuilder};

pub use crate::{
    apply::ApplyPlugin, camera::GiCameraPlugin, debug::DebugPlugin,
    forward_views::ForwardViewsPlugin, gpu::GpuPlugin, overlay::OverlayPlugin, scene::ScenePlugin,
    schedule::SchedulePlugin, settings::SettingsPlugin, surface::SurfacePlugin,
    technique_plugin::TechniquePlugin,
};
use crate::{
    gpu::caps,
    settings::{GiTechnique, GiTechniques},
    technique::{hints::RadianceHints, vct::VoxelConeTracing},
};

/// All plugins of this crate. Add them after `DefaultPlugins`.
///
/// | plugin | duty | an app may disable it |
/// |---|---|---|
/// | [`SchedulePlugin`] | the order of a frame | |
/// | [`SettingsPlugin`] | [`GiSettings`](crate::GiSettings), [`GiCaptureSettings`](crate::GiCaptureSettings), [`GiHistory`](crate::GiHistory) | |
/// | [`GiCameraPlugin`] | [`GiCamera`](crate::GiCamera), [`PrimaryGiCamera`](crate::PrimaryGiCamera) | |
/// | [`OverlayPlugin`] | cameras that draw over a GI camera | yes |
/// | [`ForwardViewsPlugin`] | cameras that are not deferred | yes |
/// | [`GpuPlugin`] | device support, statistics | |
/// | [`SurfacePlugin`] | what cameras see | |
/// | [`ScenePlugin`] | the capture of the scene | |
/// | [`ApplyPlugin`] | gather, accumulation, filter, composite | |
/// | [`DebugPlugin`] | debug views | yes |
/// | [`TechniquePlugin`] for [`VoxelConeTracing`] and [`RadianceHints`] | the techniques | yes, each of them |
/// | [`SupportPlugin`] | asks the device what it can run | |
///
/// The [module](crate::plugins) has an example. Plugins of an app's own, such as [`TechniquePlugin`] and
/// [`GiMaterialPlugin`](crate::GiMaterialPlugin), come after them.
pub struct GiPlugins;

impl PluginGroup for GiPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            // The frame.
            .add(SchedulePlugin)
            .add(SettingsPlugin)
            .add(GiCameraPlugin::default())
            .add(OverlayPlugin)
            .add(ForwardViewsPlugin)
            // From the scene to the picture.
            .add(GpuPlugin)
            .add(SurfacePlugin)
            .add(ScenePlugin)
            // Before what has views of its own.
            .add(DebugPlugin)
            .add(ApplyPlugin)
            // Techniques: a new one is a folder, and a line here.
            .add(TechniquePlugin::<VoxelConeTracing>::default())
            .add(TechniquePlugin::<RadianceHints>::default())
            .add(SupportPlugin)
    }
}

/// The techniques of this crate, named like variants of an enum. Those of an app are [`GiTechnique::of`] their types.
#[allow(
    non_upper_case_globals,
    reason = "they read like the variants of an enum"
)]
impl GiTechnique {
    /// No indirect light, as [`OFF`](Self::OFF).
    pub const Off: Self = Self::OFF;
    /// Voxel cone tracing, see [`technique::vct`](crate::technique::vct).
    pub const VoxelConeTracing: Self = Self::of::<VoxelConeTracing>();
    /// Radiance hints, see [`technique::hints`](crate::technique::hints). The default.
    pub const RadianceHints: Self = Self::of::<RadianceHints>();
}

/// Asks the device, once it is there, which techniques it can run: [`GiSupport`](crate::GiSupport).
#[derive(Default)]
pub struct SupportPlugin;

impl Plugin for SupportPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<GiTechniques>();
    }

    fn finish(&self, app: &mut App) {
        let techniques = app.world().resource::<GiTechniques>().clone();
        let needs: Vec<_> = techniques
            .on()
            .map(|entry| caps::TechniqueNeeds {
                name: entry.technique.name(),
                title: entry.title,
                needs: entry.device,
            })
            .collect();
        caps::detect(app, &needs);
    }
}
