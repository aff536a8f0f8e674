//! `cargo xtask`: everything that a fresh machine needs, in one command each.

mod bench;
mod cargo;
mod check;
mod demo;
mod quality;
mod setup;
mod sponza;

use anyhow::Result;
use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    about = "Set-up, demo, tests, measurements and assets of bevy_gi"
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
    /// Formatting, lints, documentation, dependencies that nothing uses, and what is packed.
    Check,
    /// Renders scenes with every technique and with the path tracer, and compares: a page, a table, and all
    /// luminances in out/quality. `-- --help` lists the options.
    Quality(quality::Options),
    /// Measures what global illumination costs: techniques x presets x picture sizes x volume sizes, and
    /// the papers' own sweeps; tables and plots in out/bench. `-- --help` lists the options.
    Bench {
        /// Builds the program as one small file that has its scenes in it, and does not run it.
        #[arg(long)]
        binary: bool,
        /// More options, for example: -- --scene cornell --size 1920x1080
        #[arg(last = true)]
        more: Vec<String>,
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
        Task::Check => {
            setup::install(false)?;
            check::run()
        }
        Task::Quality(options) => {
            setup::install(false)?;
            quality::run(&options)
        }
        Task::Bench { binary, more } => {
            setup::install(false)?;
            if binary {
                bench::binary()
            } else {
                bench::run(&more)
            }
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
