//! The figures as tables: on the terminal, as CSV, as Markdown.

use std::{fmt::Write, path::Path, time::SystemTime};

use bevy_gi_tools::{document, quality::Effort};
use comfy_table::{Table, presets};

use crate::{
    figure::Figure,
    measure::Report,
    parts::{BUNDLED, RANDOM, TITLE},
};

/// Columns of the table of errors.
pub const PICTURE: [Figure; 6] = [
    Figure::MeanRatio,
    Figure::RelativeRmse,
    Figure::MedianError,
    Figure::Flip,
    Figure::GpuMs,
    Figure::MemoryMib,
];

/// Each scene with each technique: errors of the settled picture, and what it costs.
fn pictures(report: &Report) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let mut header = vec!["scene".to_owned(), "technique".into()];
    header.extend(PICTURE.map(Figure::name));
    header.push("noise of the truth".into());
    table.set_header(header);
    for scene in &report.scenes {
        for technique in &scene.techniques {
            let mut row = vec![scene.name.clone(), technique.technique.name().into()];
            row.extend(PICTURE.map(|figure| {
                let value = technique.get(figure);
                value.map_or(String::new(), |value| figure.format(value))
            }));
            row.push(format!("{:.3}", scene.noise));
            table.add_row(row);
        }
    }
    table
}

/// All that is not an error of a settled picture.
fn others(report: &Report) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(["scene", "technique", "figure", "value"]);
    for scene in &report.scenes {
        for technique in &scene.techniques {
            let others = technique.figures.iter().filter(|(f, _)| !f.is_of_picture());
            for (figure, value) in others {
                table.add_row([
                    scene.name.clone(),
                    technique.technique.name().into(),
                    figure.name(),
                    figure.format(*value),
                ]);
            }
        }
    }
    table
}

pub fn print(report: &Report) {
    println!("{}\n\n{}", pictures(report), others(report));
}

/// One line a figure: scene, technique, figure, value.
pub fn write_csv(report: &Report, path: &Path) -> Result<(), String> {
    // No name holds a comma.
    let mut text = "scene,technique,figure,value\n".to_owned();
    for scene in &report.scenes {
        let name = &scene.name;
        let _ = writeln!(text, "{name},reference,noise,{}", scene.noise);
        for technique in &scene.techniques {
            for (figure, value) in &technique.figures {
                let figure = figure.name().replace(',', "");
                let _ = writeln!(
                    text,
                    "{name},{},{figure},{value}",
                    technique.technique.name()
                );
            }
        }
    }
    crate::write(path, &text)
}

/// The day, as year-month-day.
fn today() -> String {
    let mut now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    now.truncate("0000-00-00".len());
    now
}

/// How the figures came about, in a sentence or two.
pub fn how(report: &Report) -> String {
    let adapter = report.scenes.first().map_or("", |scene| &scene.adapter);
    conditions(&report.effort, adapter, &report.settings)
}

/// Day, adapter, sizes and settings, in a sentence or two.
pub fn conditions(effort: &Effort, adapter: &str, settings: &[String]) -> String {
    let settings = match settings {
        [] => "default settings".into(),
        some => some.join(", "),
    };
    format!(
        "Measured on {}, adapter {}; {} x {} pixels, volumes of {} voxels, {} frames before a picture, {} \
         paths a pixel for the truth, {settings}.",
        today(),
        adapter,
        effort.size.x,
        effort.size.y,
        effort.resolution,
        effort.frames,
        effort.paths
    )
}

/// Writes the part of the bundled scenes into a document, and leaves the others.
pub fn write_markdown(report: &Report, path: &Path) -> Result<(), String> {
    let text = format!(
        "{}\n\n{}\n\n## Errors of the settled picture\n\n{}\n\n## Over time, and leaks\n\n{}\n",
        how(report),
        EXPLANATION,
        pictures(report),
        others(report)
    );
    let mut document = document::read(path)?;
    if !BUNDLED.is_in(&document) {
        // Written as a whole before it had parts.
        document = RANDOM.alone(&document, TITLE);
    }
    crate::write(path, &BUNDLED.replaced(&document, &text))
}

/// What the figures are.
pub const EXPLANATION: &str = "\
Made by `cargo xtask quality`, which also writes a page with all pictures, and the luminances as EXR.

Indirect light is compared on linear luminances in nits, on means of 8x8 pixels, over all blocks and the
three channels: *mean ratio* is the sum of a technique's over the sum of the truth's, 1 is right; *relative
RMSE* is the root of the mean square error over the truth's mean; *median error* is the median over blocks
of the luminance's relative error. *FLIP* (Andersson et al. 2020) compares the pictures as seen, 0 is the
same. *Noise of the truth* is the relative RMSE that the path tracer itself still has: the difference
between all of its paths and half of them. The technique `off` shows what there would be without global
illumination.

*Still* and *pan* are of the Cornell box, the second while the camera turns by 0.1 degrees a frame. *Frames
to 90 %* are counted until less than a tenth is missing of the way to the final picture. *Leak* is the
light in a sealed room over that in the lit one beside it, the worst over places of the wall on the grid
of voxels.

*GI, ms a frame* is of a still scene, by the GPU's clock. A software driver has no such clock: there it is what
a frame takes longer than with the technique `off`, and only ratios mean anything.";
