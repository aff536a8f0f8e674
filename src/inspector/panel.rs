//! The panel: where it is, and its tabs.

use bevy::ecs::prelude::*;
use bevy_egui::{EguiContext, PrimaryEguiContext, egui};

use super::{Dock, GiInspector, cost, fields, fields::Fold, files, items};
use crate::{
    GiDebugSettings, GiSettings, GiSettingsRegistry, GiSupport, GiTechnique, GiTechniques, GiView,
    GiViews, SettingsEntry, ViewEntry,
};

/// A tab of the panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tab {
    /// Technique, presets, and all parameters.
    Settings,
    /// Volumes, lights and cameras.
    Scene,
    /// Times, memory, counts and warnings.
    Cost,
    /// Debug views.
    Views,
}

impl Tab {
    /// All tabs, from left to right.
    pub const ALL: [Self; 4] = [Self::Settings, Self::Scene, Self::Cost, Self::Views];

    /// Text on its button.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Settings => "Settings",
            Self::Scene => "Scene",
            Self::Cost => "Cost",
            Self::Views => "Views",
        }
    }

    /// What is there.
    const fn contents(self) -> &'static str {
        match self {
            Self::Settings => "All parameters",
            Self::Scene => "Volumes, probes, lights and cameras",
            Self::Cost => "Times, memory, counts and warnings",
            Self::Views => "What to show in place of the picture, or in it",
        }
    }
}

pub(super) fn show(world: &mut World) {
    let context = world
        .query_filtered::<&mut EguiContext, With<PrimaryEguiContext>>()
        .single(world);
    let Ok(mut context) = context.cloned() else {
        return;
    };
    let ctx = context.get_mut().clone();
    // Taken out, so that the world can be changed meanwhile; written back only if it has changed.
    let before = world.resource::<GiInspector>().clone();
    let mut inspector = before.clone();
    let mut open = true;
    match inspector.dock {
        Dock::Floating => {
            egui::Window::new("Global illumination")
                .open(&mut open)
                .default_width(380.0)
                .show(&ctx, |ui| contents(world, &mut inspector, ui));
        }
        side => {
            let panel = match side {
                Dock::Left => egui::Panel::left("gi_inspector"),
                _ => egui::Panel::right("gi_inspector"),
            };
            #[expect(
                deprecated,
                reason = "the only way to dock in a context that others draw into"
            )]
            panel
                .default_size(400.0)
                .resizable(true)
                .show(&ctx, |ui| contents(world, &mut inspector, ui));
        }
    }
    inspector.open &= open;
    if inspector != before {
        world.insert_resource(inspector);
    }
}

pub(super) fn contents(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    header(world, inspector, ui);
    ui.separator();
    let shown = shown(world);
    if shown.view != GiView::Full && inspector.tab != Tab::Views {
        ui.small(format!("{}: {}", shown.view, shown.legend));
    }
    egui::ScrollArea::vertical()
        .id_salt(inspector.tab.name())
        .auto_shrink(false)
        .show(ui, |ui| match inspector.tab {
            Tab::Settings => settings(world, inspector, ui),
            Tab::Scene => items::show(world, inspector, ui),
            Tab::Cost => cost::show(world, ui),
            Tab::Views => views(world, inspector, ui),
        });
}

fn header(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    ui.horizontal(|ui| {
        for tab in Tab::ALL {
            let button = ui.selectable_value(&mut inspector.tab, tab, tab.name());
            if button.on_hover_text(tab.contents()).changed() {
                // Of another list.
                inspector.search.clear();
            }
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            if ui.button("✖").on_hover_text("Close").clicked() {
                inspector.open = false;
            }
            for (dock, sign, what) in [
                (Dock::Right, "▶", "Dock at the right"),
                (Dock::Floating, "🗖", "A window of its own"),
                (Dock::Left, "◀", "Dock at the left"),
            ] {
                let button = ui.selectable_label(inspector.dock == dock, sign);
                if button.on_hover_text(what).clicked() {
                    inspector.dock = dock;
                }
            }
        });
    });
    technique(world, ui);
    files::show(world, inspector, ui);
}

