//! Measures every technique against the path tracer: `cargo xtask quality`.

#[path = "../common/mod.rs"]
mod common;

mod measure;
mod plot;
mod report;
mod table;

use std::{path::PathBuf, process::ExitCode};

use clap::Parser;
use common::{
    adapter,
    options::SettingsOptions,
    quality::{Effort, cache_folder},
    scenes::{self, Scene},
};

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
}

fn scene(name: &str) -> Result<Scene, String> {
    scenes::find(name).ok_or_else(|| format!("no such scene; there are: {}", scenes::names()))
}

fn main() -> ExitCode {
    let options = Options::parse();
    match adapter::find().and_then(|()| run(&options)) {
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
    let scenes = match &options.scenes[..] {
        [] => measure::scenes(options.quick),
        some => some.to_vec(),
    };
    // Written after every scene: what is interrupted keeps what it has.
    let report = measure::all(&scenes, &effort, options, |report| {
        table::write_csv(report, &options.out.join("quality.csv"))?;
        report::write(report, &options.out.join("index.html"))?;
        match &options.markdown {
            Some(path) => table::write_markdown(report, path),
            None => Ok(()),
        }
    })?;
    table::print(&report);
    println!("{}", options.out.join("index.html").display());
    Ok(())
}
