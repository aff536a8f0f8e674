//! [`GiSettingsRegistry`]: the list of all settings resources.

use std::{marker::PhantomData, sync::Arc};

use bevy::{
    app::{App, Last, Plugin},
    ecs::{component::Mutable, prelude::*, schedule::IntoScheduleConfigs, world::Mut},
    log::warn,
    reflect::{
        PartialReflect, Reflect, TypePath,
        serde::{TypedReflectDeserializer, TypedReflectSerializer},
    },
    render::extract_resource::{ExtractResource, ExtractResourcePlugin},
};
use serde::{
    Deserializer, Serialize, Serializer,
    de::{IgnoredAny, MapAccess, Visitor},
    ser::SerializeMap,
};

use super::{Clamp, Clamped, FieldRange, GiQuality, GiSettings, GiTechnique};
use crate::gpu::statistics::GiStatistics;

/// A settings resource: the parameters of one part of the crate.
pub trait SettingsResource:
    Resource<Mutability = Mutable>
    + ExtractResource<Source = Self>
    + Clamped
    + Reflect
    + TypePath
    + Default
    + Clone
{
    /// Presets under their names. Default: none.
    fn presets() -> Vec<(&'static str, Self)> {
        Vec::new()
    }
}

impl SettingsResource for GiSettings {
    fn presets() -> Vec<(&'static str, Self)> {
        GiQuality::named(Self::preset, Self::paper())
    }
}

/// All settings resources: [`GiSettings`](super::GiSettings), one for each technique, and those that an app
/// adds.
#[derive(Resource, Default, Clone)]
pub struct GiSettingsRegistry {
    entries: Vec<SettingsEntry>,
}

/// A settings resource of any type.
#[derive(Clone)]
pub struct SettingsEntry {
    /// Name of the type, without its path.
    pub name: &'static str,
    /// The technique that it belongs to. `None`: all techniques.
    pub technique: Option<GiTechnique>,
    /// Ranges of the numeric fields.
    pub ranges: Vec<FieldRange>,
    presets: Vec<(&'static str, Arc<dyn Reflect>)>,
    default: Arc<dyn Reflect>,
    get: fn(&World) -> Option<&dyn Reflect>,
    get_mut: fn(&mut World) -> Option<Mut<'_, dyn Reflect>>,
}

impl SettingsEntry {
    /// An entry for `T`.
    pub fn new<T>() -> Self
    where
        T: Resource<Mutability = Mutable> + Reflect + TypePath + Default,
    {
        Self {
            name: T::short_type_path(),
            technique: None,
            ranges: Vec::new(),
            presets: Vec::new(),
            default: Arc::new(T::default()),
            get: |world| world.get_resource::<T>().map(|t| t as &dyn Reflect),
            get_mut: |world| {
                let resource = world.get_resource_mut::<T>()?;
                Some(resource.map_unchanged(|t| t as &mut dyn Reflect))
            },
        }
    }

    /// The default, to which fields are reset.
    pub fn default_value(&self) -> &dyn Reflect {
        &*self.default
    }

    /// Presets under their names.
    pub fn presets(&self) -> impl Iterator<Item = (&'static str, &dyn Reflect)> {
        self.presets.iter().map(|(name, value)| (*name, &**value))
    }

    /// The preset with this name.
    pub fn preset(&self, name: &str) -> Option<&dyn Reflect> {
        self.presets().find(|(n, _)| *n == name).map(|(_, v)| v)
    }

    /// The resource, if the world has it.
    pub fn get<'w>(&self, world: &'w World) -> Option<&'w dyn Reflect> {
        (self.get)(world)
    }

    /// The resource, if the world has it. It counts as changed once it is written to.
    pub fn get_mut<'w>(&self, world: &'w mut World) -> Option<Mut<'w, dyn Reflect>> {
        (self.get_mut)(world)
    }
}

impl GiSettingsRegistry {
    /// All entries, in the order of the plugins.
    pub fn iter(&self) -> impl Iterator<Item = &SettingsEntry> {
        self.entries.iter()
    }

    /// The entry with this name.
    pub fn find(&self, name: &str) -> Option<&SettingsEntry> {
        self.entries.iter().find(|entry| entry.name == name)
    }

    /// The entries that belong to all techniques or to this one.
    pub fn active(&self, technique: GiTechnique) -> impl Iterator<Item = &SettingsEntry> {
        let all = self.entries.iter();
        all.filter(move |entry| entry.technique.is_none_or(|t| t == technique))
    }

    /// Adds an entry. An entry of the same name is replaced.
    pub fn add(&mut self, entry: SettingsEntry) {
        self.entries.retain(|old| old.name != entry.name);
        self.entries.push(entry);
    }

    /// Serializes all settings of a world as a map from type names to values. For example, as RON:
    /// `{"GiSettings": (history_frames: 32, ..), ..}`.
    pub fn serialize<S: Serializer>(
        &self,
        world: &World,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let types = world.resource::<AppTypeRegistry>().read();
        let mut map = serializer.serialize_map(Some(self.entries.len()))?;
        for entry in &self.entries {
            if let Some(value) = entry.get(world) {
                let value = TypedReflectSerializer::new(value.as_partial_reflect(), &types);
                map.serialize_entry(entry.name, &AsSerialize(value))?;
            }
        }
        map.end()
    }