fn technique(world: &mut World, ui: &mut egui::Ui) {
    let support = world.resource::<GiSupport>();
    let settings = world.resource::<GiSettings>();
    let mut technique = settings.technique;
    ui.horizontal_wrapped(|ui| {
        ui.strong("Technique");
        for choice in world.resource::<GiTechniques>().iter() {
            let reason = support.technique(choice.technique);
            ui.add_enabled_ui(reason.is_none(), |ui| {
                let button = ui.selectable_value(&mut technique, choice.technique, choice.title);
                if let Some(reason) = reason {
                    button.on_disabled_hover_text(reason);
                }
            });
        }
    });
    if technique != settings.technique {
        world.resource_mut::<GiSettings>().technique = technique;
    }
    ui.horizontal_wrapped(|ui| {
        ui.strong("Quality");
        let registry = world.resource::<GiSettingsRegistry>().clone();
        let mut names: Vec<&str> = Vec::new();
        for name in registry.active(technique).flat_map(SettingsEntry::presets) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        for name in names {
            let in_force = registry.has_preset(world, name);
            let button = ui.selectable_label(in_force, name).on_hover_text(format!(
                "Sets the cameras, the capture and the technique to the preset '{name}'; which technique \
                 that is, the strength of the light, and the sky stay"
            ));
            if button.clicked() {
                registry.apply_preset(world, name);
            }
        }
    });
}

fn settings(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    fields::search(&mut inspector.search, ui);
    let technique = world.resource::<GiSettings>().technique;
    let registry = world.resource::<GiSettingsRegistry>().clone();
    // A technique that was just chosen unfolds, the one before folds.
    let id = egui::Id::new("gi_technique_shown");
    let before = ui.data_mut(|data| {
        let before = data.get_temp::<GiTechnique>(id);
        data.insert_temp(id, technique);
        before
    });
    let switched = before.is_some_and(|before| before != technique);
    // Debug views have a tab of their own, and components of the scene are in another.
    for entry in registry.resources().filter(|entry| !entry.is_debug) {
        let active = entry.technique.is_none_or(|t| t == technique);
        let fold = Fold {
            at_first: active,
            now: (switched && entry.technique.is_some()).then_some(active),
        };
        resource(world, entry, fold, &inspector.search, ui);
    }
}

/// All fields of a settings resource.
fn resource(world: &mut World, entry: &SettingsEntry, fold: Fold, search: &str, ui: &mut egui::Ui) {
    if let [entity] = entry.entities(world)[..] {
        fields::parameters(world, entry, entity, fold, search, ui);
    }
}

/// The view that cameras show.
fn shown(world: &World) -> ViewEntry {
    let view = world.resource::<GiDebugSettings>().view;
    *world.resource::<GiViews>().get(view)
}

fn views(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    let shown = shown(world);
    let mut view = shown.view;
    let technique = world.resource::<GiSettings>().technique;
    ui.horizontal_wrapped(|ui| {
        for entry in world.resource::<GiViews>().iter() {
            let there = entry.technique.is_none_or(|own| own == technique);
            let button = egui::Button::selectable(view == entry.view, entry.view.name());
            let button = ui.add_enabled(there, button);
            if button.on_hover_text(entry.legend).clicked() {
                view = entry.view;
            }
        }
    });
    if view != shown.view {
        world.resource_mut::<GiDebugSettings>().view = view;
    }
    ui.label(format!("{}: {}", shown.view, shown.legend));
    let registry = world.resource::<GiSettingsRegistry>().clone();
    for entry in registry.debug(technique) {
        if let Some(legend) = entry.legend(world) {
            ui.label(format!("{}: {legend}", entry.name));
        }
    }
    ui.separator();
    fields::search(&mut inspector.search, ui);
    for entry in registry.debug(technique) {
        resource(world, entry, Fold::OPEN, &inspector.search, ui);
    }
}
