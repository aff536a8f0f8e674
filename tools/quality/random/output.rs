//! Random scenes as tables: on the terminal, as CSV, as JSON, as Markdown.

use std::{fmt::Write, path::Path};

use bevy_gi_tools::document;
use comfy_table::{Table, presets};
use serde_json::json;

use super::{
    RandomReport,
    distribution::{self, Distribution, RIGHT},
    page,
};
use crate::{
    parts::{RANDOM, TITLE},
    table,
};

/// The header of the table of distributions.
pub const HEADER: [&str; 10] = [
    "technique",
    "preset",
    "figure",
    "scenes",
    "10 %",
    "50 %",
    "90 %",
    "means within 7 %",
    "worst",
    "worst scene",
];

/// A distribution as a row of the table.
pub fn row(d: &Distribution) -> [String; 10] {
    let [low, middle, high] = d.percentiles.map(|value| d.figure.format(value));
    let right = d.right.map(|part| format!("{:.0} %", 100.0 * part));
    [
        d.case.technique.name().into(),
        d.case.preset_name().into(),
        d.figure.name(),
        d.scenes.to_string(),
        low,
        middle,
        high,
        right.unwrap_or_default(),
        d.figure.format(d.worst),
        d.worst_scene.clone(),
    ]
}

fn distributions(report: &RandomReport) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(HEADER);
    for d in distribution::distributions(report) {
        table.add_row(row(&d));
    }
    table
}

pub fn print(report: &RandomReport) {
    println!("{}", distributions(report));
}

/// Writes the page, the tables and, if there is one, the part of the document.
pub fn write(report: &RandomReport, out: &Path, markdown: Option<&Path>) -> Result<(), String> {
    write_csv(report, &out.join("random.csv"))?;
    write_json(report, &out.join("random.json"))?;
    page::write(report, &out.join("random.html"))?;
    match markdown {
        Some(path) => write_markdown(report, path),
        None => Ok(()),
    }
}

/// One line a figure: scene, kind, technique, preset, figure, value.
fn write_csv(report: &RandomReport, path: &Path) -> Result<(), String> {
    // No name holds a comma.
    let mut text = "scene,kind,technique,preset,figure,value\n".to_owned();
    for scene in &report.scenes {
        let (name, kind) = (&scene.name, &scene.kind);
        let _ = writeln!(text, "{name},{kind},reference,,noise,{}", scene.noise);
        for case in &scene.cases {
            let technique = case.case.technique.name();
            let preset = case.case.preset_name();
            for (figure, value) in &case.figures {
                let figure = figure.name().replace(',', "");
                let _ = writeln!(text, "{name},{kind},{technique},{preset},{figure},{value}");
            }
        }
    }
    crate::write(path, &text)
}

/// Everything but the pictures.
fn write_json(report: &RandomReport, path: &Path) -> Result<(), String> {
    let scenes = report.scenes.iter().map(|scene| {
        let cases = scene.cases.iter().map(|case| {
            let figures = case.figures.iter();
            let figures: serde_json::Map<_, _> = figures
                .map(|(figure, value)| (figure.name(), json!(value)))
                .collect();
            json!({
                "technique": case.case.technique.name(),
                "preset": case.case.preset_name(),
                "figures": figures,
            })
        });
        json!({
            "scene": scene.name,
            "kind": scene.kind,
            "about": scene.about,
            "adapter": scene.adapter,
            "noise": scene.noise,
            "cases": cases.collect::<Vec<_>>(),
        })
    });
    let all = json!({
        "seed": report.seed,
        "size": [report.effort.size.x, report.effort.size.y],
        "frames": report.effort.frames,
        "paths": report.effort.paths,
        "resolution": report.effort.resolution,
        "settings": report.settings,
        "distributions": distribution::distributions(report),
        "scenes": scenes.collect::<Vec<_>>(),
    });
    let text = serde_json::to_string_pretty(&all).map_err(|e| e.to_string())?;
    crate::write(path, &text)
}

/// How the figures came about.
pub fn how(report: &RandomReport) -> String {
    let adapter = report.scenes.first().map_or("", |scene| &scene.adapter);
    let conditions = table::conditions(&report.effort, adapter, &report.settings);
    format!(
        "{} scenes of the series {}. {conditions}",
        report.scenes.len(),
        report.seed
    )
}

fn write_markdown(report: &RandomReport, path: &Path) -> Result<(), String> {
    let text = format!(
        "## Random scenes\n\n{}\n\n{}\n\n{}",
        how(report),
        explanation(),
        distributions(report)
    );
    let mut document = document::read(path)?;
    if document.is_empty() {
        document = format!("{}\n", TITLE);
    }
    crate::write(path, &RANDOM.replaced(&document, &text))
}

/// What the figures are.
pub fn explanation() -> String {
    format!(
        "\
Made by `cargo xtask quality --random N --seed S`, which also writes a page with pictures of the worst. The scenes
are drawn by a generator from their seeds: rooms with doorways, corridors with bends, courts, halls with a gallery, halls
of pillars; with walls of 0.05 to 0.5 m, turned by any angle, with furniture, plants, real materials, and one to four
lights of all kinds. The viewer opens each by its name.

The errors of a scene are those of its picture, defined as for the bundled scenes below. Columns are percentiles over
the scenes; a mean is right within {:.0} %. *Leak* is of the same building without openings, with all lamps off, by day: the
mean indirect light in the picture over the luminance of a horizontal surface of the same albedo outside, 0 is right. *Furnace*
is of the same geometry in which all surfaces emit as much as they reflect, under a sky as bright as both: the radiance is
the same everywhere, and what is reflected is known without the path tracer. Its ratio is over the picture; the worst
block is the largest relative error of a mean over 8x8 pixels.",
        100.0 * RIGHT
    )
}
