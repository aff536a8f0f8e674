//! `cargo xtask`: everything that a fresh machine needs, in one command each.

mod cargo;
mod demo;
mod setup;
mod sponza;

use anyhow::Result;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    about = "Set-up, demo, tests and assets of bevy_gi"
)]
struct Options {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Installs what the system lacks, builds, and shows the Cornell box with global illumination.
    Demo {
        /// Pictures of Cornell and Sponza instead of a window; also where there is no display.
        #[arg(long)]
        headless: bool,
        /// Folder of the pictures.
        #[arg(long, default_value = "out/demo")]
        out: std::path::PathBuf,
    },
    /// Installs what the system lacks, and runs all tests.
    Test {
        /// Only tests whose name contains this.
        filter: Option<String>,
    },
    /// Makes `assets/scenes/sponza.glb`, the same bytes each time.
    Assets,
}

fn main() -> Result<()> {
    match Options::parse().task {
        Task::Demo { headless, out } => {
            setup::install(!headless)?;
            demo::run(headless, &out)
        }
        Task::Test { filter } => {
            setup::install(false)?;
            cargo::test(filter.as_deref())
        }
        Task::Assets => {
            let path = cargo::root().join("assets/scenes/sponza.glb");
            let bytes = sponza::generate()?;
            std::fs::write(&path, &bytes)?;
            println!("{}: {} bytes", path.display(), bytes.len());
            Ok(())
        }
    }
}
