//! From a cache to the picture, the same way for every technique:
//! gather per pixel, accumulate over frames, filter, bring to full resolution, add to the HDR target;
//! and export to Bevy's irradiance volumes, for what is drawn forward.
//!
//! What crosses the border is [`ViewIndirect`](gather::ViewIndirect): `E / pi` and specular radiance
//! in nits, at the gather's resolution, not yet multiplied by any albedo.

mod ambient_cubes;
mod composite;
pub(crate) mod denoise;
pub(crate) mod export;
pub(crate) mod fog;
pub(crate) mod gather;
pub(crate) mod temporal;

use bevy::{
    app::{App, Plugin},
    render::RenderApp,
};

use crate::debug::{DebugPlugin, GiDebugSettings, GiViews};

/// From the light of a technique to the picture: gather, accumulation, filter and composite, and the export for
/// forward-rendered objects.
#[derive(Default)]
pub struct ApplyPlugin;

impl Plugin for ApplyPlugin {
    fn build(&self, app: &mut App) {
        // Of an app that leaves the debug views out, too.
        app.init_resource::<GiDebugSettings>()
            .init_resource::<GiViews>();
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app
                .init_resource::<GiDebugSettings>()
                .init_resource::<GiViews>();
        }
        app.add_plugins((
            gather::ViewIndirectPlugin,
            temporal::TemporalPlugin,
            denoise::DenoisePlugin,
            composite::CompositePlugin,
            export::ExportPlugin,
        ));
        if app.is_plugin_added::<DebugPlugin>() {
            app.add_plugins(ambient_cubes::AmbientCubesPlugin);
        }
    }
}
