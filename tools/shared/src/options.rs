//! Command-line options about techniques and settings, and what they do to a world.

use std::path::PathBuf;

use bevy::{
    log::LogPlugin,
    prelude::*,
    reflect::{
        GetPath, PartialReflect, TypeInfo, TypeRegistry, enums::VariantInfo,
        serde::TypedReflectDeserializer,
    },
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
    winit::WinitPlugin,
};
use bevy_gi::{
    GiSettingsRegistry, GiTechniques, ParametersKind, SettingsEntry, ViewEntry,
    inspector::values_from_ron, prelude::*, reference::ReferenceSettings,
};
use serde::de::DeserializeSeed;

use crate::scenes;

/// Settings on the command line.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct SettingsOptions {
    /// Sets a field of a resource, or of a component of all entities that have it: VoxelConeTracingSettings.cones=8,
    /// ProbeSet.resolution=48, 'RadianceHintsSettings.sampling=Disk((spread: 0.5))'; see --list. Repeatable.
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

/// A debug view of the plugin or of one of its techniques.
pub fn view(name: &str) -> Result<ViewEntry, String> {
    let app = app_without_gpu();
    let views = app.world().resource::<GiViews>();
    views.find(name).map(|view| *views.get(view))
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
            let values = values_from_ron(world, &text).map_err(|e| fail(&e))?;
            // The cameras are still to come.
            values.apply_always(world);
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

/// `Type.path.to.field=value`, the value as RON.
///
/// Of a component, all entities that have it, also those that the scene still brings.
fn apply_set(world: &mut World, set: &str) -> Result<(), String> {
    let fail = |why: String| format!("--set {set}: {why}");
    let parts = set
        .split_once('=')
        .and_then(|(path, value)| Some((path.split_once('.')?, value)));
    let ((name, field), value) = parts.ok_or(fail("Type.field=value is wanted".into()))?;
    let all = world.resource::<GiSettingsRegistry>().clone();
    let entry = all
        .find(name)
        .ok_or_else(|| fail(format!("there are no settings '{name}'; see --list")))?;
    let (field, value) = (format!(".{field}"), value.to_owned());
    let types = world.resource::<AppTypeRegistry>().clone();
    // What is wrong with it is found by a value that no one has.
    let now = entry.get(world).unwrap_or(entry.default_value());
    let mut trial = now.reflect_clone().map_err(|e| fail(e.to_string()))?;
    set_field(&mut *trial, &field, &value, &types.read()).map_err(fail)?;
    entry.change_always(world, move |now| {
        if let Err(why) = set_field(now, &field, &value, &types.read()) {
            warn!("{why}");
        }
    });
    Ok(())
}

/// Sets the field at a path to a value in RON.
fn set_field(
    target: &mut dyn Reflect,
    path: &str,
    value: &str,
    types: &TypeRegistry,
) -> Result<(), String> {
    let unknown = format!(
        "'{}' has no field '{}', or not now; see --list",
        target.reflect_short_type_path(),
        &path[1..]
    );
    let field = target.reflect_path_mut(path).map_err(|_| &unknown)?;
    let field_type = field
        .get_represented_type_info()
        .and_then(|info| types.get(info.type_id()))
        .ok_or(&unknown)?;
    let mut deserializer = ron::de::Deserializer::from_str(value).map_err(|e| e.to_string())?;
    let new = TypedReflectDeserializer::new(field_type, types)
        .deserialize(&mut deserializer)
        .map_err(|e| e.to_string())?;
    deserializer.end().map_err(|e| e.to_string())?;
    field.apply(&*new);
    Ok(())
}

/// The path tracer's settings are the app's, as is the path tracer.
pub fn register_reference(world: &mut World) {
    world.init_resource::<ReferenceSettings>();
    world.init_resource::<GiSettingsRegistry>();
    let mut registry = world.resource_mut::<GiSettingsRegistry>();
    registry.add(SettingsEntry::new::<ReferenceSettings>());
}

/// The variants of an enum, for `--list`.
fn variants(value: &dyn PartialReflect) -> String {
    match value.get_represented_type_info() {
        Some(TypeInfo::Enum(info)) => {
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
    for entry in app.world().resource::<GiViews>().iter() {
        println!("  {:17} {}", entry.view, entry.legend);
    }
    println!("bundled scenes:");
    for scene in scenes::ALL {
        println!("  {:14} {}", scene.name, scene.about);
    }
    println!(
        "scenes that are drawn at random:\n  random:SEED, random:SEED:furnace, random:SEED:sealed"
    );
    println!("settings, with defaults, ranges and the beginning of their documentation:");
    for entry in app.world().resource::<GiSettingsRegistry>().iter() {
        let kind = match entry.kind {
            ParametersKind::Resource => "resource",
            ParametersKind::Camera => "component of cameras",
            ParametersKind::Scene => "component of the scene",
        };
        println!(
            "  {} ({kind}): {}",
            entry.name,
            beginning(entry.info().docs())
        );
        list_fields(entry);
    }
}

/// The fields of a type, each with what its variants hold.
fn list_fields(entry: &SettingsEntry) {
    let bevy::reflect::ReflectRef::Struct(fields) = entry.default_value().reflect_ref() else {
        return;
    };
    let TypeInfo::Struct(info) = entry.info() else {
        return;
    };
    for field in info.iter() {
        let Some(value) = fields.field(field.name()) else {
            continue;
        };
        let path = format!("{}.{}", entry.name, field.name());
        let may_be = range(entry, field.name()).unwrap_or_else(|| variants(value));
        println!(
            "    {path} = {value:?}{may_be}  {}",
            beginning(field.docs())
        );
        // A colour has one for each channel.
        let inside = format!("{}.", field.name());
        let mut paths: Vec<_> = entry.ranges.iter().map(|range| range.field).collect();
        paths.dedup();
        for inner in paths.iter().filter(|path| path.starts_with(&inside)) {
            let may_be = range(entry, inner).unwrap_or_default();
            let docs = beginning(docs_of(entry.info(), inner));
            println!("      {}.{inner}{may_be}  {docs}", entry.name);
        }
    }
}

/// The range of a field, as it is printed.
fn range(entry: &SettingsEntry, field: &str) -> Option<String> {
    let range = entry.ranges.iter().find(|range| range.field == field)?;
    let text = match range.min.fract() == 0.0 && range.max.fract() == 0.0 {
        true => format!("  {}..={} {}", range.min, range.max, range.unit),
        // Single precision, as the fields have it.
        false => format!(
            "  {}..={} {}",
            range.min as f32, range.max as f32, range.unit
        ),
    };
    Some(text.trim_end().into())
}

/// Documentation of a field by its path, which may lead through variants of enums.
fn docs_of<'a>(info: &'a TypeInfo, path: &str) -> Option<&'a str> {
    let (name, rest) = path.split_once('.').unwrap_or((path, ""));
    let (docs, inside) = match info {
        TypeInfo::Struct(info) => {
            let field = info.field(name)?;
            (field.docs(), field.type_info())
        }
        TypeInfo::Enum(info) => info.iter().find_map(|variant| match variant {
            VariantInfo::Tuple(variant) => {
                let field = variant.field_at(name.parse().ok()?)?;
                Some((variant.docs(), field.type_info()))
            }
            _ => None,
        })?,
        _ => return None,
    };
    match rest {
        "" => docs,
        rest => docs_of(inside?, rest),
    }
}

/// The first sentence of documentation, without the marks of rustdoc.
fn beginning(docs: Option<&str>) -> String {
    let docs: Vec<_> = docs.unwrap_or_default().lines().map(str::trim).collect();
    let text = docs.join(" ");
    let mut text = text.trim();
    if let Some(end) = text.find(". ") {
        text = &text[..=end];
    }
    let mut plain = String::new();
    for (i, part) in text.split("](").enumerate() {
        // The target of a link.
        let skip = if i == 0 {
            0
        } else {
            part.find(')').map_or(0, |end| end + 1)
        };
        plain += &part[skip..];
    }
    plain.replace(['`', '[', ']'], "")
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
