//! The inspector: one panel to tune everything with, and to see what it costs.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_gi::{
//!     inspector::{GiInspectorPlugin, bevy_egui::EguiPlugin},
//!     prelude::*,
//! };
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, GiPlugins))
//!     // The app brings Egui: two plugins of that kind would not get on.
//!     .add_plugins((EguiPlugin::default(), GiInspectorPlugin::default()))
//!     .run();
//! ```
//!
//! F1 opens it. What it lists comes from reflection: all fields of all resources in
//! [`crate::GiSettingsRegistry`], with their ranges, units and documentation.
//!
//! While it is closed, no system of it runs but the one that waits for its key.

mod cost;
mod fields;
mod files;
mod handles;
mod items;
mod panel;
mod rust;
mod shaders;
#[cfg(test)]
mod tests;

use bevy::{
    app::{App, Plugin, Update},
    diagnostic::DiagnosticsStore,
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    input::{ButtonInput, keyboard::KeyCode},
    log::warn,
    render::diagnostic::RenderDiagnosticsPlugin,
};
use bevy_egui::{EguiPlugin, EguiPrimaryContextPass};
use bevy_inspector_egui::DefaultInspectorConfigPlugin;

/// The Egui that the panel is drawn with.
pub use bevy_egui;
pub use files::{from_ron, to_ron};
pub use panel::Tab;

use crate::GiSettingsRegistry;

/// Adds the panel. Needs Egui: without an `EguiPlugin` in the app, it warns and does nothing.
///
/// Adds Bevy's `RenderDiagnosticsPlugin`, which measures passes, unless the app has it: add one of your
/// own first.
pub struct GiInspectorPlugin {
    /// The key that opens and closes the panel. Default F1.
    pub key: Option<KeyCode>,
    /// Whether it is open from the start. Default `false`.
    pub open: bool,
}

impl Default for GiInspectorPlugin {
    fn default() -> Self {
        Self {
            key: Some(KeyCode::F1),
            open: false,
        }
    }
}

/// State of the panel.
#[derive(Resource, Debug, Clone, PartialEq)]
pub struct GiInspector {
    /// Whether it is shown.
    pub open: bool,
    /// Where it is shown.
    pub dock: Dock,
    /// Which part of it is shown.
    pub tab: Tab,
    /// Only fields whose name or documentation contains this are shown.
    pub search: String,
    /// The volume, light or camera whose parameters are shown, and which has handles in the viewport.
    pub selected: Option<Entity>,
    /// Where settings are saved, and loaded from.
    pub file: String,
    /// What came of the last action.
    message: String,
}

impl Default for GiInspector {
    fn default() -> Self {
        Self {
            open: false,
            dock: Dock::Left,
            tab: Tab::Settings,
            search: String::new(),
            selected: None,
            file: "gi_settings.ron".into(),
            message: String::new(),
        }
    }
}

/// Where the panel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dock {
    /// At the left side of the window.
    Left,
    /// At the right side of the window.
    Right,
    /// In a window of its own, inside of the app's.
    Floating,
}

#[derive(Resource)]
struct ToggleKey(KeyCode);

fn is_open(inspector: Res<GiInspector>) -> bool {
    inspector.open
}

impl Plugin for GiInspectorPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(GiInspector {
            open: self.open,
            ..Default::default()
        });
        if let Some(key) = self.key {
            app.insert_resource(ToggleKey(key)).add_systems(
                Update,
                toggle.run_if(resource_exists::<ButtonInput<KeyCode>>),
            );
        }
        if !app.is_plugin_added::<RenderDiagnosticsPlugin>() {
            app.add_plugins(RenderDiagnosticsPlugin);
        }
        if !app.is_plugin_added::<DefaultInspectorConfigPlugin>() {
            app.add_plugins(DefaultInspectorConfigPlugin);
        }
        app.init_resource::<cost::CostHistory>();
    }

    fn finish(&self, app: &mut App) {
        if !app.is_plugin_added::<EguiPlugin>() {
            warn!(
                "GiInspectorPlugin does nothing: the app has no Egui; add `bevy_egui::EguiPlugin::default()`"
            );
            return;
        }
        if !app.world().contains_resource::<GiSettingsRegistry>() {
            warn!("GiInspectorPlugin does nothing: the app has no GiPlugins");
            return;
        }
        app.add_systems(
            Update,
            cost::record
                .run_if(is_open)
                .run_if(resource_exists::<DiagnosticsStore>),
        );
        app.add_systems(
            EguiPrimaryContextPass,
            (panel::show, handles::show).chain().run_if(is_open),
        );
    }
}

fn toggle(
    keys: Res<ButtonInput<KeyCode>>,
    key: Res<ToggleKey>,
    mut inspector: ResMut<GiInspector>,
) {
    if keys.just_pressed(key.0) {
        inspector.open = !inspector.open;
    }
}
