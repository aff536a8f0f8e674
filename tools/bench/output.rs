//! Tables and plots.

use std::{fmt::Write, path::Path};

use bevy::math::UVec2;
use bevy_gi_tools::plot::{self, Line};
use comfy_table::{Table, presets};

use crate::{
    measure::{Case, Results, Situation},
    papers::PUBLISHED,
    sweep,
};

/// Writes all files.
pub fn write(results: &Results, folder: &Path) -> Result<(), String> {
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", folder.display());
    let json = serde_json::to_string_pretty(results).map_err(|e| fail(&e))?;
    let mut files = vec![
        ("bench.json".to_owned(), json),
        ("bench.csv".into(), csv(results)),
        ("bench.md".into(), text(results)),
        ("sweep.csv".into(), sweep::csv(&results.sweep)),
    ];
    files.extend(plots(results));
    for (name, text) in files {
        std::fs::write(folder.join(name), text).map_err(|e| fail(&e))?;
    }
    Ok(())
}

/// What was measured, and on what.
fn how(results: &Results) -> String {
    let driver = match results.software {
        true => {
            " This is a software driver, which has no clock of its own: times are what a frame takes longer \
             with global illumination than without, on the cores that run everything else; only their \
             ratios mean anything, and times of single passes do not."
        }
        false => "",
    };
    format!(
        "Adapter: {}.{driver} Medians over {} frames in ms; *still*: nothing changes; *lights*: all \
         lights change in every frame; *moving*: a mesh moves, too.",
        results.adapter,
        results.frames / 2
    )
}

pub fn table(header: Vec<String>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header);
    table
}

/// All tables, as Markdown.
pub fn text(results: &Results) -> String {
    let mut text = format!("{}\n\n{}\n", how(results), cases(results));
    for published in &PUBLISHED {
        let _ = write!(text, "\n{}", against(results, published));
    }
    let _ = write!(text, "\n{}", sweep::text(&results.sweep, results.software));
    text
}

fn cases(results: &Results) -> Table {
    let names = ["scene", "technique", "preset", "picture", "voxels"];
    let mut header: Vec<String> = names.map(String::from).into();
    header.extend(Situation::ALL.map(|s| format!("GI {}", s.name())));
    header.extend(["frame without", "GI, CPU", "GI, MiB"].map(String::from));
    let mut table = table(header);
    for case in &results.cases {
        let mut row = vec![
            case.scene.clone(),
            case.technique.name().into(),
            case.preset.clone(),
            format!("{}x{}", case.size.x, case.size.y),
            case.voxels.to_string(),
        ];
        let ms = |value: Option<f64>| value.map_or(String::new(), |ms| format!("{ms:.2}"));
        for situation in Situation::ALL {
            row.push(ms(case.get(situation).map(|m| m.gi_ms)));
        }
        let still = case.get(Situation::Still);
        row.push(ms(still.map(|m| m.without_ms)));
        row.push(ms(still.map(|m| m.gi_cpu_ms)));
        row.push(format!("{:.1}", case.memory_mib));
        table.add_row(row);
    }
    table
}

fn against(results: &Results, published: &crate::papers::Published) -> String {
    let mut header = vec!["picture".to_owned(), "pass".into()];
    for voxels in published.voxels {
        header.push(format!("{voxels} voxels: theirs"));
        header.push("ours".into());
    }
    let mut table = table(header);
    let mut any = false;
    for row in published.rows {
        let mut cells = vec![
            format!("{}x{}", row.size[0], row.size[1]),
            row.pass.to_owned(),
        ];
        for (voxels, theirs) in published.voxels.into_iter().zip(row.ms) {
            let ours = published.ours(&results.cases, row, voxels);
            any |= ours.is_some();
            // Times of single passes on a software driver are none.
            let ours = ours.filter(|_| !results.software);
            cells.push(format!("{theirs:.2}"));
            cells.push(ours.map_or("not measured".into(), |ms| format!("{ms:.2}")));
        }
        table.add_row(cells);
    }
    let source = published.source;
    if results.software {
        return format!(
            "{source}, on a {}, scene Sponza of that paper. Ours needs a GPU: this is a software driver, \
             {}. ms.\n\n{table}\n",
            published.adapter, results.adapter
        );
    }
    if !any {
        return format!(
            "{}: none of its cases was measured here (its pictures are {}x{} and larger).\n",
            source, published.rows[0].size[0], published.rows[0].size[1]
        );
    }
    format!(
        "{}, on a {}, scene Sponza of that paper; ours on a {}, the bundled Sponza, preset '{}', while \
         everything moves. ms.\n\n{table}\n",
        source, published.adapter, results.adapter, published.preset
    )
}

fn csv(results: &Results) -> String {
    let mut text = "scene,technique,preset,width,height,voxels,situation,pass,gpu_ms\n".to_owned();
    for case in &results.cases {
        for measured in &case.situations {
            let mut line = |pass: &str, ms: f64| {
                let _ = writeln!(
                    text,
                    "{},{},{},{},{},{},{},{pass},{ms}",
                    case.scene,
                    case.technique.name(),
                    case.preset,
                    case.size.x,
                    case.size.y,
                    case.voxels,
                    measured.situation.name(),
                );
            };
            line("all of GI", measured.gi_ms);
            line("frame without", measured.without_ms);
            for (pass, ms) in &measured.passes {
                line(pass, *ms);
            }
        }
    }
    text
}

/// Time over the number of voxels, a line a preset: for each scene, size and situation.
fn plots(results: &Results) -> Vec<(String, String)> {
    let mut keys: Vec<(&str, UVec2)> = Vec::new();
    for case in &results.cases {
        if !keys.contains(&(&case.scene, case.size)) {
            keys.push((&case.scene, case.size));
        }
    }
    let mut files = Vec::new();
    for (scene, size) in keys {
        let of = |case: &&Case| case.scene == scene && case.size == size;
        for situation in Situation::ALL {
            let mut lines: Vec<Line> = Vec::new();
            for case in results.cases.iter().filter(of) {
                let name = format!("{} {}", case.technique.name(), case.preset);
                let Some(measured) = case.get(situation) else {
                    continue;
                };
                let point = (case.voxels as f32, measured.gi_ms as f32);
                match lines.iter_mut().find(|line| line.name == name) {
                    Some(line) => line.points.push(point),
                    None => lines.push(Line {
                        name,
                        points: vec![point],
                    }),
                }
            }
            let points = || lines.iter().flat_map(|line| &line.points);
            let right = points().map(|p| p.0).fold(1.0, f32::max);
            let top = points().map(|p| p.1).fold(0.01, f32::max);
            let (width, height) = (size.x, size.y);
            let title = format!("{scene}, {width}x{height}, {}", situation.name());
            let axes = ["voxels along the volume", "GI, ms a frame"];
            let svg = plot::lines(&title, axes, [0.0, right], [0.0, 1.4 * top], &lines);
            let name = format!("{scene}_{width}x{height}_{}.svg", situation.name());
            files.push((name, svg));
        }
    }
    files
}
