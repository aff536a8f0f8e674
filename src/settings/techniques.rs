//! [`GiTechnique`]: a technique by its name; [`GiTechniques`]: all that an app has.

use bevy::{ecs::prelude::*, reflect::prelude::*};

use super::name::{self, name_type};
use crate::gpu::caps::{DeviceNeeds, GiSupport};

/// Name of a technique: the algorithm that computes indirect light.
///
/// [`GiTechniques`] lists those that an app has. Where the technique's type is at hand, use [`GiTechnique::of`]. A name is
/// also part of the names of the technique's passes, and [`GiTechniques::find`] checks that it exists. Default `"hints"`,
/// radiance hints. Serialized as the name.
#[derive(Reflect, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[reflect(opaque)]
#[reflect(Default, Clone, Debug, Hash, PartialEq, Serialize, Deserialize)]
pub struct GiTechnique(&'static str);

impl GiTechnique {
    /// No indirect light: the camera renders as if the plugin were absent.
    pub const OFF: Self = Self("off");

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

name_type!(GiTechnique);

/// All techniques of an app, in the order of their plugins. Never empty: [`GiTechnique::OFF`] comes first.
#[derive(Resource, Clone, Debug)]
pub struct GiTechniques {
    entries: Vec<TechniqueEntry>,
}

/// Where the gather of a technique looks light up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lookup {
    /// In the [`Cache`](crate::technique::Cache) of each volume that the camera sees: one pass a volume. Volumes
    /// blend at their borders.
    #[default]
    PerVolume,
    /// In the [`ViewCache`](crate::technique::ViewCache) of the camera: one pass. Group 1 is that of the finest volume
    /// that the camera sees, and without any volume there is no light.
    PerView,
}

/// A registered technique.
#[derive(Clone, Copy, Debug)]
pub struct TechniqueEntry {
    /// Its name.
    pub technique: GiTechnique,
    /// Its title, as shown to users.
    pub title: &'static str,
    /// What it requires of the graphics device.
    pub device: DeviceNeeds,
    /// Where its gather looks light up.
    pub lookup: Lookup,
}

impl Default for GiTechniques {
    fn default() -> Self {
        Self {
            entries: vec![TechniqueEntry {
                technique: GiTechnique::OFF,
                title: "Off",
                device: DeviceNeeds::default(),
                lookup: Lookup::default(),
            }],
        }
    }
}

impl GiTechniques {
    /// All techniques, [`GiTechnique::OFF`] first.
    pub fn iter(&self) -> impl Iterator<Item = &TechniqueEntry> {
        self.entries.iter()
    }

    /// All techniques but [`GiTechnique::OFF`].
    pub fn on(&self) -> impl Iterator<Item = &TechniqueEntry> {
        self.iter().filter(|entry| !entry.technique.is_off())
    }

    /// Adds a technique. An entry of the same name is replaced.
    pub fn add(&mut self, entry: TechniqueEntry) {
        self.entries.retain(|old| old.technique != entry.technique);
        self.entries.push(entry);
    }

    /// The entry of a technique, if it is registered.
    pub fn get(&self, technique: GiTechnique) -> Option<&TechniqueEntry> {
        self.iter().find(|entry| entry.technique == technique)
    }

    /// The title of a technique; its name if it is not registered.
    pub fn title(&self, technique: GiTechnique) -> &'static str {
        self.get(technique)
            .map_or(technique.name(), |entry| entry.title)
    }

    /// The technique with this name, if it is registered.
    ///
    /// # Errors
    /// A sentence that lists all names.
    pub fn find(&self, name: &str) -> Result<GiTechnique, String> {
        let all = self.iter().map(|entry| entry.technique);
        name::find("technique", all, GiTechnique::name, name)
    }
}

impl GiSupport {
    /// Why a technique cannot run on this device, in one sentence; `None` if it can.
    pub fn technique(&self, technique: GiTechnique) -> Option<&str> {
        match technique {
            GiTechnique::OFF => None,
            _ => self.reason_of(technique.name()),
        }
    }

    /// The technique that a camera shows if it asks for this one: the same, or [`GiTechnique::OFF`] where the
    /// device cannot run it.
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
            lookup: Lookup::default(),
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
