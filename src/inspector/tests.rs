//! The panel without a GPU: everything in it is there, and every button does what it says.

use std::time::{Duration, Instant};

use bevy::{
    app::{App, Plugin},
    camera::Camera3d,
    ecs::prelude::*,
    input::{
        ButtonState,
        keyboard::{Key, KeyCode, KeyboardInput},
    },
    light::{DirectionalLight, PointLight, RectLight, SpotLight},
    reflect::ReflectRef,
    render::sync_world::SyncWorldPlugin,
};
use bevy_egui::{EguiPlugin, egui};

use super::{GiInspector, GiInspectorPlugin, Tab, cost, panel};
use crate::{
    GiCamera, GiCaptureSettings, GiCascades, GiDebugSettings, GiHistory, GiLight, GiSettings,
    GiSettingsRegistry, GiSupport, GiTechnique, GiTechniques, GiView, GiVolume, ParametersKind,
    ProbePin, no_renderer_tests,
};

/// The panel's contents, with a pointer but without a window.
struct Panel {
    app: App,
    inspector: GiInspector,
    ctx: egui::Context,
    seconds: f64,
    /// Text of the last frame, and where it is.
    text: Vec<(egui::Pos2, String)>,
    copied: String,
}

impl Panel {
    fn new(tab: Tab) -> Self {
        let mut app = no_renderer_tests::app();
        app.init_resource::<cost::CostHistory>();
        // Bevy's own lights want it where they are removed.
        Plugin::build(&SyncWorldPlugin, &mut app);
        Plugin::build(&super::DefaultInspectorConfigPlugin, &mut app);
        Self {
            app,
            inspector: GiInspector {
                tab,
                ..Default::default()
            },
            ctx: egui::Context::default(),
            seconds: 0.0,
            text: Vec::new(),
            copied: String::new(),
        }
    }

    fn world(&mut self) -> &mut World {
        self.app.world_mut()
    }

    fn get<T: Resource>(&self) -> &T {
        self.app.world().resource::<T>()
    }

    fn frame(&mut self, events: Vec<egui::Event>) {
        self.seconds += 0.1;
        let size = egui::vec2(600.0, 8000.0);
        self.ctx.begin_pass(egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size)),
            time: Some(self.seconds),
            events,
            ..Default::default()
        });
        let (world, inspector) = (self.app.world_mut(), &mut self.inspector);
        egui::Window::new("panel")
            .fixed_pos(egui::Pos2::ZERO)
            .fixed_size([580.0, 7900.0])
            .show(&self.ctx, |ui| panel::contents(world, inspector, ui));
        let output = self.ctx.end_pass();
        self.text.clear();
        for shape in output.shapes {
            collect(&shape.shape, &mut self.text);
        }
        for command in output.platform_output.commands {
            if let egui::OutputCommand::CopyText(text) = command {
                self.copied = text;
            }
        }
    }

    /// What is to be read, once all that unfolds has unfolded.
    fn text(&mut self) -> String {
        for _ in 0..40 {
            self.frame(Vec::new());
        }
        let lines = self.text.iter().map(|(_, line)| line.as_str());
        lines.collect::<Vec<_>>().join("\n")
    }

    /// Where the first thing with this text is.
    fn find(&mut self, label: &str) -> egui::Pos2 {
        let all = self.text();
        let found = self.text.iter().find(|(_, text)| text == label);
        let Some((at, _)) = found else {
            panic!("no '{label}' in\n{all}")
        };
        *at + egui::vec2(3.0, 3.0)
    }

    /// What is to be read while the pointer rests there.
    fn hover(&mut self, label: &str) -> String {
        let at = self.find(label);
        self.frame(vec![egui::Event::PointerMoved(at)]);
        self.text()
    }

    /// Presses the first thing with this text.
    fn click(&mut self, label: &str) {
        let at = self.find(label);
        let button = |pressed| egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        };
        self.frame(vec![egui::Event::PointerMoved(at)]);
        self.frame(vec![button(true)]);
        self.frame(vec![button(false)]);
        self.frame(Vec::new());
    }

    fn count<C: Component>(&mut self) -> usize {
        let world = self.world();
        world.query::<&C>().iter(world).count()
    }
}

fn collect(shape: &egui::Shape, text: &mut Vec<(egui::Pos2, String)>) {
    match shape {
        egui::Shape::Text(shape) => text.push((shape.pos, shape.galley.text().to_owned())),
        egui::Shape::Vec(shapes) => shapes.iter().for_each(|shape| collect(shape, text)),
        _ => {}
    }
}

