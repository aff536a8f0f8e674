//! Calls of cargo, all with the same target directory and features, so that nothing is built twice.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Result, bail};

/// The repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("xtask lies in the repository")
        .into()
}

/// A target directory outside of the checkout, which survives it: building Bevy takes long.
fn target_dir() -> PathBuf {
    if let Some(dir) = std::env::var_os("CARGO_TARGET_DIR") {
        return dir.into();
    }
    let cache = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| std::env::var_os("HOME").map(|home| PathBuf::from(home).join(".cache")));
    cache.map_or_else(
        || root().join("target"),
        |cache| cache.join("bevy_gi/target"),
    )
}

/// `cargo` with arguments, in the repository.
pub fn cargo(arguments: &[&str]) -> Result<()> {
    let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(arguments)
        .current_dir(root())
        .env("CARGO_TARGET_DIR", target_dir())
        .status()?;
    if !status.success() {
        bail!("cargo {} failed", arguments.join(" "));
    }
    Ok(())
}

/// An example, built by [`cargo`].
pub fn example(name: &str) -> PathBuf {
    example_of("release", name)
}

/// An example, built by [`cargo`] with a profile.
pub fn example_of(profile: &str, name: &str) -> PathBuf {
    target_dir().join(profile).join("examples").join(name)
}

/// All tests. GPU tests share one adapter and one process: one thread.
pub fn test(filter: Option<&str>) -> Result<()> {
    // One package at a time: together, their features would add up, and all of Bevy be built again.
    let package = |name: &str| {
        let mut arguments = vec!["test", "--release", "--package", name, "--no-fail-fast"];
        arguments.extend(filter);
        arguments.extend(["--", "--test-threads=1"]);
        cargo(&arguments)
    };
    package("xtask")?;
    package("bevy_gi")
}