    /// Reads a map that [`serialize`](Self::serialize) has written. Types that it leaves out are not in the
    /// result. Fields that a value leaves out have their default. A settings resource that the app does not
    /// have is skipped with a warning.
    ///
    /// # Errors
    /// Those of the format; an unknown field.
    pub fn deserialize<'de, D: Deserializer<'de>>(
        &self,
        world: &World,
        deserializer: D,
    ) -> Result<SettingsValues, D::Error> {
        let types = world.resource::<AppTypeRegistry>().read();
        let visitor = Values {
            registry: self,
            types: &types,
        };
        deserializer.deserialize_map(visitor).map(SettingsValues)
    }

    /// Whether the world already has all values that [`apply_preset`](Self::apply_preset) would set.
    pub fn has_preset(&self, world: &World, name: &str) -> bool {
        let now = world.resource::<GiSettings>();
        let mut found = false;
        for entry in self.active(now.technique) {
            let (Some(preset), Some(value)) = (entry.preset(name), entry.get(world)) else {
                continue;
            };
            found = true;
            let same = match preset.as_any().downcast_ref::<GiSettings>() {
                Some(preset) => preset.clone().with_scene_of(now) == *now,
                None => preset.reflect_partial_eq(value.as_partial_reflect()) == Some(true),
            };
            if !same {
                return false;
            }
        }
        found
    }

    /// Sets the resources of all techniques and of the current technique to their preset of this name. Fields
    /// that do not affect quality stay, see [`GiSettings::with_scene_of`]. Returns false if no resource has the
    /// preset.
    pub fn apply_preset(&self, world: &mut World, name: &str) -> bool {
        let kept = world.resource::<GiSettings>().clone();
        let mut found = false;
        for entry in self.active(kept.technique) {
            if let (Some(preset), Some(mut value)) = (entry.preset(name), entry.get_mut(world)) {
                value.apply(preset.as_partial_reflect());
                found = true;
            }
        }
        let mut settings = world.resource_mut::<GiSettings>();
        *settings = settings.clone().with_scene_of(&kept);
        found
    }
}

/// Values of settings resources that are not applied yet.
pub struct SettingsValues(Vec<(SettingsEntry, Box<dyn PartialReflect>)>);

impl SettingsValues {
    /// Applies them to a world.
    pub fn apply(&self, world: &mut World) {
        for (entry, value) in &self.0 {
            if let Some(mut resource) = entry.get_mut(world) {
                resource.apply(&**value);
            }
        }
    }
}

/// The reflection serializer, as something that serializes.
struct AsSerialize<'a>(TypedReflectSerializer<'a>);

impl Serialize for AsSerialize<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

struct Values<'a> {
    registry: &'a GiSettingsRegistry,
    types: &'a bevy::reflect::TypeRegistry,
}

impl<'de> Visitor<'de> for Values<'_> {
    type Value = Vec<(SettingsEntry, Box<dyn PartialReflect>)>;

    fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "a map from names of settings resources to settings")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut values = Vec::new();
        while let Some(name) = map.next_key::<String>()? {
            let entry = self.registry.find(&name);
            let registered = entry.and_then(|entry| {
                let id = entry.default_value().as_any().type_id();
                Some((entry, self.types.get(id)?))
            });
            let Some((entry, registration)) = registered else {
                let names: Vec<_> = self.registry.iter().map(|e| e.name).collect();
                warn!(
                    "there is no settings resource '{name}' here, it is left out; there are: {}",
                    names.join(", ")
                );
                map.next_value::<IgnoredAny>()?;
                continue;
            };
            let seed = TypedReflectDeserializer::new(registration, self.types);
            values.push((entry.clone(), map.next_value_seed(seed)?));
        }
        Ok(values)
    }
}

/// Lists a settings resource, clamps it whenever it changes, and sends it to the render world.
pub(crate) struct SettingsResourcePlugin<T> {
    technique: Option<GiTechnique>,
    marker: PhantomData<T>,
}

impl<T> SettingsResourcePlugin<T> {
    /// For one technique.
    pub fn of(technique: GiTechnique) -> Self {
        Self {
            technique: Some(technique),
            ..Self::default()
        }
    }
}

impl<T> Default for SettingsResourcePlugin<T> {
    fn default() -> Self {
        Self {
            technique: None,
            marker: PhantomData,
        }
    }
}

impl<T: SettingsResource> Plugin for SettingsResourcePlugin<T> {
    fn build(&self, app: &mut App) {
        let presets = T::presets().into_iter();
        let entry = SettingsEntry {
            technique: self.technique,
            ranges: Clamp::ranges::<T>(),
            presets: presets
                .map(|(name, value)| (name, Arc::new(value) as Arc<dyn Reflect>))
                .collect(),
            ..SettingsEntry::new::<T>()
        };
        app.init_resource::<GiSettingsRegistry>()
            .world_mut()
            .resource_mut::<GiSettingsRegistry>()
            .add(entry);
        app.init_resource::<T>()
            // After whatever the app does in a frame, and before that is sent.
            .add_systems(Last, clamp_settings::<T>.run_if(resource_changed::<T>))
            .add_plugins(ExtractResourcePlugin::<T>::default());
    }
}

fn clamp_settings<T: SettingsResource>(mut settings: ResMut<T>, statistics: Res<GiStatistics>) {
    // Clamping twice what is already in range would mark it as changed again, for ever.
    let changes = Clamp::apply(T::short_type_path(), settings.bypass_change_detection());
    statistics.warn(changes);
}
