//! [`GiSettingsRegistry`]: the list of all [`Parameters`].

use std::sync::Arc;

use bevy::{
    ecs::{prelude::*, world::Mut},
    log::warn,
    reflect::{
        PartialReflect, Reflect, TypeInfo,
        serde::{TypedReflectDeserializer, TypedReflectSerializer},
    },
};
use serde::{
    Deserializer, Serialize, Serializer,
    de::{IgnoredAny, MapAccess, Visitor},
    ser::SerializeMap,
};

use super::{
    GiSettings, GiTechnique,
    parameters::{FieldRange, Parameters, ParametersKind},
};

/// All [`Parameters`] of an app, resources and components: those of the crate, those of each technique, and those
/// that an app adds by [`SettingsResourcePlugin`](crate::SettingsResourcePlugin) and
/// [`SettingsComponentPlugin`](crate::SettingsComponentPlugin).
#[derive(Resource, Default, Clone)]
pub struct GiSettingsRegistry {
    entries: Vec<SettingsEntry>,
}

/// Changes a value of a type that is not known.
type Change = Arc<dyn Fn(&mut dyn Reflect) + Send + Sync>;

/// [`Parameters`] of any type.
///
/// A resource is a component of an entity of its own, so that both have the same functions here.
#[derive(Clone)]
pub struct SettingsEntry {
    /// Name of the type, without its path.
    pub name: &'static str,
    /// Where they are.
    pub kind: ParametersKind,
    /// The technique that they belong to. `None`: all techniques.
    pub technique: Option<GiTechnique>,
    /// Whether they choose what debug views show.
    pub is_debug: bool,
    /// Ranges of the numeric fields.
    pub ranges: Vec<FieldRange>,
    legend: fn(&dyn Reflect) -> Option<&'static str>,
    presets: Vec<(&'static str, Change)>,
    default: Arc<dyn Reflect>,
    entities: fn(&World) -> Vec<Entity>,
    saved: fn(&World) -> Option<Entity>,
    get: fn(&World, Entity) -> Option<&dyn Reflect>,
    get_mut: fn(&mut World, Entity) -> Option<Mut<'_, dyn Reflect>>,
    load: fn(&mut dyn Reflect, &dyn PartialReflect),
    insert: fn(&mut World, Entity),
    remove: fn(&mut World, Entity),
    observe: fn(&mut World, Change),
}

impl SettingsEntry {
    /// An entry for `T`.
    pub fn new<T: Parameters>() -> Self {
        let presets = T::presets().into_iter().map(|preset| {
            let set = preset.set;
            let set = move |value: &mut dyn Reflect| {
                if let Some(value) = value.downcast_mut::<T>() {
                    set(value);
                }
            };
            (preset.name, Arc::new(set) as Change)
        });
        Self {
            name: T::short_type_path(),
            kind: T::KIND,
            technique: None,
            is_debug: false,
            ranges: T::ranges(),
            legend: |value| value.downcast_ref::<T>()?.legend(),
            presets: presets.collect(),
            default: Arc::new(T::default()),
            entities: |world| {
                let query = world.try_query_filtered::<Entity, With<T>>();
                query.map_or_else(Vec::new, |mut query| query.iter(world).collect())
            },
            saved: T::saved_entity,
            get: |world, entity| world.get::<T>(entity).map(|value| value as &dyn Reflect),
            get_mut: |world, entity| {
                let value = world.get_mut::<T>(entity)?;
                Some(value.map_unchanged(|value| value as &mut dyn Reflect))
            },
            load: |value, saved| {
                if let (Some(value), Some(saved)) =
                    (value.downcast_mut::<T>(), T::from_reflect(saved))
                {
                    value.load(saved);
                }
            },
            insert: |world, entity| {
                if let Ok(mut entity) = world.get_entity_mut(entity) {
                    entity.insert(T::default());
                }
            },
            remove: |world, entity| {
                if let Ok(mut entity) = world.get_entity_mut(entity) {
                    entity.remove::<T>();
                }
            },
            observe: |world, change| {
                world.add_observer(move |insert: On<Insert, T>, mut values: Query<&mut T>| {
                    if let Ok(mut value) = values.get_mut(insert.entity) {
                        change(&mut *value);
                    }
                });
            },
        }
    }

    /// The default, to which fields are reset.
    pub fn default_value(&self) -> &dyn Reflect {
        &*self.default
    }

    /// Documentation of the type and of its fields.
    pub fn info(&self) -> &'static TypeInfo {
        self.default.reflect_type_info()
    }

