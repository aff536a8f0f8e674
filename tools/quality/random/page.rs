//! The page of random scenes: distributions, and the worst with pictures.

use std::path::Path;

use bevy_gi_tools::plot::{self, Line};
use maud::{Markup, PreEscaped, html};

use super::{
    Case, CaseReport, RandomReport, RandomSceneReport,
    distribution::{self, FIGURES, cases, distributions, worst},
    output::{HEADER, explanation, how, row},
};
use crate::{
    figure::Figure,
    report::{framed, picture},
};

/// Number of scenes of each technique and preset that are shown.
const SHOWN: usize = 5;

pub fn write(report: &RandomReport, path: &Path) -> Result<(), String> {
    crate::write(path, &page(report).into_string())
}

fn page(report: &RandomReport) -> Markup {
    let cases = cases(report);
    let content = html! {
        h2 { "Distributions" }
        div.scroll { table {
            tr { @for name in HEADER { th { (name) } } }
            @for d in distributions(report) {
                tr { @for cell in row(&d) { td { (cell) } } }
            }
        } }
        div.row {
            (PreEscaped(spread(report, &cases, Figure::MeanRatio, 2.0)))
            (PreEscaped(spread(report, &cases, Figure::RelativeRmse, 1.0)))
        }
        @for case in &cases {
            h2 { (title(case)) ": the worst by relative RMSE" }
            @for (scene, found) in worst(report, case, SHOWN) {
                (shown(scene, found))
            }
        }
        h2 { "All scenes" }
        (all(report))
    };
    framed(
        "bevy_gi: quality in random scenes",
        &how(report),
        &explanation(),
        &content,
    )
}

fn title(case: &Case) -> String {
    format!("{}, {}", case.technique.name(), case.preset_name())
}

/// Part of the scenes in which a figure is below x, a line for each technique and preset.
fn spread(report: &RandomReport, cases: &[Case], figure: Figure, most: f32) -> String {
    let line = |case: &Case| {
        let values = distribution::of(report, case).filter_map(|(_, found)| found.get(figure));
        let values: Vec<f32> = values.collect();
        let part = |x: f32| {
            let below = values.iter().filter(|value| **value <= x).count();
            below as f32 / values.len().max(1) as f32
        };
        let points = (0..=100).map(|i| most * i as f32 / 100.0);
        Line {
            name: title(case),
            points: points.map(|x| (x, part(x))).collect(),
        }
    };
    let lines: Vec<Line> = cases.iter().map(line).collect();
    let name = figure.name();
    let axes = [name.as_str(), "part of scenes below"];
    plot::lines(&name, axes, [0.0, most], [0.0, 1.0], &lines)
}

/// A scene without global illumination, with a technique, and the truth.
fn shown(scene: &RandomSceneReport, found: &CaseReport) -> Markup {
    let figures = found.figures.iter();
    let figures: Vec<_> = figures
        .map(|(figure, value)| format!("{} {}", figure.name(), figure.format(*value)))
        .collect();
    let off = scene.cases.iter().find(|c| c.case.technique.is_off());
    html! {
        h3 { (scene.name) " (" (scene.kind) ")" }
        p { (scene.about) "." br; (figures.join("; ")) "." }
        div.row {
            @if let Some(off) = off { (picture(&off.seen, "off")) }
            (picture(&found.seen, &title(&found.case)))
            (picture(&scene.truth, "the truth"))
        }
    }
}

/// What was found in every scene.
fn all(report: &RandomReport) -> Markup {
    html! {
        div.scroll { table {
            tr {
                th { "scene" } th { "technique" } th { "kind" }
                @for figure in FIGURES { th { (figure.name()) } }
                th { "noise of the truth" }
            }
            @for scene in &report.scenes { @for case in &scene.cases {
                tr.off[case.case.technique.is_off()] {
                    td { (scene.name) }
                    td { (title(&case.case)) }
                    td { (scene.kind) }
                    @for figure in FIGURES {
                        td { (case.get(figure).map_or(String::new(), |v| figure.format(v))) }
                    }
                    td { (format!("{:.3}", scene.noise)) }
                }
            } }
        } }
    }
}
