//! Settings to and from files and the clipboard, and other actions.

use bevy::ecs::prelude::*;
use bevy_egui::egui;

use super::{GiInspector, fields, rust, shaders};
use crate::{GiCaptureSettings, GiHistory, GiSettingsRegistry, ParametersKind, SettingsValues};

/// All settings of a world as RON: a map from type names to values. Components of the scene are not part of it; of
/// cameras, the primary one stands for all.
///
/// # Errors
/// The error of the format; a world without settings.
pub fn to_ron(world: &World) -> Result<String, String> {
    let registry = world
        .get_resource::<GiSettingsRegistry>()
        .ok_or("the app has no GiPlugins")?;
    let mut text = String::new();
    let pretty = ron::ser::PrettyConfig::new();
    let mut serializer =
        ron::Serializer::new(&mut text, Some(pretty)).map_err(|e| e.to_string())?;
    registry
        .serialize(world, &mut serializer)
        .map_err(|e| e.to_string())?;
    Ok(text)
}

/// Sets the settings of a world from RON, as [`to_ron`] writes it: resources, and components of all entities that
/// have such.
///
/// # Errors
/// What is wrong with the text, and where. Nothing is changed then.
pub fn from_ron(world: &mut World, text: &str) -> Result<(), String> {
    values_from_ron(world, text)?.apply(world);
    Ok(())
}

/// Reads settings from RON, as [`to_ron`] writes it, and does not apply them yet.
///
/// # Errors
/// What is wrong with the text, and where.
pub fn values_from_ron(world: &World, text: &str) -> Result<SettingsValues, String> {
    let registry = world
        .get_resource::<GiSettingsRegistry>()
        .ok_or("the app has no GiPlugins")?;
    let mut deserializer = ron::Deserializer::from_str(text).map_err(|e| e.to_string())?;
    registry
        .deserialize(world, &mut deserializer)
        .and_then(|values| deserializer.end().map(|()| values))
        .map_err(|e| deserializer.span_error(e).to_string())
}

/// All settings as Rust code.
fn to_rust(world: &World) -> String {
    let registry = world.resource::<GiSettingsRegistry>();
    let saved = registry
        .iter()
        .filter(|entry| entry.kind != ParametersKind::Scene);
    let entries = saved.filter_map(|entry| {
        let value = entry.get(world)?.as_partial_reflect();
        let default = entry.default_value().as_partial_reflect();
        Some(match entry.kind {
            ParametersKind::Resource => rust::insert_resource(value, default),
            _ => rust::insert_component(value, default),
        })
    });
    entries.collect()
}

pub(super) fn show(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    ui.horizontal_wrapped(|ui| {
        let path = egui::TextEdit::singleline(&mut inspector.file).desired_width(150.0);
        ui.add(path).on_hover_text(
            "The file for Save and Load, seen from the folder in which the app runs",
        );
        if fields::button(ui, "Save", "All settings as RON") {
            let saved = to_ron(world)
                .and_then(|text| std::fs::write(&inspector.file, text).map_err(|e| e.to_string()));
            inspector.message = outcome("saved", &inspector.file, saved);
        }
        if fields::button(
            ui,
            "Load",
            "Settings from that file; what is not in it stays",
        ) {
            let loaded = std::fs::read_to_string(&inspector.file)
                .map_err(|e| e.to_string())
                .and_then(|text| from_ron(world, &text));
            inspector.message = outcome("loaded", &inspector.file, loaded);
        }
        if fields::button(
            ui,
            "Copy as Rust",
            "Code that makes these settings, into the clipboard",
        ) {
            ui.ctx().copy_text(to_rust(world));
            inspector.message = "copied".into();
        }
    });
    ui.horizontal_wrapped(|ui| {
        if fields::button(ui, "Reset history", "Lets all light start afresh") {
            world.resource_mut::<GiHistory>().reset();
        }
        let mut frozen = world.resource::<GiCaptureSettings>().freeze;
        if ui
            .toggle_value(&mut frozen, "Freeze capture")
            .on_hover_text("Keeps voxels and shadow maps as they are, whatever moves")
            .changed()
        {
            world.resource_mut::<GiCaptureSettings>().freeze = frozen;
        }
        let possible = shaders::can_reload();
        let button = ui.add_enabled(possible, egui::Button::new("Reload shaders"));
        let button = button
            .on_hover_text("Reads the plugin's shaders again from its sources, as they are now")
            .on_disabled_hover_text("The plugin's sources do not lie on this machine");
        if button.clicked() {
            inspector.message = shaders::reload(world);
        }
    });
    if !inspector.message.is_empty() {
        ui.small(&inspector.message);
    }
}

fn outcome(done: &str, file: &str, result: Result<(), String>) -> String {
    match result {
        Ok(()) => format!("{done}: {file}"),
        Err(error) => format!("{file}: {error}"),
    }
}
