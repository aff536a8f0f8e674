//! Scenes that are drawn at random: measured, and as distributions.

mod distribution;
mod measure;
mod output;
mod page;

use bevy_gi::GiTechnique;
use bevy_gi_tools::quality::Effort;
use serde::{Deserialize, Serialize};

pub use measure::measure;
pub use output::{print, write};

use crate::figure::{Figure, Seen, find};

/// Everything that was measured in random scenes.
pub struct RandomReport {
    /// Of the series of scenes.
    pub seed: u64,
    pub effort: Effort,
    /// Settings that are not the default ones, as on the command line.
    pub settings: Vec<String>,
    pub scenes: Vec<RandomSceneReport>,
}

#[derive(Serialize, Deserialize)]
pub struct RandomSceneReport {
    /// As on the viewer's command line.
    pub name: String,
    pub kind: String,
    pub about: String,
    /// Name and driver of the GPU.
    pub adapter: String,
    pub truth: Seen,
    /// Relative RMSE of the truth itself.
    pub noise: f32,
    /// With the technique off first.
    pub cases: Vec<CaseReport>,
}

/// A technique with a preset.
#[derive(Serialize, Deserialize, Clone, Debug, PartialEq, Eq)]
pub struct Case {
    pub technique: GiTechnique,
    /// `None`: the settings as they are.
    pub preset: Option<String>,
}

impl Case {
    /// Name of the preset, as in tables.
    pub fn preset_name(&self) -> &str {
        self.preset.as_deref().unwrap_or(DEFAULT)
    }
}

/// What the settings as they are are called where a preset is named.
pub const DEFAULT: &str = "default";

#[derive(Serialize, Deserialize)]
pub struct CaseReport {
    pub case: Case,
    pub seen: Seen,
    pub figures: Vec<(Figure, f32)>,
}

impl CaseReport {
    pub fn get(&self, figure: Figure) -> Option<f32> {
        find(&self.figures, figure)
    }
}
