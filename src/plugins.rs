//! [`GiPlugins`]: the only file that names every plugin.

use bevy::app::{App, Plugin, PluginGroup, PluginGroupBuilder};

use crate::{
    apply::{ApplyPlugin, export::TechniqueExportPlugin, gather::GatherPlugin},
    camera::GiCameraPlugin,
    debug::DebugPlugin,
    forward_views::ForwardViewsPlugin,
    gpu::{GpuPlugin, caps},
    overlay::OverlayPlugin,
    scene::ScenePlugin,
    schedule::SchedulePlugin,
    settings::SettingsPlugin,
    surface::SurfacePlugin,
    technique::{
        Technique,
        hints::{RadianceHints, RadianceHintsPlugin},
        vct::{VoxelConeTracing, VoxelConeTracingPlugin},
    },
};

/// Everything. Add it after `DefaultPlugins`.
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
            // Techniques: a new one is a folder, and its lines here.
            .add(VoxelConeTracingPlugin)
            .add(GatherPlugin::<VoxelConeTracing>::default())
            .add(TechniqueExportPlugin::<VoxelConeTracing>::default())
            .add(RadianceHintsPlugin)
            .add(GatherPlugin::<RadianceHints>::default())
            .add(TechniqueExportPlugin::<RadianceHints>::default())
            .add(SupportPlugin)
    }
}

/// Asks the device, once it is there.
struct SupportPlugin;

impl Plugin for SupportPlugin {
    fn build(&self, _: &mut App) {}

    fn finish(&self, app: &mut App) {
        let needs = [
            (
                VoxelConeTracing::TECHNIQUE.title(),
                VoxelConeTracing::DEVICE,
            ),
            (RadianceHints::TECHNIQUE.title(), RadianceHints::DEVICE),
        ];
        caps::detect(app, &needs);
    }
}
