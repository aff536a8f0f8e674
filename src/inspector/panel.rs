//! The panel: where it is, and its tabs.

use bevy::ecs::prelude::*;
use bevy_egui::{EguiContext, PrimaryEguiContext, egui};

use super::{Dock, GiInspector, cost, fields, files, items};
use crate::{
    GiDebugSettings, GiSettings, GiSettingsRegistry, GiSupport, GiTechnique, SettingsEntry,
};

/// A part of the panel.
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
    /// All of them, from left to right.
    pub const ALL: [Self; 4] = [Self::Settings, Self::Scene, Self::Cost, Self::Views];

    /// As on its button.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Settings => "Settings",
            Self::Scene => "Scene",
            Self::Cost => "Cost",
            Self::Views => "Views",
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

fn contents(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    header(world, inspector, ui);
    ui.separator();
    egui::ScrollArea::vertical()
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
            ui.selectable_value(&mut inspector.tab, tab, tab.name());
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
    let reason = match world.get_resource::<GiSupport>() {
        Some(GiSupport::Unsupported(why)) => Some(why.clone()),
        _ => None,
    };
    let settings = world.resource::<GiSettings>();
    let mut technique = settings.technique;
    ui.horizontal_wrapped(|ui| {
        ui.strong("Technique");
        for choice in GiTechnique::ALL {
            let possible = choice == GiTechnique::Off || reason.is_none();
            ui.add_enabled_ui(possible, |ui| {
                let button = ui.selectable_value(&mut technique, choice, choice.title());
                if let Some(reason) = &reason {
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
        let active = |entry: &&SettingsEntry| entry.technique.is_none_or(|t| t == technique);
        let entries: Vec<_> = registry.iter().filter(active).collect();
        let mut names: Vec<&str> = Vec::new();
        for (name, _) in entries.iter().flat_map(|entry| entry.presets()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        for name in names {
            let button = ui.button(name).on_hover_text(format!(
                "Sets all parameters of the technique to the preset '{name}'; light units, sky and the \
                 technique stay"
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
    let debug = SettingsEntry::new::<GiDebugSettings>().name;
    for entry in registry.iter().filter(|entry| entry.name != debug) {
        let active = entry.technique.is_none_or(|t| t == technique);
        resource(world, entry, active, &inspector.search, ui);
    }
}

/// All fields of a settings resource.
fn resource(world: &mut World, entry: &SettingsEntry, open: bool, search: &str, ui: &mut egui::Ui) {
    let Some(value) = entry.get(world) else {
        return;
    };
    let Ok(mut value) = value.reflect_clone() else {
        return;
    };
    let group = fields::Group {
        title: entry.name,
        default: entry.default_value(),
        ranges: &entry.ranges,
        search,
        open,
    };
    if group.show(world, &mut *value, ui)
        && let Some(mut resource) = entry.get_mut(world)
    {
        resource.apply(value.as_partial_reflect());
    }
}

fn views(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    let mut view = world.resource::<GiDebugSettings>().view;
    let before = view;
    ui.horizontal_wrapped(|ui| {
        for choice in crate::GiView::ALL {
            ui.selectable_value(&mut view, choice, choice.name())
                .on_hover_text(choice.legend());
        }
    });
    if view != before {
        world.resource_mut::<GiDebugSettings>().view = view;
    }
    ui.label(format!("{}: {}", view.name(), view.legend()));
    ui.separator();
    fields::search(&mut inspector.search, ui);
    let registry = world.resource::<GiSettingsRegistry>().clone();
    let debug = SettingsEntry::new::<GiDebugSettings>().name;
    if let Some(entry) = registry.find(debug) {
        resource(world, entry, true, &inspector.search, ui);
    }
}

#[cfg(test)]
mod tests {
    use bevy_inspector_egui::DefaultInspectorConfigPlugin;

    use super::*;
    use crate::wgsl_tests;

    /// All text of a picture of the panel.
    fn text(world: &mut World, inspector: &mut GiInspector) -> String {
        let ctx = egui::Context::default();
        let input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(
                egui::Pos2::ZERO,
                egui::vec2(600.0, 8000.0),
            )),
            ..Default::default()
        };
        let mut text = String::new();
        // What unfolds takes some frames.
        for frame in 0..40 {
            let input = egui::RawInput {
                time: Some(f64::from(frame) / 10.0),
                ..input.clone()
            };
            ctx.begin_pass(input);
            egui::Window::new("panel")
                .fixed_size([580.0, 7900.0])
                .show(&ctx, |ui| contents(world, inspector, ui));
            text.clear();
            for shape in ctx.end_pass().shapes {
                collect(&shape.shape, &mut text);
            }
        }
        text
    }

    fn collect(shape: &egui::Shape, text: &mut String) {
        match shape {
            egui::Shape::Text(shape) => {
                text.push_str(shape.galley.text());
                text.push('\n');
            }
            egui::Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, text)),
            _ => {}
        }
    }

    /// Nothing in the panel knows the names of the settings.
    #[test]
    fn every_parameter_of_every_settings_resource_is_shown() {
        let (mut app, _) = wgsl_tests::load(&[]);
        app.init_resource::<cost::CostHistory>();
        bevy::app::Plugin::build(&DefaultInspectorConfigPlugin, &mut app);
        let world = app.world_mut();
        let mut shown = 0;
        let registry = world.resource::<GiSettingsRegistry>().clone();
        for entry in registry.iter() {
            let debug = entry.name == SettingsEntry::new::<GiDebugSettings>().name;
            let mut inspector = GiInspector {
                tab: if debug { Tab::Views } else { Tab::Settings },
                // Groups of other techniques are folded, unless something is looked for.
                search: entry.name.into(),
                ..Default::default()
            };
            let text = text(world, &mut inspector);
            let bevy::reflect::ReflectRef::Struct(fields) = entry.default_value().reflect_ref()
            else {
                panic!("{} has no fields", entry.name)
            };
            for i in 0..fields.field_len() {
                let name = fields.name_at(i).unwrap().replace('_', " ");
                // Alone, marked, or with its unit.
                let is_it = |line: &str| {
                    let line = line.trim_start_matches("• ");
                    line == name || line.starts_with(&format!("{name}, "))
                };
                assert!(
                    text.lines().any(is_it),
                    "{}: {name} is missing in\n{text}",
                    entry.name
                );
                shown += 1;
            }
        }
        assert!(shown > 30, "only {shown} parameters");
    }

    /// A world without a renderer, a camera or a window has a panel, too.
    #[test]
    fn every_tab_can_be_shown() {
        let (mut app, _) = wgsl_tests::load(&[]);
        app.init_resource::<cost::CostHistory>();
        let world = app.world_mut();
        world.spawn(crate::GiVolume::default());
        let light = world.spawn(bevy::light::PointLight::default()).id();
        for tab in Tab::ALL {
            let mut inspector = GiInspector {
                tab,
                selected: Some(light),
                ..Default::default()
            };
            let text = text(world, &mut inspector);
            assert!(text.contains("Technique"), "{text}");
            let expected = match tab {
                Tab::Settings => "indirect strength",
                Tab::Scene => "128 voxels",
                Tab::Cost => "bevy_gi is off",
                Tab::Views => "voxel-albedo",
            };
            assert!(text.contains(expected), "{expected} is missing in\n{text}");
        }
    }
}
