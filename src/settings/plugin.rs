//! [`SettingsPlugin`]: what holds for every technique is a resource of both worlds.

use bevy::{
    app::{App, Plugin},
    render::extract_resource::ExtractResourcePlugin,
};

use super::{GiHistory, GiSettings, registry::SettingsResourcePlugin};

/// Registers [`GiSettings`] and [`GiHistory`].
pub(crate) struct SettingsPlugin;

impl Plugin for SettingsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<GiHistory>().add_plugins((
            SettingsResourcePlugin::<GiSettings>::default(),
            ExtractResourcePlugin::<GiHistory>::default(),
        ));
    }
}
