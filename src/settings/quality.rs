//! [`GiQuality`]: quality levels.

use bevy::reflect::prelude::*;
use serde::{Deserialize, Serialize};

use super::parameters::Preset;

/// Quality levels. They exist for cameras, for the capture and for each technique; the inspector and
/// [`GiSettingsRegistry::apply_preset`](crate::GiSettingsRegistry::apply_preset) set all of them at once.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum GiQuality {
    /// Integrated and old GPUs.
    Low,
    /// The default.
    #[default]
    Medium,
    /// Discrete GPUs.
    High,
    /// Screenshots and comparison.
    Ultra,
}

impl GiQuality {
    /// Every level, lowest first.
    pub const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Ultra];

    /// Name of the preset that is not a level: the values of the paper.
    pub(crate) const PAPER: &'static str = "paper";

    /// Lower-case name, as on the command line of the viewer.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Ultra => "ultra",
        }
    }

    /// A preset for each level.
    pub fn presets<T: 'static>(set: fn(&mut T, Self)) -> Vec<Preset<T>> {
        let preset =
            |level: Self| Preset::new(level.name(), move |value: &mut T| set(value, level));
        Self::ALL.map(preset).into()
    }
}
