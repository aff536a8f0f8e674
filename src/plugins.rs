//! [`GiPlugins`]: the only file that names every plugin.

use bevy::app::{App, Plugin, PluginGroup, PluginGroupBuilder};

use crate::{
    apply::ApplyPlugin,
    camera::GiCameraPlugin,
    debug::DebugPlugin,
    forward_views::ForwardViewsPlugin,
    gpu::{GpuPlugin, caps},
    overlay::OverlayPlugin,
    scene::ScenePlugin,
    schedule::SchedulePlugin,
    settings::{GiTechnique, GiTechniques, SettingsPlugin},
    surface::SurfacePlugin,
    technique::{hints::RadianceHints, vct::VoxelConeTracing},
    technique_plugin::TechniquePlugin,
};

/// All plugins of this crate. Add them after `DefaultPlugins`.
///
/// | plugins | duty |
/// |---|---|
/// | schedule, settings, cameras, overlay cameras, forward views | the order of a frame, and what the app sets |
/// | GPU, surfaces, scene, apply, debug | device support, capture, gather, accumulation, composite, debug views |
/// | [`TechniquePlugin`] for [`VoxelConeTracing`] and [`RadianceHints`] | the techniques |
///
/// Plugins of an app's own, such as [`TechniquePlugin`] and [`GiMaterialPlugin`](crate::GiMaterialPlugin), come
/// after them.
pub struct GiPlugins;

impl PluginGroup for GiPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            // The frame.
            .add(SchedulePlugin)
            .add(SettingsPlugin)
            .add(GiCameraPlugin)
            .add(OverlayPlugin)
            .add(ForwardViewsPlugin)
            // From the scene to the picture.
            .add(GpuPlugin)
            .add(SurfacePlugin)
            .add(ScenePlugin)
            .add(ApplyPlugin)
            .add(DebugPlugin)
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

/// Asks the device, once it is there.
struct SupportPlugin;

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
