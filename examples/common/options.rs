//! Command-line options about techniques and settings, and what they do to a world.

use std::path::PathBuf;

use bevy::{
    log::LogPlugin,
    prelude::*,
    reflect::{GetPath, serde::TypedReflectDeserializer},
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
    winit::WinitPlugin,
};
use bevy_gi::{
    FieldRange, GiSettingsRegistry, GiTechniques, SettingsEntry, inspector::from_ron, prelude::*,
    reference::ReferenceSettings,
};
use serde::de::DeserializeSeed;

use super::scenes;

/// Settings on the command line.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SettingsOptions {
    /// Sets a field, for example VoxelConeTracingSettings.cones=8. Repeatable.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub sets: Vec<String>,
    /// Settings as RON, as the inspector saves them: { "GiSettings": (..), .. }, each optional.
    #[arg(long, value_name = "FILE.ron")]
    pub settings: Option<PathBuf>,
}

/// What `--technique` names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Technique {
    Gi(GiTechnique),
    /// The path tracer.
    Reference,
}

impl Technique {
    /// All of them.
    pub fn all(techniques: &GiTechniques) -> Vec<Self> {
        let gi = techniques.iter().map(|entry| Self::Gi(entry.technique));
        gi.chain([Self::Reference]).collect()
    }

    /// What is typed, not yet known to exist: techniques are those of the app, see [`check`](Self::check).
    pub fn named(name: &str) -> Self {
        match name {
            "reference" => Self::Reference,
            _ => Self::Gi(GiTechnique::named(name)),
        }
    }

    /// Whether the app has it.
    pub fn check(self, techniques: &GiTechniques) -> Result<(), String> {
        match Self::all(techniques).contains(&self) {
            true => Ok(()),
            false => Err(format!(
                "there is no technique '{}'; there are: {}",
                self.name(),
                technique_names(techniques)
            )),
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Gi(technique) => technique.name(),
            Self::Reference => "reference",
        }
    }

    /// Lets cameras show it; beside the path tracer, they show direct light.
    pub fn apply(self, settings: &mut GiSettings) {
        settings.technique = match self {
            Self::Gi(technique) => technique,
            Self::Reference => GiTechnique::OFF,
        };
    }
}

/// Names of all techniques.
pub fn technique_names(techniques: &GiTechniques) -> String {
    let names: Vec<_> = Technique::all(techniques)
        .iter()
        .map(|t| t.name())
        .collect();
    names.join(" ")
}

pub fn technique(name: &str) -> Result<Technique, String> {
    Ok(Technique::named(name))
}

/// A technique that runs in real time.
pub fn gi_technique(name: &str) -> Result<GiTechnique, String> {
    match Technique::named(name) {
        Technique::Gi(technique) => Ok(technique),
        Technique::Reference => Err("a technique that runs in real time is wanted".into()),
    }
}

/// Those that were named, or all that compute light.
pub fn chosen_techniques(world: &World, named: &[GiTechnique]) -> Result<Vec<GiTechnique>, String> {
    let techniques = world.resource::<GiTechniques>();
    for technique in named {
        Technique::Gi(*technique).check(techniques)?;
    }
    Ok(match named {
        [] => techniques.on().map(|entry| entry.technique).collect(),
        some => some.to_vec(),
    })
}

pub fn view(name: &str) -> Result<GiView, String> {
    GiView::from_name(name).ok_or_else(|| {
        let names = GiView::ALL.map(GiView::name).join(", ");
        format!("no such view; there are: {names}")
    })
}

/// A number in a range.
pub fn number(text: &str, min: f32, max: f32) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|value| (min..=max).contains(value))
        .ok_or(format!("a number from {min} to {max} is wanted"))
}

pub fn size(text: &str) -> Result<UVec2, String> {
    text.split_once('x')
        .and_then(|(w, h)| Some(UVec2::new(w.parse().ok()?, h.parse().ok()?)))
        .filter(|s| s.min_element() > 0 && s.max_element() <= 8192)
        .ok_or("width x height is wanted, each 1 to 8192, like 640x360".into())
}

pub fn vector(text: &str) -> Result<Vec3, String> {
    let parts: Result<Vec<f32>, _> = text.split(',').map(|p| p.trim().parse()).collect();
    match parts.as_deref() {
        Ok([x, y, z]) if [x, y, z].iter().all(|v| v.is_finite()) => Ok(Vec3::new(*x, *y, *z)),
        _ => Err("three numbers are wanted, like 1,2.5,-3".into()),
    }
}

impl SettingsOptions {
    /// What is asked for, as on the command line.
    pub fn described(&self) -> Vec<String> {
        let file = self.settings.iter().map(|path| path.display().to_string());
        file.chain(self.sets.iter().cloned()).collect()
    }

