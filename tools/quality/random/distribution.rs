//! Figures over all random scenes.

use bevy_gi_tools::figures::percentile;
use serde::Serialize;

use super::{Case, CaseReport, RandomReport, RandomSceneReport};
use crate::figure::Figure;

/// What is looked at over all scenes.
pub const FIGURES: [Figure; 6] = [
    Figure::MeanRatio,
    Figure::RelativeRmse,
    Figure::Flip,
    Figure::Leakage,
    Figure::FurnaceMean,
    Figure::FurnaceWorst,
];

/// How far a mean may be off to count as right: a difference that is hardly seen.
pub const RIGHT: f32 = 0.07;

/// A figure of a technique with a preset, over all scenes that have it.
#[derive(Serialize)]
pub struct Distribution {
    pub case: Case,
    pub figure: Figure,
    /// Number of scenes.
    pub scenes: usize,
    /// The 10th, 50th and 90th percentile.
    pub percentiles: [f32; 3],
    /// The value that is farthest off.
    pub worst: f32,
    /// The scene that has it.
    pub worst_scene: String,
    /// Of means: the part of the scenes, 0 to 1, in which they are within [`RIGHT`] of 1.
    pub right: Option<f32>,
}

/// The techniques with their presets, in their order.
pub fn cases(report: &RandomReport) -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    for scene in &report.scenes {
        for case in &scene.cases {
            if !case.case.technique.is_off() && !cases.contains(&case.case) {
                cases.push(case.case.clone());
            }
        }
    }
    cases
}

/// A scene with what a case makes of it, for all scenes.
pub fn of<'a>(
    report: &'a RandomReport,
    case: &'a Case,
) -> impl Iterator<Item = (&'a RandomSceneReport, &'a CaseReport)> {
    report.scenes.iter().filter_map(move |scene| {
        let found = scene.cases.iter().find(|c| c.case == *case)?;
        Some((scene, found))
    })
}

/// All distributions, by technique and preset.
pub fn distributions(report: &RandomReport) -> Vec<Distribution> {
    let mut all = Vec::new();
    for case in cases(report) {
        for figure in FIGURES {
            all.extend(distribution(report, &case, figure));
        }
    }
    all
}

/// `None` if no scene has the figure.
fn distribution(report: &RandomReport, case: &Case, figure: Figure) -> Option<Distribution> {
    let is_mean = matches!(figure, Figure::MeanRatio | Figure::FurnaceMean);
    let ideal = if is_mean { 1.0 } else { 0.0 };
    let off = |value: f32| (value - ideal).abs();
    let values: Vec<(f32, &str)> = of(report, case)
        .filter_map(|(scene, case)| Some((case.get(figure)?, scene.name.as_str())))
        .filter(|(value, _)| !value.is_nan())
        .collect();
    let (worst, worst_scene) = values
        .iter()
        .copied()
        .max_by(|a, b| off(a.0).total_cmp(&off(b.0)))?;
    let mut sorted: Vec<f32> = values.iter().map(|(value, _)| *value).collect();
    sorted.sort_by(f32::total_cmp);
    let right = sorted.iter().filter(|value| off(**value) <= RIGHT).count();
    Some(Distribution {
        case: case.clone(),
        figure,
        scenes: values.len(),
        percentiles: [0.1, 0.5, 0.9].map(|part| percentile(&sorted, part)),
        worst,
        worst_scene: worst_scene.into(),
        right: is_mean.then(|| right as f32 / values.len() as f32),
    })
}

/// The scenes of a case with the largest relative RMSE, the worst first.
pub fn worst<'a>(
    report: &'a RandomReport,
    case: &'a Case,
    count: usize,
) -> Vec<(&'a RandomSceneReport, &'a CaseReport)> {
    let error = |case: &CaseReport| case.get(Figure::RelativeRmse).unwrap_or(0.0);
    let mut all: Vec<_> = of(report, case).collect();
    all.sort_by(|a, b| error(b.1).total_cmp(&error(a.1)));
    all.truncate(count);
    all
}
