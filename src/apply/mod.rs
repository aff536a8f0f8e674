//! From a cache to the picture, the same way for every technique:
//! gather per pixel, accumulate over frames, filter, bring to full resolution, add to the HDR target;
//! and export to Bevy's irradiance volumes, for what is drawn forward.
//!
//! What crosses the border is [`ViewIndirect`](gather::ViewIndirect): `E / pi` and specular radiance
//! in nits, at the gather's resolution, not yet multiplied by any albedo.

pub(crate) mod composite;
pub(crate) mod denoise;
pub(crate) mod export;
pub(crate) mod fog;
pub(crate) mod gather;
mod probes;
pub(crate) mod temporal;

use bevy::app::{App, Plugin};

pub(crate) struct ApplyPlugin;

impl Plugin for ApplyPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins((
            gather::ViewIndirectPlugin,
            temporal::TemporalPlugin,
            denoise::DenoisePlugin,
            composite::CompositePlugin,
            export::ExportPlugin,
            probes::ProbesPlugin,
        ));
    }
}