    /// Of debug settings: meaning of the colours of what they add to the picture now.
    pub fn legend(&self, world: &World) -> Option<&'static str> {
        (self.legend)(self.get(world)?)
    }

    /// Names of the presets.
    pub fn presets(&self) -> impl Iterator<Item = &'static str> {
        self.presets.iter().map(|(name, _)| *name)
    }

    /// Applies a preset to a value of the type. Returns false if there is no such preset.
    pub fn apply_preset(&self, name: &str, value: &mut dyn Reflect) -> bool {
        let preset = self.presets.iter().find(|(n, _)| *n == name);
        if let Some((_, set)) = preset {
            set(value);
        }
        preset.is_some()
    }

    /// The entities that have such parameters: all of them for a component, one or none for a resource.
    pub fn entities(&self, world: &World) -> Vec<Entity> {
        (self.entities)(world)
    }

    /// The parameters of an entity, if it has such.
    pub fn get_of<'w>(&self, world: &'w World, entity: Entity) -> Option<&'w dyn Reflect> {
        (self.get)(world, entity)
    }

    /// The parameters of an entity, if it has such. They count as changed once they are written to.
    pub fn get_mut_of<'w>(
        &self,
        world: &'w mut World,
        entity: Entity,
    ) -> Option<Mut<'w, dyn Reflect>> {
        (self.get_mut)(world, entity)
    }

    /// The resource, or the component of the entity that settings files are saved from.
    pub fn get<'w>(&self, world: &'w World) -> Option<&'w dyn Reflect> {
        self.get_of(world, (self.saved)(world)?)
    }

    /// As [`get`](Self::get). It counts as changed once it is written to.
    pub fn get_mut<'w>(&self, world: &'w mut World) -> Option<Mut<'w, dyn Reflect>> {
        let entity = (self.saved)(world)?;
        self.get_mut_of(world, entity)
    }

    /// Inserts the default into an entity. For components only.
    pub fn insert(&self, world: &mut World, entity: Entity) {
        if self.kind != ParametersKind::Resource {
            (self.insert)(world, entity);
        }
    }

    /// Takes the component from an entity. For components only.
    pub fn remove(&self, world: &mut World, entity: Entity) {
        if self.kind != ParametersKind::Resource {
            (self.remove)(world, entity);
        }
    }

    /// Changes the parameters of all entities that have such.
    pub fn change_all(&self, world: &mut World, change: impl Fn(&mut dyn Reflect)) {
        for entity in self.entities(world) {
            if let Some(mut value) = self.get_mut_of(world, entity) {
                change(&mut *value);
            }
        }
    }

    /// Changes the parameters of all entities that have such, and of components also those that are inserted later.
    pub fn change_always(
        &self,
        world: &mut World,
        change: impl Fn(&mut dyn Reflect) + Send + Sync + 'static,
    ) {
        self.change_all(world, &change);
        if self.kind != ParametersKind::Resource {
            (self.observe)(world, Arc::new(change));
        }
    }
}

impl GiSettingsRegistry {
    /// All entries, in the order of the plugins.
    pub fn iter(&self) -> impl Iterator<Item = &SettingsEntry> {
        self.entries.iter()
    }

    /// The entries that choose what debug views show, of all techniques and of this one.
    pub fn debug(&self, technique: GiTechnique) -> impl Iterator<Item = &SettingsEntry> {
        self.active(technique).filter(|entry| entry.is_debug)
    }

    /// The entries that are resources.
    pub fn resources(&self) -> impl Iterator<Item = &SettingsEntry> {
        self.iter()
            .filter(|entry| entry.kind == ParametersKind::Resource)
    }

    /// The entries that are components.
    pub fn components(&self) -> impl Iterator<Item = &SettingsEntry> {
        self.iter()
            .filter(|entry| entry.kind != ParametersKind::Resource)
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
    /// `{"GiSettings": (replace_ambient: true, ..), "GiCamera": (history_frames: 32, ..), ..}`. Components of the
    /// scene are left out. Of cameras, the primary one stands for all.
    pub fn serialize<S: Serializer>(
        &self,
        world: &World,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let types = world.resource::<AppTypeRegistry>().read();
        let saved = self.iter().filter(|e| e.kind != ParametersKind::Scene);
        let saved = saved.filter_map(|entry| Some((entry.name, entry.get(world)?)));
        let saved: Vec<_> = saved.collect();
        let mut map = serializer.serialize_map(Some(saved.len()))?;
        for (name, value) in saved {
            let value = TypedReflectSerializer::new(value.as_partial_reflect(), &types);
            map.serialize_entry(name, &AsSerialize(value))?;
        }
        map.end()
    }

    /// Reads a map that [`serialize`](Self::serialize) has written. Types that it leaves out are not in the
    /// result. Fields that a value leaves out have their default. Types that the app does not have are skipped
    /// with a warning.
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
        let technique = world.resource::<GiSettings>().technique;
        let mut found = false;
        for entry in self.active(technique) {
            for entity in entry.entities(world) {
                let value = entry.get_of(world, entity);
                let Some(Ok(mut preset)) = value.map(|value| value.reflect_clone()) else {
                    continue;
                };
                if !entry.apply_preset(name, &mut *preset) {
                    continue;
                }
                found = true;
                let same =
                    value.and_then(|now| preset.reflect_partial_eq(now.as_partial_reflect()));
                if same != Some(true) {
                    return false;
                }
            }
        }
        found
    }

    /// Applies the preset of this name to the parameters of all cameras, of the capture, and of the current
    /// technique: to all that have such a preset. Fields that are no matter of quality stay, such as the technique.
    /// Returns false if there is no such preset.
    pub fn apply_preset(&self, world: &mut World, name: &str) -> bool {
        let technique = world.resource::<GiSettings>().technique;
        let mut found = false;
        for entry in self.active(technique) {
            if entry.presets().any(|n| n == name) {
                found = true;
                entry.change_all(world, |value| {
                    entry.apply_preset(name, value);
                });
            }
        }
        found
    }
}

/// Values of [`Parameters`] that are not applied yet.
pub struct SettingsValues(Vec<(SettingsEntry, Box<dyn PartialReflect>)>);

impl SettingsValues {
    /// Applies them to a world: to resources, and to components of all entities that have such.
    pub fn apply(&self, world: &mut World) {
        for (entry, value) in &self.0 {
            entry.change_all(world, |now| (entry.load)(now, &**value));
        }
    }

    /// Applies them to a world, and also to components that are inserted later.
    pub fn apply_always(self, world: &mut World) {
        for (entry, value) in self.0 {
            let load = entry.load;
            entry.change_always(world, move |now| load(now, &*value));
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
        write!(f, "a map from names of settings to their values")
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
                    "there are no settings '{name}' here, they are left out; there are: {}",
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
