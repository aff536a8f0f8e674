//! The page: pictures, maps of errors, plots and tables in one file.

use std::{collections::BTreeSet, path::Path};

use bevy_gi::GiTechnique;
use bevy_gi_tools::plot::{self, Line};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::{
    figure::{Figure, Seen},
    measure::{Report, SceneReport, TechniqueReport},
    table::{self, PICTURE},
};

/// How all pages look.
const STYLE: &str = "
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 1400px; padding: 0 1rem;
  color: #222; background: #fafafa }
h1, h2 { line-height: 1.2 } h2 { margin-top: 3rem }
table { border-collapse: collapse; background: #fff }
th, td { border: 1px solid #ddd; padding: .25rem .6rem; text-align: right; white-space: nowrap }
th { background: #f0f0f0 } td:first-child, td:nth-child(2), th:first-child { text-align: left }
tr.off td { color: #999 }
.scroll { overflow-x: auto }
.row { display: flex; flex-wrap: wrap; gap: .8rem; margin: .8rem 0 }
figure { margin: 0 } figcaption { font-size: 13px; color: #555 }
img { width: 320px; image-rendering: pixelated; display: block; background: #000 }
nav a { margin-right: .8rem } .good { background: #e3f4e3 } .bad { background: #fbe3e0 }
";

pub fn write(report: &Report, path: &Path) -> Result<(), String> {
    crate::write(path, &page(report).into_string())
}

/// A page under a title: how it was measured, what the figures are, and the content.
pub fn framed(title: &str, how: &str, explanation: &str, content: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                p { (how) }
                @for paragraph in explanation.split("\n\n") {
                    p { (paragraph.replace(['*', '`'], "")) }
                }
                (content)
            }
        }
    }
}

fn page(report: &Report) -> Markup {
    let content = html! {
        p {
            "Maps of errors: blue is too dark, red is too bright, white is right; full colour is an \
             error of 100 %. Maps of FLIP: black is the same, white is wholly different. The folder \
             exr beside this page holds all luminances in nits, from which every figure of a picture \
             follows."
        }
        nav {
            @for scene in &report.scenes {
                a href={ "#" (scene.name) } { (scene.name) }
            }
        }
        h2 { "All scenes" }
        (overview(report))
        div.row { (PreEscaped(spread(report))) }
        @for scene in &report.scenes { (section(scene)) }
    };
    framed(
        "bevy_gi: quality",
        &table::how(report),
        table::EXPLANATION,
        &content,
    )
}

fn overview(report: &Report) -> Markup {
    html! {
        div.scroll { table {
            tr {
                th { "scene" } th { "technique" }
                @for figure in PICTURE { th { (figure.name()) } }
                th { "noise of the truth" }
            }
            @for scene in &report.scenes { @for technique in &scene.techniques {
                tr.off[technique.technique == GiTechnique::OFF] {
                    td { a href={ "#" (scene.name) } { (scene.name) } }
                    td { (technique.technique.name()) }
                    @for figure in PICTURE {
                        @let value = technique.get(figure);
                        td class=[grade(technique, figure)] {
                            (value.map_or(String::new(), |v| figure.format(v)))
                        }
                    }
                    td { (format!("{:.3}", scene.noise)) }
                }
            } }
        } }
    }
}

/// The project's goals: a mean within 15 %, a relative RMSE under 0.35.
fn grade(technique: &TechniqueReport, figure: Figure) -> Option<&'static str> {
    if technique.technique == GiTechnique::OFF {
        return None;
    }
    let value = technique.get(figure)?;
    let good = match figure {
        Figure::MeanRatio => (value - 1.0).abs() < 0.15,
        Figure::RelativeRmse => value < 0.35,
        _ => return None,
    };
    Some(if good { "good" } else { "bad" })
}

/// Relative RMSE over the scenes, of each technique.
fn spread(report: &Report) -> String {
    let all = report.scenes.iter().flat_map(|scene| &scene.techniques);
    let all: BTreeSet<_> = all.map(|report| report.technique).collect();
    let lines: Vec<Line> = all
        .into_iter()
        .filter(|technique| !technique.is_off())
        .map(|wanted| {
            let errors = report.scenes.iter().flat_map(|scene| &scene.techniques);
            let errors = errors.filter(|t| t.technique == wanted);
            Line {
                name: wanted.name().into(),
                points: cumulative(errors.flat_map(|t| &t.errors).copied()),
            }
        })
        .collect();
    errors_plot("blocks of all scenes", &lines)
}

/// Part of the values whose size is below x, as points of a line.
fn cumulative(errors: impl Iterator<Item = f32>) -> Vec<(f32, f32)> {
    let mut sorted: Vec<f32> = errors.map(f32::abs).collect();
    sorted.sort_by(f32::total_cmp);
    let n = sorted.len().max(1) as f32;
    let part = |x: f32| sorted.partition_point(|e| *e <= x) as f32 / n;
    (0..=100)
        .map(|i| i as f32 / 100.0)
        .map(|x| (x, part(x)))
        .collect()
}

fn errors_plot(title: &str, lines: &[Line]) -> String {
    let axes = ["relative error of indirect light", "part of blocks below"];
    plot::lines(title, axes, [0.0, 1.0], [0.0, 1.0], lines)
}

/// A picture with what it is.
pub fn picture(picture: &Seen, caption: &str) -> Markup {
    html! {
        figure {
            img src={ "data:image/png;base64," (picture.0) } alt=(caption);
            figcaption { (caption) }
        }
    }
}

fn section(scene: &SceneReport) -> Markup {
    let errors: Vec<Line> = scene
        .techniques
        .iter()
        .map(|t| Line {
            name: t.technique.name().into(),
            points: cumulative(t.errors.iter().copied()),
        })
        .collect();
    html! {
        h2 id=(scene.name) { (scene.name) }
        p { (scene.about) "." }
        div.row {
            (picture(&scene.truth[0], "the truth"))
            (picture(&scene.truth[1], "the truth, indirect light"))
        }
        @for technique in &scene.techniques {
            @let name = technique.technique.name();
            div.row {
                (picture(&technique.seen[0], name))
                (picture(&technique.seen[1], &format!("{name}, indirect light")))
                @if let Some(map) = &technique.heat_map {
                    (picture(map, &format!("{name}, error of indirect light")))
                }
                (picture(&technique.flip_map, &format!("{name}, FLIP")))
            }
        }
        div.row {
            (PreEscaped(errors_plot(&scene.name, &errors)))
            (curves(scene))
        }
        (others(scene))
    }
}

/// How light follows what changes.
fn curves(scene: &SceneReport) -> Markup {
    let lines: Vec<Line> = scene
        .techniques
        .iter()
        .flat_map(|t| {
            t.curves
                .iter()
                .map(|(what, curve)| (t.technique.name(), what, curve))
        })
        .map(|(name, what, curve)| Line {
            name: format!("{name}, {what}"),
            points: (0..)
                .map(|i| i as f32)
                .zip(curve.distances.iter().copied())
                .collect(),
        })
        .collect();
    if lines.is_empty() {
        return html! {};
    }
    let axes = ["frames", "way to go"];
    let frames = lines.iter().map(|l| l.points.len()).max().unwrap_or(1);
    let svg = plot::lines(&scene.name, axes, [0.0, frames as f32], [0.0, 1.0], &lines);
    html! { (PreEscaped(svg)) }
}

/// All figures that are not of settled pictures.
fn others(scene: &SceneReport) -> Markup {
    let rows: Vec<_> = scene
        .techniques
        .iter()
        .flat_map(|t| t.figures.iter().map(|(f, v)| (t.technique.name(), *f, *v)))
        .filter(|(_, figure, _)| !figure.is_of_picture())
        .collect();
    if rows.is_empty() {
        return html! {};
    }
    html! {
        div.scroll { table {
            tr { th { "technique" } th { "figure" } th { "value" } }
            @for (name, figure, value) in rows {
                tr { td { (name) } td { (figure.name()) } td { (figure.format(value)) } }
            }
        } }
    }
}
