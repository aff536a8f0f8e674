//! `cargo xtask quality`.

use std::{path::PathBuf, process::Command};

use anyhow::{Context, Result, bail};

use crate::cargo::{cargo, example, root};

// What is measured. Without `--random`, `--file` or a scene in `more`: all bundled scenes. (A documentation comment would
// replace the help of the command.)
#[derive(clap::Args)]
pub struct Options {
    /// Small pictures of the smaller scenes: under five minutes on two cores.
    #[arg(long)]
    quick: bool,
    /// Also writes what is measured into docs/quality.md; its other parts stay.
    #[arg(long)]
    docs: bool,
    /// Draws so many scenes at random, and measures each lit, as a furnace, and sealed: distributions of all errors, and
    /// the worst with pictures, in out/quality/random.html.
    #[arg(long, value_name = "N")]
    random: Option<u32>,
    /// Which series of random scenes is drawn; default: 1.
    #[arg(long, value_name = "S", requires = "random")]
    seed: Option<u64>,
    /// Presets with which random scenes are measured, separated by commas; 'all' for every one. Default: the settings
    /// as they are.
    #[arg(long, value_name = "NAMES", requires = "random")]
    presets: Option<String>,
    /// A .gltf or .glb file, compared as the bundled scenes are, with the camera that the viewer chooses. Repeatable.
    #[arg(long = "file", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// More options, for example: -- --scene cornell --set VoxelConeTracingSettings.cones=8
    #[arg(last = true)]
    more: Vec<String>,
}

/// Builds and runs `tools/quality`.
pub fn run(options: &Options) -> Result<()> {
    // Relative paths are of where this is called, not of the repository.
    let absolute = |path: &PathBuf| {
        std::path::absolute(path).with_context(|| format!("{}: no such path", path.display()))
    };
    let files = options.files.iter().map(absolute);
    let files = files.collect::<Result<Vec<_>>>()?;
    println!("building (the first time takes a while: all of Bevy)");
    cargo(&["build", "--release", "--example", "quality"])?;
    let mut command = Command::new(example("quality"));
    command.current_dir(root());
    if options.quick {
        command.arg("--quick");
    }
    if options.docs {
        command.args(["--markdown", "docs/quality.md"]);
    }
    if let Some(count) = options.random {
        command.args(["--random", &count.to_string()]);
    }
    if let Some(seed) = options.seed {
        command.args(["--seed", &seed.to_string()]);
    }
    if let Some(presets) = &options.presets {
        command.args(["--presets", presets]);
    }
    for file in files {
        command.arg("--file").arg(file);
    }
    let status = command.args(&options.more).status()?;
    if !status.success() {
        bail!("the measurement ended with {status}");
    }
    Ok(())
}
