//! [`GiTechnique`]: a technique by its name; [`GiTechniques`]: all that an app has.

use std::{
    collections::BTreeSet,
    fmt,
    sync::{Mutex, PoisonError},
};

use bevy::{ecs::prelude::*, reflect::prelude::*};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::gpu::caps::{DeviceNeeds, GiSupport};

/// A technique by its name: which algorithm computes the indirect light.
///
/// [`GiTechniques`] lists those that an app has. Default `"hints"`, radiance hints. Serialized as the name.
#[derive(Reflect, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[reflect(opaque)]
#[reflect(Default, Clone, Debug, Hash, PartialEq, Serialize, Deserialize)]
pub struct GiTechnique(&'static str);

/// Names that were read from files, once each.
static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

impl GiTechnique {
    /// No indirect light: the camera renders as if the plugin were absent.
    pub const OFF: Self = Self("off");

    /// The technique of that name.
    pub const fn new(name: &'static str) -> Self {
        Self(name)
    }

    /// The technique of a name that was read or typed. Whether there is one, [`GiTechniques`] knows.
    pub fn named(name: &str) -> Self {
        let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = names.get(name) {
            return Self(known);
        }
        let name: &'static str = name.to_owned().leak();
        names.insert(name);
        Self(name)
    }

    /// Its name: lower case, as in the viewer's `--technique`, in settings files and in the names of its passes.
    pub const fn name(self) -> &'static str {
        self.0
    }

    /// Whether it is [`OFF`](Self::OFF).
    pub fn is_off(self) -> bool {
        self == Self::OFF
    }
}

impl Default for GiTechnique {
    fn default() -> Self {
        Self("hints")
    }
}

impl fmt::Debug for GiTechnique {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl fmt::Display for GiTechnique {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Serialize for GiTechnique {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.0)
    }
}

impl<'de> Deserialize<'de> for GiTechnique {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(|name| Self::named(&name))
    }
}

/// All techniques of an app, in the order of their plugins. Never empty: [`GiTechnique::OFF`] is the first.
#[derive(Resource, Clone, Debug)]
pub struct GiTechniques {
    entries: Vec<TechniqueEntry>,
}

/// A technique that an app has.
#[derive(Clone, Copy, Debug)]
pub struct TechniqueEntry {
    /// Its name.
    pub technique: GiTechnique,
    /// Its name as a title, for people to read.
    pub title: &'static str,
    /// What it needs of a graphics device.
    pub device: DeviceNeeds,
    /// Names of the debug views that it alone paints.
    pub views: &'static [&'static str],
}

impl Default for GiTechniques {
    fn default() -> Self {
        Self {
            entries: vec![TechniqueEntry {
                technique: GiTechnique::OFF,
                title: "Off",
                device: DeviceNeeds::default(),
                views: &[],
            }],
        }
    }
}

impl GiTechniques {
    /// All, [`GiTechnique::OFF`] first.
    pub fn iter(&self) -> impl Iterator<Item = &TechniqueEntry> {
        self.entries.iter()
    }

    /// All but [`GiTechnique::OFF`].
    pub fn on(&self) -> impl Iterator<Item = &TechniqueEntry> {
        self.iter().filter(|entry| !entry.technique.is_off())
    }

    /// Adds one; what has its name is replaced.
    pub fn add(&mut self, entry: TechniqueEntry) {
        self.entries.retain(|old| old.technique != entry.technique);
        self.entries.push(entry);
    }

    /// The entry of a technique, if there is one of that name.
    pub fn get(&self, technique: GiTechnique) -> Option<&TechniqueEntry> {
        self.iter().find(|entry| entry.technique == technique)
    }

    /// The title of a technique; its name if there is none of that name.
    pub fn title(&self, technique: GiTechnique) -> &'static str {
        self.get(technique)
            .map_or(technique.name(), |entry| entry.title)
    }

    /// The technique of that name, if there is one.
    ///
    /// # Errors
    /// A sentence that names all there are.
    pub fn find(&self, name: &str) -> Result<GiTechnique, String> {
        let mut all = self.iter().map(|entry| entry.technique);
        all.find(|technique| technique.name() == name)
            .ok_or_else(|| {
                let names: Vec<_> = self.iter().map(|entry| entry.technique.name()).collect();
                format!("no technique '{name}'; there are {}", names.join(", "))
            })
    }
}

impl GiSupport {
    /// One sentence where this technique cannot run: what is missing; `None` where it can.
    pub fn technique(&self, technique: GiTechnique) -> Option<&str> {
        match technique {
            GiTechnique::OFF => None,
            _ => self.reason_of(technique.name()),
        }
    }

    /// What a camera with this technique shows: that, or [`GiTechnique::OFF`] where it cannot run.
    pub fn in_force(&self, technique: GiTechnique) -> GiTechnique {
        match self.technique(technique) {
            Some(_) => GiTechnique::OFF,
            None => technique,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn techniques_are_found_by_name() {
        let mut techniques = GiTechniques::default();
        techniques.add(TechniqueEntry {
            technique: GiTechnique::new("cubes"),
            title: "Ambient cubes",
            device: DeviceNeeds::default(),
            views: &[],
        });
        assert_eq!(techniques.find("cubes"), Ok(GiTechnique::named("cubes")));
        assert_eq!(techniques.find("off"), Ok(GiTechnique::OFF));
        let error = techniques.find("cube").unwrap_err();
        assert_eq!(error, "no technique 'cube'; there are off, cubes");
        assert_eq!(techniques.title(GiTechnique::new("cubes")), "Ambient cubes");
        assert_eq!(techniques.on().count(), 1);
    }

    #[test]
    fn names_are_written_as_strings() {
        let technique = GiTechnique::named(&String::from("cubes"));
        assert_eq!(ron::to_string(&technique).unwrap(), "\"cubes\"");
        let read: GiTechnique = ron::from_str("\"cubes\"").unwrap();
        assert_eq!(read, technique);
    }
}
