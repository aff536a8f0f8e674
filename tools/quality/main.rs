//! Measures every technique against the path tracer: `cargo xtask quality`.

mod comparison;
mod figure;
mod measure;
mod parts;
mod random;
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
    open::gltf_path,
    options::{SettingsOptions, gi_technique},
    quality::{Effort, cache_folder},
    scenes::{self, Scene, random::RandomScene},
};
use clap::Parser;
use measure::{Report, Subject};
use random::RandomReport;
use serde::{Serialize, de::DeserializeOwned};

/// Renders scenes with every technique and with the path tracer, and compares.
#[derive(Parser)]
#[command(name = "quality", allow_negative_numbers = true)]
struct Options {
    /// Small pictures of the smaller scenes, and fewer frames: under five minutes on two cores.
    #[arg(long)]
    quick: bool,
    /// Only these scenes. Repeatable; default: all bundled ones, or none with --random or --file.
    #[arg(long = "scene", value_name = "NAME", value_parser = scene)]
    scenes: Vec<Scene>,
    /// A .gltf or .glb file, seen by the camera that the viewer chooses. Repeatable.
    #[arg(long = "file", value_name = "FILE", value_parser = file)]
    files: Vec<String>,
    /// Draws so many scenes at random, and measures each lit, as a furnace, and sealed.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    random: Option<u32>,
    /// Which series of random scenes is drawn. The first ones of a series are the same for every number of them.
    #[arg(long, default_value_t = 1, value_name = "S")]
    seed: u64,
    /// Presets with which random scenes are measured, separated by commas: names, 'default' for the settings as they
    /// are, which is the default, or 'all'. A preset replaces the fields that --set and --settings have set.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', requires = "random")]
    presets: Vec<String>,
    /// Only these techniques. Repeatable; default: all.
    #[arg(long = "technique", value_name = "NAME", value_parser = gi_technique)]
    techniques: Vec<GiTechnique>,
    #[command(flatten)]
    settings: SettingsOptions,
    /// Paths a pixel of the truth; default: 1024, or 256 with --quick.
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=65536))]
    paths: Option<u32>,
    /// Folder of the pages, the tables and the pictures.
    #[arg(long, default_value = "out/quality")]
    out: PathBuf,
    /// Folder in which truths are kept from run to run.
    #[arg(long, default_value_os_t = cache_folder())]
    cache: PathBuf,
    /// Also writes the tables as Markdown: what is measured, before all else what is of random scenes. What is not
    /// measured stays.
    #[arg(long, value_name = "FILE.md")]
    markdown: Option<PathBuf>,
    /// Measures this scene, and writes what is found into the folder of the page.
    #[arg(long, value_name = "NAME", hide = true)]
    part: Option<String>,
}

fn scene(name: &str) -> Result<Scene, String> {
    scenes::find(name).ok_or_else(|| format!("no such scene; there are: {}", scenes::names()))
}

fn file(path: &str) -> Result<String, String> {
    gltf_path(path).map(|_| path.into())
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
    if let Some(name) = &options.part {
        return measure_part(name, &effort, options);
    }
    // Before what may have been tuned to.
    if let Some(count) = options.random {
        measure_random(count, effort, options)?;
    }
    let subjects = chosen(options);
    if subjects.is_empty() {
        return Ok(());
    }
    measure_all(&subjects, effort, options)
}

/// Measures random scenes, and writes what is of them.
fn measure_random(count: u32, effort: Effort, options: &Options) -> Result<(), String> {
    let mut report = RandomReport {
        seed: options.seed,
        effort,
        settings: options.settings.described(),
        scenes: Vec::new(),
    };
    for scene in RandomScene::series(options.seed, count as usize) {
        let name = scene.to_string();
        report.scenes.push(measure_apart(&name, options)?);
        // Written after every scene: what is interrupted keeps what it has.
        random::write(&report, &options.out, options.markdown.as_deref())?;
    }
    random::print(&report);
    println!("{}", options.out.join("random.html").display());
    Ok(())
}

/// Measures scenes of the table, and writes what is of them.
fn measure_all(subjects: &[Subject], effort: Effort, options: &Options) -> Result<(), String> {
    let mut report = Report {
        effort,
        settings: options.settings.described(),
        scenes: Vec::new(),
    };
    for subject in subjects {
        let found = measure_apart(subject.argument(), options)?;
        report.scenes.push(found);
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

/// The scenes of the table that are asked for.
fn chosen(options: &Options) -> Vec<Subject> {
    let files = options.files.iter().cloned().map(Subject::File);
    let named = options.scenes.iter().copied().map(Subject::Bundled);
    let chosen: Vec<_> = named.chain(files).collect();
    if !chosen.is_empty() || options.random.is_some() {
        return chosen;
    }
    let all = scenes::ALL.into_iter();
    all.filter(|scene| !options.quick || scene.quick)
        .map(Subject::Bundled)
        .collect()
}

/// Measures a scene in a process of its own: some drivers keep memory for every frame they render
/// (lavapipe 22.3: about 3 MB), which would add up over the scenes.
fn measure_apart<T: DeserializeOwned>(name: &str, options: &Options) -> Result<T, String> {
    let start = Instant::now();
    let program = std::env::current_exe().map_err(|e| e.to_string())?;
    let arguments = std::env::args_os().skip(1);
    let status = Command::new(program)
        .args(arguments)
        .args(["--part", name])
        .status()
        .map_err(|e| e.to_string())?;
    if !status.success() {
        return Err(format!("scene {name}: {status}"));
    }
    let path = part_file(options);
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let json = std::fs::read_to_string(&path).map_err(|e| fail(&e))?;
    let _ = std::fs::remove_file(&path);
    let found = serde_json::from_str(&json).map_err(|e| fail(&e))?;
    eprintln!("{name:14} {:5.1} s", start.elapsed().as_secs_f32());
    Ok(found)
}

/// In a scene's own process: measures it, and leaves what is found.
fn measure_part(name: &str, effort: &Effort, options: &Options) -> Result<(), String> {
    if let Some(scene) = RandomScene::find(name) {
        return leave(&random::measure(scene?, effort, options)?, options);
    }
    let subject = match scenes::find(name) {
        Some(scene) => Subject::Bundled(scene),
        None => Subject::File(name.into()),
    };
    leave(&measure::measure(&subject, effort, options)?, options)
}

fn leave(found: &impl Serialize, options: &Options) -> Result<(), String> {
    let json = serde_json::to_string(found).map_err(|e| e.to_string())?;
    write(&part_file(options), &json)
}

/// Where a scene's process leaves what it found.
fn part_file(options: &Options) -> PathBuf {
    options.out.join("part.json")
}

/// Writes a file, and its folder.
fn write(path: &Path, text: &str) -> Result<(), String> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
