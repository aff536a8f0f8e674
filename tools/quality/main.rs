//! Measures every technique against the path tracer: `cargo xtask quality`.

mod measure;
mod report;
mod table;

use std::{
    path::{Path, PathBuf},
    process::{Command, ExitCode},
    time::Instant,
};

use bevy_gi::GiTechnique;
use bevy_gi_tools::{
    adapter,
    options::{SettingsOptions, gi_technique},
    quality::{Effort, cache_folder},
    scenes::{self, Scene},
};
use clap::Parser;
use measure::{Report, SceneReport};

/// Renders scenes with every technique and with the path tracer, and compares.
#[derive(Parser)]
#[command(name = "quality", allow_negative_numbers = true)]
struct Options {
    /// Small pictures of the smaller scenes, and fewer frames: under five minutes on two cores.
    #[arg(long)]
    quick: bool,
    /// Only these scenes. Repeatable; default: all.
    #[arg(long = "scene", value_name = "NAME", value_parser = scene)]
    scenes: Vec<Scene>,
    /// Only these techniques. Repeatable; default: all.
    #[arg(long = "technique", value_name = "NAME", value_parser = gi_technique)]
    techniques: Vec<GiTechnique>,
    #[command(flatten)]
    settings: SettingsOptions,
    /// Paths a pixel of the truth; default: 1024, or 256 with --quick.
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=65536))]
    paths: Option<u32>,
    /// Folder of the page, the table and the pictures.
    #[arg(long, default_value = "out/quality")]
    out: PathBuf,
    /// Folder in which truths are kept from run to run.
    #[arg(long, default_value_os_t = cache_folder())]
    cache: PathBuf,
    /// Also writes the tables as Markdown.
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
    /// Measures this scene, and writes what is found into the folder of the page.
    #[arg(long, value_name = "NAME", value_parser = scene, hide = true)]
    part: Option<Scene>,
}

fn scene(name: &str) -> Result<Scene, String> {
    scenes::find(name).ok_or_else(|| format!("no such scene; there are: {}", scenes::names()))
}

fn main() -> ExitCode {
    let options = Options::parse();
    match adapter::find().and_then(|_| run(&options)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("quality: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Result<(), String> {
    let mut effort = if options.quick {
        Effort::QUICK
    } else {
        Effort::FULL
    };
    effort.paths = options.paths.unwrap_or(effort.paths);
    if let Some(scene) = &options.part {
        let report = measure::measure(scene, &effort, options)?;
        let json = serde_json::to_string(&report).map_err(|e| e.to_string())?;
        return write(&part_file(options, scene), &json);
    }
    let mut report = Report {
        effort,
        settings: options.settings.described(),
        scenes: Vec::new(),
    };
    for scene in chosen(options) {
        let start = Instant::now();
        report.scenes.push(measure_apart(&scene, options)?);
        let seconds = start.elapsed().as_secs_f32();
        eprintln!("{:14} {seconds:5.1} s", scene.name);
        // Written after every scene: what is interrupted keeps what it has.
        table::write_csv(&report, &options.out.join("quality.csv"))?;
        report::write(&report, &options.out.join("index.html"))?;
        if let Some(path) = &options.markdown {
            table::write_markdown(&report, path)?;
        }
    }
    table::print(&report);
    println!("{}", options.out.join("index.html").display());
    Ok(())
}

/// The scenes that are asked for.
fn chosen(options: &Options) -> Vec<Scene> {
    if !options.scenes.is_empty() {
        return options.scenes.clone();
    }
    let all = scenes::ALL.into_iter();
    all.filter(|scene| !options.quick || scene.quick).collect()
}

/// Measures a scene in a process of its own: some drivers keep memory for every frame they render
/// (lavapipe 22.3: about 3 MB), which would add up over the scenes.
fn measure_apart(scene: &Scene, options: &Options) -> Result<SceneReport, String> {
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let arguments = std::env::args_os().skip(1);
    let status = Command::new(program)
        .args(arguments)
        .args(["--part", scene.name])
        .status()
        .map_err(|e| e.to_string())?;
    if !status.success() {
        return Err(format!("scene {}: {status}", scene.name));
    }
    let path = part_file(options, scene);
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let json = std::fs::read_to_string(&path).map_err(|e| fail(&e))?;
    let _ = std::fs::remove_file(&path);
    serde_json::from_str(&json).map_err(|e| fail(&e))
}

/// Where a scene's process leaves what it found.
fn part_file(options: &Options, scene: &Scene) -> PathBuf {
    options.out.join(format!("{}.json", scene.name))
}

/// Writes a file.
fn write(path: &Path, text: &str) -> Result<(), String> {
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
