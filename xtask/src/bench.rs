//! `cargo xtask bench`.

use std::{path::Path, process::Command};

use anyhow::{Context, Result, bail};

use crate::cargo::{cargo, example, example_of, root};

/// The profile of a program to take along.
const PORTABLE: &str = "portable";

/// What such a program may have at most, in bytes.
const LARGEST: u64 = 40_000_000;

/// Builds `tools/bench` as one small file, for a machine that has nothing but a GPU.
pub fn binary() -> Result<()> {
    println!("building (takes long: all of Bevy, for size)");
    let host = host()?;
    let mut arguments = vec!["rustc", "--profile", PORTABLE, "--package", "bevy_gi"];
    arguments.extend(["--example", "bench", "--target", &host]);
    // Programs of Linux can do without tables of relocations and of unwinding, a fifth of the file. Only
    // with `--target` do such flags leave build scripts and macros alone.
    let flags =
        format!("target.{host}.rustflags=['-Crelocation-model=static','-Cforce-unwind-tables=no']");
    let script = root().join("xtask/no_unwinding.ld");
    let script = format!("-Clink-arg=-Wl,--no-eh-frame-hdr,-T,{}", script.display());
    if host.contains("linux") {
        arguments.extend(["--config", &flags, "--", &script]);
    }
    cargo(&arguments)?;
    let path = example_of(&format!("{host}/{PORTABLE}"), "bench");
    if host.contains("linux") {
        strip(&path)?;
    }
    let bytes = std::fs::metadata(&path)?.len();
    println!("{}: {:.1} MB", path.display(), bytes as f64 / 1e6);
    if bytes > LARGEST {
        bail!("that is more than {} MB", LARGEST / 1_000_000);
    }
    Ok(())
}

/// Takes the symbols out of a program. The profile asks for it too, but with optimization over all crates
/// the symbols of the local functions stay, a third of the file.
fn strip(program: &Path) -> Result<()> {
    let status = Command::new("strip")
        .arg("--strip-all")
        .arg(program)
        .status();
    let status = status.context("cannot run strip (of binutils)")?;
    if !status.success() {
        bail!("strip ended with {status}");
    }
    Ok(())
}

/// The platform that this compiles for.
fn host() -> Result<String> {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc).arg("-vV").output()?;
    let text = String::from_utf8(output.stdout)?;
    let line = text.lines().find_map(|line| line.strip_prefix("host: "));
    Ok(line.context("rustc does not name its host")?.to_owned())
}

/// Builds and runs `tools/bench`.
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
