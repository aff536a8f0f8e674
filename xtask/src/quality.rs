//! `cargo xtask quality`.

use std::process::Command;

use anyhow::{Result, bail};

use crate::cargo::{cargo, example, root};

/// Builds and runs `tools/quality`.
pub fn run(quick: bool, docs: bool, more: &[String]) -> Result<()> {
    println!("building (the first time takes a while: all of Bevy)");
    cargo(&["build", "--release", "--example", "quality"])?;
    let mut command = Command::new(example("quality"));
    command.current_dir(root());
    if quick {
        command.arg("--quick");
    }
    if docs {
        command.args(["--markdown", "docs/quality.md"]);
    }
    let status = command.args(more).status()?;
    if !status.success() {
        bail!("the measurement ended with {status}");
    }
    Ok(())
}
