//! What global illumination costs: `cargo xtask bench`, or this program alone, with its scenes in it, on
//! a machine that has a GPU and nothing else.

mod measure;
mod output;
mod papers;
mod sweep;

use std::{path::PathBuf, process::ExitCode};

use bevy::{math::UVec2, render::renderer::RenderAdapterInfo};
use bevy_gi::GiTechnique;
use bevy_gi_tools::{
    adapter,
    options::{self, gi_technique, size},
    scenes::{self, Scene, sponza},
};
use clap::Parser;

/// Measures techniques x presets x picture sizes x volume sizes, and the papers' own sweeps.
#[derive(Parser)]
#[command(name = "bench", allow_negative_numbers = true)]
struct Options {
    /// Everything, also on a software driver.
    #[arg(long, conflicts_with = "quick")]
    all: bool,
    /// Small pictures and volumes, fewer presets; what a software driver gets unless told otherwise.
    #[arg(long)]
    quick: bool,
    /// Only these scenes. Repeatable; default: cornell, sponza.
    #[arg(long = "scene", value_name = "NAME", value_parser = scene)]
    scenes: Vec<Scene>,
    /// Only these techniques. Repeatable; default: all.
    #[arg(long = "technique", value_name = "NAME", value_parser = gi)]
    techniques: Vec<GiTechnique>,
    /// Only these presets. Repeatable.
    #[arg(long = "preset", value_name = "NAME", value_parser = ["low", "medium", "high", "ultra", "paper"])]
    presets: Vec<String>,
    /// Only these sizes of the picture. Repeatable.
    #[arg(long = "size", value_name = "WIDTHxHEIGHT", value_parser = size)]
    sizes: Vec<UVec2>,
    /// Only these numbers of voxels along a volume. Repeatable.
    #[arg(long = "voxels", value_name = "N", value_parser = clap::value_parser!(u32).range(32..=512))]
    voxels: Vec<u32>,
    /// Frames for each figure.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(4..))]
    frames: u32,
    /// Folder of tables and plots.
    #[arg(long, default_value = "out/bench")]
    out: PathBuf,
    /// Lists techniques, scenes and settings.
    #[arg(long)]
    list: bool,
}

fn scene(name: &str) -> Result<Scene, String> {
    scenes::find(name).ok_or_else(|| format!("no such scene; there are: {}", scenes::names()))
}

fn gi(name: &str) -> Result<GiTechnique, String> {
    match gi_technique(name)? {
        GiTechnique::OFF => Err("a technique that computes indirect light is wanted".into()),
        technique => Ok(technique),
    }
}

fn main() -> ExitCode {
    let options = Options::parse();
    if options.list {
        options::list();
        return ExitCode::SUCCESS;
    }
    match adapter::find().and_then(|adapter| run(&options, &adapter)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bench: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The one scene that is a file, for machines that do not have the repository.
const SPONZA: &[u8] = include_bytes!("../../assets/scenes/sponza.glb");

fn run(options: &Options, adapter: &RenderAdapterInfo) -> Result<(), String> {
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", options.out.display());
    // A folder of our own, which can be deleted afterwards.
    let assets = options.out.join(format!(".bench-{}", std::process::id()));
    std::fs::create_dir_all(&options.out).map_err(|e| fail(&e))?;
    std::fs::create_dir(&assets).map_err(|e| fail(&e))?;
    let path = assets.join(sponza::PATH);
    let folder = path.parent().expect("scenes lie in a folder");
    std::fs::create_dir_all(folder).map_err(|e| fail(&e))?;
    std::fs::write(path, SPONZA).map_err(|e| fail(&e))?;
    scenes::set_asset_folder(&assets.canonicalize().map_err(|e| fail(&e))?);
    // Written after every scene: what is interrupted keeps what it has.
    let results = measure::all(options, adapter, |results| {
        output::write(results, &options.out)
    });
    let _ = std::fs::remove_dir_all(&assets);
    let results = results?;
    println!("{}", output::text(&results));
    println!("{}", options.out.display());
    Ok(())
}