/// Nothing in the panel knows the names of the settings.
#[test]
fn every_parameter_of_every_type_is_shown() {
    let mut panel = Panel::new(Tab::Settings);
    let mut shown = 0;
    let registry = panel.get::<GiSettingsRegistry>().clone();
    for entry in registry.iter() {
        panel.inspector.tab = match entry.kind {
            ParametersKind::Resource if entry.is_debug => Tab::Views,
            ParametersKind::Resource => Tab::Settings,
            ParametersKind::Camera | ParametersKind::Scene => Tab::Scene,
        };
        if entry.kind != ParametersKind::Resource {
            let entity = panel.world().spawn_empty().id();
            entry.insert(panel.world(), entity);
            panel.inspector.selected = Some(entity);
        }
        // Groups of other techniques are folded, unless something is looked for.
        panel.inspector.search = entry.name.into();
        let text = panel.text();
        let ReflectRef::Struct(fields) = entry.default_value().reflect_ref() else {
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
    assert!(shown > 60, "only {shown} parameters");
    assert!(registry.components().count() >= 5);
}

/// A world without a renderer, a camera or a window has a panel, too.
#[test]
fn every_tab_can_be_shown() {
    let mut panel = Panel::new(Tab::Settings);
    panel.world().spawn(GiVolume::default());
    let light = panel.world().spawn(PointLight::default()).id();
    panel.inspector.selected = Some(light);
    for tab in Tab::ALL {
        panel.click(tab.name());
        assert_eq!(panel.inspector.tab, tab);
        let text = panel.text();
        assert!(text.contains("Technique"), "{text}");
        let expected = match tab {
            Tab::Settings => "shadow map size",
            Tab::Scene => "128 voxels",
            Tab::Cost => "bevy_gi is off",
            Tab::Views => "voxel-albedo",
        };
        assert!(text.contains(expected), "{expected} is missing in\n{text}");
    }
}

/// The techniques that compute light, with their titles.
fn techniques(panel: &Panel) -> Vec<(GiTechnique, &'static str)> {
    let techniques = panel.get::<GiTechniques>().on();
    techniques
        .map(|entry| (entry.technique, entry.title))
        .collect()
}

#[test]
fn technique_presets_and_views_are_chosen_by_a_click() {
    let mut panel = Panel::new(Tab::Settings);
    // As with a device that has everything.
    panel.world().insert_resource(GiSupport::default());
    panel.click("Off");
    assert_eq!(panel.get::<GiSettings>().technique, GiTechnique::OFF);
    for (technique, title) in techniques(&panel) {
        panel.click(title);
        assert_eq!(panel.get::<GiSettings>().technique, technique);
        let registry = panel.get::<GiSettingsRegistry>().clone();
        for preset in ["low", "paper"] {
            assert!(!registry.has_preset(panel.world(), preset), "{title}");
            panel.click(preset);
            assert!(registry.has_preset(panel.world(), preset), "{title}");
        }
    }
    panel.click("Views");
    panel.click("voxel-albedo");
    assert_eq!(panel.get::<GiDebugSettings>().view, GiView::VoxelAlbedo);
}

/// It is there, greyed out, and says why on hover.
#[test]
fn a_technique_that_cannot_run_is_not_chosen() {
    let mut panel = Panel::new(Tab::Views);
    let [(small, title), (other, other_title), ..] = techniques(&panel)[..] else {
        panic!("there are fewer than two techniques");
    };
    let support = GiSupport::default().all_but(small.name(), "the toaster is too small");
    panel
        .world()
        .insert_resource(support.all_but(other.name(), None));
    panel.click("Off");
    assert!(!panel.text().contains("toaster"));
    assert!(panel.hover(title).contains("toaster"));
    panel.click(title);
    assert_eq!(panel.get::<GiSettings>().technique, GiTechnique::OFF);
    panel.click(other_title);
    assert_eq!(panel.get::<GiSettings>().technique, other);
    // Also among the warnings.
    panel.click("Cost");
    assert!(panel.text().contains("toaster"));
}

#[test]
fn volumes_and_lights_are_added_and_removed_by_a_click() {
    let mut panel = Panel::new(Tab::Scene);
    panel.click("+ volume");
    assert_eq!(panel.count::<GiVolume>(), 1);
    panel.click("Remove volume");
    assert_eq!(panel.count::<GiVolume>(), 0);
    for (button, count) in [
        (
            "+ point light",
            Panel::count::<PointLight> as fn(&mut Panel) -> usize,
        ),
        ("+ spot light", Panel::count::<SpotLight>),
        ("+ rect light", Panel::count::<RectLight>),
        ("+ sun", Panel::count::<DirectionalLight>),
    ] {
        panel.click(button);
        assert_eq!(count(&mut panel), 1, "{button}");
        assert!(panel.inspector.selected.is_some(), "{button}");
        panel.click("+ GiLight");
        assert_eq!(panel.count::<GiLight>(), 1, "{button}");
        panel.click("Remove GiLight");
        assert_eq!(panel.count::<GiLight>(), 0, "{button}");
        panel.click("Remove light");
        assert_eq!(count(&mut panel), 0, "{button}");
    }
    panel.click("+ cascades");
    assert_eq!(panel.count::<GiCascades>(), 1);
    panel.click("Remove cascades");
    assert_eq!(panel.count::<GiCascades>(), 0);
    panel.click("+ pin");
    assert_eq!(panel.count::<ProbePin>(), 1);
    panel.click("Remove pin");
    assert_eq!(panel.count::<ProbePin>(), 0);
    // What somebody else has made stays, without its light.
    let mine = panel
        .world()
        .spawn((Name::new("lamp post"), PointLight::default()))
        .id();
    panel.inspector.selected = Some(mine);
    panel.click("Remove light");
    assert!(panel.world().get_entity(mine).is_ok());
    assert!(panel.world().get::<PointLight>(mine).is_none());
}

#[test]
fn files_history_and_capture_have_their_buttons() {
    let mut panel = Panel::new(Tab::Settings);
    let name = format!("bevy_gi_panel_{}.ron", std::process::id());
    let file = std::env::temp_dir().join(name);
    panel.inspector.file = file.to_string_lossy().into_owned();
    panel
        .world()
        .resource_mut::<GiCaptureSettings>()
        .rsm_updates = 17;
    panel.click("Save");
    panel
        .world()
        .resource_mut::<GiCaptureSettings>()
        .rsm_updates = 3;
    panel.click("Load");
    assert_eq!(panel.get::<GiCaptureSettings>().rsm_updates, 17);
    let _ = std::fs::remove_file(&file);
    panel.click("Load");
    let text = panel.text();
    let name = file.to_string_lossy();
    assert!(text.contains(&*name) && !text.contains("loaded"), "{text}");
    panel.click("Copy as Rust");
    let code = panel.copied.clone();
    assert!(code.contains("rsm_updates: 17"), "{code}");
    assert!(!panel.get::<GiCaptureSettings>().freeze);
    panel.click("Freeze capture");
    assert!(panel.get::<GiCaptureSettings>().freeze);
    let before = *panel.get::<GiHistory>();
    panel.click("Reset history");
    assert_ne!(*panel.get::<GiHistory>(), before);
    if super::shaders::can_reload() {
        panel.click("Reload shaders");
        let text = panel.text();
        let reloaded = text.lines().find(|line| line.contains("shaders reloaded"));
        assert!(reloaded.is_some_and(|line| line.starts_with(|c: char| ('1'..='9').contains(&c))));
    }
}

fn press(app: &mut App, key_code: KeyCode) {
    for state in [ButtonState::Pressed, ButtonState::Released] {
        app.world_mut().write_message(KeyboardInput {
            key_code,
            logical_key: Key::F1,
            state,
            text: None,
            repeat: false,
            window: Entity::PLACEHOLDER,
        });
        app.update();
    }
}

/// An app with the plugin under test or without, without a renderer.
fn app(egui: bool, inspector: bool) -> App {
    let mut app = App::new();
    no_renderer_tests::add_plugins(&mut app);
    if egui {
        app.add_plugins(EguiPlugin::default());
    }
    if inspector {
        app.add_plugins(GiInspectorPlugin::default());
    }
    no_renderer_tests::finish(&mut app);
    // Egui draws where there is a camera.
    app.world_mut().spawn(Camera3d::default());
    app.update();
    app
}

/// The fastest of many frames of each app, since other programs run meanwhile; the apps take turns.
fn fastest_frames<const N: usize>(mut apps: [&mut App; N]) -> [Duration; N] {
    let mut fastest = [Duration::MAX; N];
    for _ in 0..300 {
        for (app, fastest) in apps.iter_mut().zip(&mut fastest) {
            let start = Instant::now();
            app.update();
            *fastest = (*fastest).min(start.elapsed());
        }
    }
    fastest
}

#[test]
fn the_key_opens_and_closes_it_and_closed_it_costs_nothing() {
    let mut with = app(true, true);
    assert!(!with.world().resource::<GiInspector>().open);
    press(&mut with, KeyCode::F1);
    assert!(with.world().resource::<GiInspector>().open);
    press(&mut with, KeyCode::F2);
    assert!(with.world().resource::<GiInspector>().open);
    press(&mut with, KeyCode::F1);
    assert!(!with.world().resource::<GiInspector>().open);
    // Beside an app that is the same without it.
    let mut without = app(true, false);
    let [closed, bare] = fastest_frames([&mut with, &mut without]);
    with.world_mut().resource_mut::<GiInspector>().open = true;
    let [open, _] = fastest_frames([&mut with, &mut without]);
    println!("a frame without panel {bare:?}, with it closed {closed:?}, open {open:?}");
    let adds = closed.saturating_sub(bare);
    assert!(adds < Duration::from_millis(1), "{adds:?}");
    // It is drawn indeed.
    assert!(open > closed, "{open:?}");
}

#[test]
fn without_egui_it_only_warns() {
    let mut app = app(false, true);
    press(&mut app, KeyCode::F1);
    app.update();
    assert!(app.world().resource::<GiInspector>().open);
}

/// Cameras have their values of one of them in a file, those of the scene have none.
#[test]
fn settings_of_cameras_survive_a_file_and_the_scene_stays() {
    let mut panel = Panel::new(Tab::Settings);
    let world = panel.world();
    let camera = GiCamera {
        strength: 2.0,
        history_frames: 17,
        ..Default::default()
    };
    let first = world.spawn(camera).id();
    let own = GiCamera::with_technique(GiTechnique::OFF);
    let volume = world.spawn(GiVolume::default().with_resolution(64)).id();
    panel.app.update();
    let saved = super::to_ron(panel.world()).unwrap();
    assert!(
        saved.contains("GiCamera") && !saved.contains("GiVolume"),
        "{saved}"
    );
    let world = panel.world();
    *world.get_mut::<GiCamera>(first).unwrap() = GiCamera::default();
    let second = world.spawn(own).id();
    *world.get_mut::<GiVolume>(volume).unwrap() = GiVolume::default();
    let values = super::values_from_ron(world, &saved).unwrap();
    values.apply_always(world);
    assert_eq!(world.get::<GiCamera>(first), Some(&camera));
    // Each keeps its technique.
    let expected = GiCamera {
        technique: own.technique,
        ..camera
    };
    assert_eq!(world.get::<GiCamera>(second), Some(&expected));
    assert_eq!(world.get::<GiVolume>(volume), Some(&GiVolume::default()));
    // And those that come later.
    let third = world.spawn(own).id();
    assert_eq!(world.get::<GiCamera>(third), Some(&expected));
}

/// What is out of range is brought into it, wherever it is, in the frame in which it was set.
#[test]
fn every_type_is_clamped() {
    use bevy::reflect::GetPath;

    let mut panel = Panel::new(Tab::Settings);
    let registry = panel.get::<GiSettingsRegistry>().clone();
    let mut clamped = 0;
    for entry in registry.iter() {
        let world = panel.world();
        let entity = match entry.entities(world)[..] {
            [entity] => entity,
            _ => {
                let entity = world.spawn_empty().id();
                entry.insert(world, entity);
                entity
            }
        };
        // Bounds of numbers that are there: not those in other variants of an enum.
        let mut value = entry.get_mut_of(world, entity).unwrap();
        let mut set = Vec::new();
        for range in &entry.ranges {
            let path = range.field;
            if let Ok(number) = value.path_mut::<f32>(path) {
                *number = f32::INFINITY;
                set.push(path);
            } else if range.max < f64::from(u32::MAX)
                && let Ok(number) = value.path_mut::<u32>(path)
            {
                *number = u32::MAX;
                set.push(path);
            }
        }
        panel.app.update();
        let value = entry.get_of(panel.world(), entity).unwrap();
        for path in set {
            let range = entry.ranges.iter().find(|range| range.field == path);
            let max = range.unwrap().max;
            let is = value.path::<f32>(path).map(|number| f64::from(*number));
            let is = is.or_else(|_| value.path::<u32>(path).map(|number| f64::from(*number)));
            assert_eq!(is.unwrap(), max, "{}.{path}", entry.name);
            clamped += 1;
        }
    }
    assert!(clamped > 40, "only {clamped} numbers");
}