    /// Applies them. Without a file, ambient light is replaced, and what is not asked for stays dark.
    pub fn apply(&self, world: &mut World, technique: Option<Technique>) -> Result<(), String> {
        register_reference(world);
        if let Some(path) = &self.settings {
            let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
            let text = std::fs::read_to_string(path).map_err(|e| fail(&e))?;
            from_ron(world, &text).map_err(|e| fail(&e))?;
        } else {
            let mut gi = world.resource_mut::<GiSettings>();
            gi.replace_ambient = true;
            gi.sky = GiSky::Black;
        }
        if let Some(technique) = technique {
            technique.check(world.resource::<GiTechniques>())?;
            technique.apply(&mut world.resource_mut::<GiSettings>());
        }
        for set in &self.sets {
            apply_set(world, set)?;
        }
        Ok(())
    }
}

/// `Resource.path.to.field=value`, the value as RON.
fn apply_set(world: &mut World, set: &str) -> Result<(), String> {
    let wanted = "Settings.field=value is wanted";
    let (path, value) = set
        .split_once('=')
        .ok_or(format!("--set {set}: {wanted}"))?;
    let (resource, field) = path
        .split_once('.')
        .ok_or(format!("--set {set}: {wanted}"))?;
    let registry = world.resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let unknown = || format!("--set {set}: there is no settings resource '{resource}'; see --list");
    let all = world.resource::<GiSettingsRegistry>().clone();
    let entry = all.find(resource).ok_or_else(unknown)?;
    let mut target = entry.get_mut(world).ok_or_else(unknown)?;
    let target = target
        .reflect_path_mut(format!(".{field}").as_str())
        .map_err(|_| format!("--set {set}: '{resource}' has no field '{field}'; see --list"))?;
    let type_id = target
        .get_represented_type_info()
        .map(|info| info.type_id())
        .ok_or_else(unknown)?;
    let field_type = registry.get(type_id).ok_or_else(unknown)?;
    let fail = |e: &dyn std::fmt::Display| format!("--set {set}: {e}");
    let mut deserializer = ron::de::Deserializer::from_str(value).map_err(|e| fail(&e))?;
    let new = TypedReflectDeserializer::new(field_type, &registry)
        .deserialize(&mut deserializer)
        .map_err(|e| fail(&e))?;
    deserializer.end().map_err(|e| fail(&e))?;
    target.apply(&*new);
    Ok(())
}

/// The path tracer's settings are the app's, as is the path tracer.
pub fn register_reference(world: &mut World) {
    world.init_resource::<ReferenceSettings>();
    let mut entry = SettingsEntry::new::<ReferenceSettings>();
    entry.ranges.push(FieldRange {
        field: "max_bounces",
        min: 0.0,
        max: 128.0,
        unit: "",
    });
    world.init_resource::<GiSettingsRegistry>();
    world.resource_mut::<GiSettingsRegistry>().add(entry);
}

/// The variants of an enum, for `--list`.
fn variants(value: &dyn PartialReflect) -> String {
    match value.get_represented_type_info() {
        Some(bevy::reflect::TypeInfo::Enum(info)) => {
            format!("  {}", info.variant_names().join(" | "))
        }
        _ => String::new(),
    }
}

/// Prints techniques, views, scenes and settings.
pub fn list() {
    // The plugins know their techniques and settings; no GPU is needed to ask them.
    let app = app_without_gpu();
    let techniques = app.world().resource::<GiTechniques>();
    println!("techniques: {}", technique_names(techniques));
    println!("views:");
    for view in GiView::ALL {
        println!("  {:14} {}", view.name(), view.legend());
    }
    println!("bundled scenes:");
    for scene in scenes::ALL {
        println!("  {:14} {}", scene.name, scene.about);
    }
    println!("settings and components, with their defaults and ranges:");
    let dump = |name: &str, value: &dyn PartialReflect, ranges: &[FieldRange]| {
        if let bevy::reflect::ReflectRef::Struct(fields) = value.reflect_ref() {
            for i in 0..fields.field_len() {
                let field = fields.name_at(i).unwrap_or_default();
                let value = fields.field_at(i).unwrap();
                let range = match ranges.iter().find(|range| range.field == field) {
                    // Single precision, as the fields have it.
                    Some(range) => {
                        let (min, max) = (range.min as f32, range.max as f32);
                        format!("  {min}..={max} {}", range.unit)
                    }
                    None => variants(value),
                };
                println!("  {name}.{field} = {value:?}{}", range.trim_end());
            }
        }
    };
    for entry in app.world().resource::<GiSettingsRegistry>().iter() {
        dump(
            entry.name,
            entry.default_value().as_partial_reflect(),
            &entry.ranges,
        );
    }
    dump("GiVolume", &GiVolume::default(), &GiVolume::ranges());
    dump("GiLight", &GiLight::default(), &GiLight::ranges());
}

/// All plugins, for what they know without a device.
fn app_without_gpu() -> App {
    let no_gpu = RenderPlugin {
        render_creation: RenderCreation::Automatic(Box::new(WgpuSettings {
            backends: None,
            ..default()
        })),
        ..default()
    };
    let plugins = DefaultPlugins.set(no_gpu);
    let mut app = App::new();
    app.add_plugins((
        plugins.disable::<WinitPlugin>().disable::<LogPlugin>(),
        GiPlugins,
    ));
    register_reference(app.world_mut());
    app
}
