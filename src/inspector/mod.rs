//! The inspector: a panel with all parameters and their cost.
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
//!     // Leave the first plugin out if the app has Egui already.
//!     .add_plugins((EguiPlugin::default(), GiInspectorPlugin::default()))
//!     .run();
//! ```
//!
//! F1 opens it. Its contents come from reflection: all fields of all resources and components in
//! [`crate::GiSettingsRegistry`], with their ranges, units and documentation.
//!
//! While the panel is closed, only the system that waits for its key runs.

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

/// The `bevy_egui` that draws the panel.
pub use bevy_egui;
pub use files::{from_ron, to_ron, values_from_ron};
pub use panel::Tab;

use crate::GiSettingsRegistry;

/// Adds the panel. It needs Egui: without an `EguiPlugin` in the app, it warns and does nothing.
///
/// It adds Bevy's `RenderDiagnosticsPlugin`, which times passes, unless the app already has it. To add your
/// own, add it before this plugin.
pub struct GiInspectorPlugin {
    /// The key that opens and closes the panel; `None` for no key. Default F1.
    pub key: Option<KeyCode>,
    /// Whether the panel is open from the start. Default `false`.
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
    /// Whether the panel is shown.
    pub open: bool,
    /// Where the panel is shown. Default [`Dock::Left`].
    pub dock: Dock,
    /// Which tab is shown. Default [`Tab::Settings`].
    pub tab: Tab,
    /// Only fields whose name or documentation contains this text are shown. Default empty: all.
    pub search: String,
    /// The volume, light or camera whose parameters are shown, and which has handles in the viewport. Default:
    /// none.
    pub selected: Option<Entity>,
    /// File to which settings are saved, and from which they are loaded. Default `gi_settings.ron`.
    pub file: String,
    /// Result of the last action.
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

/// Where the panel is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dock {
    /// On the left side of the window.
    Left,
    /// On the right side of the window.
    Right,
    /// In a floating panel inside the window.
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
