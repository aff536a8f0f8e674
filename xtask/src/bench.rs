//! `cargo xtask bench`.

use std::process::Command;

use anyhow::{Result, bail};

use crate::cargo::{cargo, example, example_of, root};

/// The profile of a program to take along.
const PORTABLE: &str = "portable";

/// What such a program may have at most, in bytes.
const LARGEST: u64 = 40_000_000;

/// Builds `examples/bench` as one small file, for a machine that has nothing but a GPU.
pub fn binary() -> Result<()> {
    println!("building (takes long: all of Bevy, for size)");
    cargo(&["build", "--profile", PORTABLE, "--example", "bench"])?;
    let path = example_of(PORTABLE, "bench");
    let bytes = std::fs::metadata(&path)?.len();
    println!("{}: {:.1} MB", path.display(), bytes as f64 / 1e6);
    if bytes > LARGEST {
        bail!("that is more than {} MB", LARGEST / 1_000_000);
    }
    Ok(())
}

/// Builds and runs `examples/bench`.
pub fn run(more: &[String]) -> Result<()> {
    println!("building (the first time takes a while: all of Bevy)");
    cargo(&["build", "--release", "--example", "bench"])?;
    let status = Command::new(example("bench"))
        .current_dir(root())
        .args(more)
        .status()?;
    if !status.success() {
        bail!("the measurement ended with {status}");
    }
    Ok(())
}
