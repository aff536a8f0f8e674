//! Calls of cargo, all with the same target directory and features, so that nothing is built twice.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Result, bail};

/// The repository.
pub fn root() -> PathBuf {
    // As cargo says now: a program compiled in another checkout would name that one.
    let xtask = std::env::var_os("CARGO_MANIFEST_DIR");
    let xtask = xtask.unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    Path::new(&xtask)
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
    cargo_with(arguments, &[])
}

/// The same, with variables of the environment.
pub fn cargo_with(arguments: &[&str], variables: &[(&str, &str)]) -> Result<()> {
    let status = command(arguments)
        .envs(variables.iter().copied())
        .status()?;
    if !status.success() {
        bail!("cargo {} failed", arguments.join(" "));
    }
    Ok(())
}

/// What `cargo` writes, in the repository.
pub fn output(arguments: &[&str]) -> Result<String> {
    let output = command(arguments).stderr(Stdio::inherit()).output()?;
    if !output.status.success() {
        bail!("cargo {} failed", arguments.join(" "));
    }
    Ok(String::from_utf8(output.stdout)?)
}

/// Whether cargo has that command.
pub fn has(name: &str) -> bool {
    let output = command(&[name, "--version"]).output();
    output.is_ok_and(|output| output.status.success())
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command
        .args(arguments)
        .current_dir(root())
        .env("CARGO_TARGET_DIR", target_dir());
    command
}

/// An example, built by [`cargo`].
pub fn example(name: &str) -> PathBuf {
    example_of("release", name)
}

/// An example, built by [`cargo`] with a profile.
pub fn example_of(profile: &str, name: &str) -> PathBuf {
    target_dir().join(profile).join("examples").join(name)
}

/// All tests, or those whose name contains `filter`.
pub fn test(filter: Option<&str>) -> Result<()> {
    // A package at a time. The features of xtask would add up with those of the others, and all of Bevy be built again.
    let package = |name: &str| {
        let mut arguments = vec!["test", "--release", "--package", name, "--no-fail-fast"];
        arguments.extend(filter);
        arguments.extend(["--", "--test-threads=1"]);
        cargo(&arguments)
    };
    let results = [
        package("xtask"),
        package("bevy_gi_tools"),
        package("bevy_gi"),
        rendering_tests(filter),
    ];
    results.into_iter().collect()
}

/// The tests of `tests/gpu.rs`, one at a time, each module in its own process: Mesa's software driver
/// keeps memory mappings of every pipeline it has compiled, and a process may have 65 530 of them.
fn rendering_tests(filter: Option<&str>) -> Result<()> {
    const GPU: [&str; 6] = ["test", "--release", "--package", "bevy_gi", "--test", "gpu"];
    let mut list = vec!["--", "--list", "--format=terse"];
    list.extend(filter);
    let listed = output(&[&GPU[..], &list].concat())?;
    let names = listed
        .lines()
        .filter_map(|line| line.strip_suffix(": test"));
    let mut modules = BTreeMap::<&str, Vec<&str>>::new();
    for name in names {
        let module = name.split("::").next().unwrap_or(name);
        modules.entry(module).or_default().push(name);
    }
    let mut failed = Vec::new();
    for (module, names) in modules {
        let one_by_one = ["--", "--test-threads=1", "--exact"];
        if let Err(error) = cargo(&[&GPU[..], &one_by_one, &names].concat()) {
            eprintln!("{error}");
            failed.push(module);
        }
    }
    if !failed.is_empty() {
        bail!("rendering tests failed: {}", failed.join(", "));
    }
    Ok(())
}
