//! What is measured, and how it is written.

use base64::{Engine, prelude::BASE64_STANDARD};
use bevy_gi_tools::{capture, headless::Picture, quality::WALLS};
use serde::{Deserialize, Serialize};

/// A picture as it is seen: a PNG file, in base 64.
#[derive(Serialize, Deserialize)]
pub struct Seen(pub String);

impl From<&Picture> for Seen {
    fn from(picture: &Picture) -> Self {
        Self(BASE64_STANDARD.encode(capture::png(picture)))
    }
}

/// What is measured.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    MeanRatio,
    RelativeRmse,
    MedianError,
    Flip,
    GpuMs,
    MemoryMib,
    Still,
    Pan,
    ReactionOff,
    ReactionOn,
    Lag,
    Settling,
    Jump,
    /// By the wall's index in [`WALLS`].
    Leak(usize),
    /// Of a random scene that is sealed: indirect light in its picture, over the light of a surface outside.
    Leakage,
    /// Of a random scene as a furnace: reflected light over what it must be.
    FurnaceMean,
    /// The largest relative error of a block of it.
    FurnaceWorst,
}

impl Figure {
    /// As in tables.
    pub fn name(self) -> String {
        match self {
            Self::MeanRatio => "mean ratio".into(),
            Self::RelativeRmse => "relative RMSE".into(),
            Self::MedianError => "median error".into(),
            Self::Flip => "FLIP".into(),
            Self::GpuMs => "GI, ms a frame".into(),
            Self::MemoryMib => "GI, MiB".into(),
            Self::Still => "still picture: temporal deviation".into(),
            Self::Pan => "slow pan: largest change a frame".into(),
            Self::ReactionOff => "lamp off: frames to 90 %".into(),
            Self::ReactionOn => "lamp on: frames to 90 %".into(),
            Self::Lag => "moving: relative RMSE to the settled picture".into(),
            Self::Settling => "after moving: frames to 90 %".into(),
            Self::Jump => "moved at once: frames to 90 %".into(),
            Self::Leak(wall) => format!("leak through {} voxels of wall", WALLS[wall]),
            Self::Leakage => "leak".into(),
            Self::FurnaceMean => "furnace: mean ratio".into(),
            Self::FurnaceWorst => "furnace: worst block".into(),
        }
    }

    pub fn format(self, value: f32) -> String {
        match self {
            Self::Still | Self::Pan | Self::Leak(_) => format!("{:.2} %", 100.0 * value),
            Self::Leakage => format!("{:.4} %", 100.0 * value),
            Self::ReactionOff | Self::ReactionOn | Self::Settling | Self::Jump => {
                format!("{value:.0}")
            }
            Self::GpuMs | Self::MemoryMib => format!("{value:.1}"),
            _ => format!("{value:.3}"),
        }
    }

    /// Whether it belongs into the table of errors, of which each scene is a row.
    pub fn is_of_picture(self) -> bool {
        matches!(
            self,
            Self::MeanRatio
                | Self::RelativeRmse
                | Self::MedianError
                | Self::Flip
                | Self::GpuMs
                | Self::MemoryMib
        )
    }
}

/// A figure among several.
pub fn find(figures: &[(Figure, f32)], figure: Figure) -> Option<f32> {
    let found = figures.iter().find(|(f, _)| *f == figure);
    found.map(|(_, value)| *value)
}
