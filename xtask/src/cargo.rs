//! Calls of cargo, all with the same target directory and features, so that nothing is built twice.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::Mutex,
    time::Instant,
};

use anyhow::{Context, Result, bail};

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
        // The library and its tests are compiled side by side; only then what depends on it.
        package("bevy_gi"),
        package("bevy_gi_tools"),
        rendering_tests(filter),
    ];
    results.into_iter().collect()
}

/// The tests of `tests/gpu.rs`, each module in its own process: Mesa's software driver keeps memory mappings of every
/// pipeline it has compiled, and a process may have 65 530 of them. Two processes run at once, since that driver runs only
/// a part of its work on more than one core.
fn rendering_tests(filter: Option<&str>) -> Result<()> {
    let binary = rendering_test_binary()?;
    let mut modules = BTreeMap::<String, Vec<String>>::new();
    for name in listed(&binary, filter)? {
        let module = name.split("::").next().unwrap_or(&name);
        modules.entry(module.into()).or_default().push(name);
    }
    let waiting = Mutex::new(modules.into_iter());
    let failed = Mutex::new(Vec::new());
    let work = || {
        // The lock is free again before the module runs.
        let next = || waiting.lock().expect("no worker panics").next();
        while let Some((module, names)) = next() {
            let start = Instant::now();
            let passed = run_tests(&binary, &names);
            let passed = passed.unwrap_or_else(|error| {
                eprintln!("{error}");
                false
            });
            println!("{module}: {:.0} s", start.elapsed().as_secs_f32());
            if !passed {
                failed.lock().expect("no worker panics").push(module);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(work);
        }
    });
    let failed = failed.into_inner().expect("no worker panics");
    if !failed.is_empty() {
        bail!("rendering tests failed: {}", failed.join(", "));
    }
    Ok(())
}

/// Builds the rendering tests, and finds the program that cargo makes of them.
fn rendering_test_binary() -> Result<PathBuf> {
    let mut build = command(&["test", "--release", "--package", "bevy_gi", "--test", "gpu"]);
    build.args(["--no-run", "--message-format=json-render-diagnostics"]);
    let built = build.stderr(Stdio::inherit()).output()?;
    if !built.status.success() {
        bail!("cargo cannot build the rendering tests");
    }
    let messages = String::from_utf8(built.stdout)?;
    let messages = messages.lines().map(serde_json::from_str);
    let mut programs = messages
        .filter_map(|message: serde_json::Result<serde_json::Value>| message.ok())
        .filter(|message| message["target"]["name"] == "gpu")
        .filter_map(|message| Some(PathBuf::from(message["executable"].as_str()?)));
    programs.next().context("cargo names no program")
}

/// Names of the tests in a program, or of those that contain `filter`.
fn listed(binary: &Path, filter: Option<&str>) -> Result<Vec<String>> {
    let mut list = Command::new(binary);
    list.args(["--list", "--format=terse"]).args(filter);
    let names = String::from_utf8(list.output()?.stdout)?;
    let names = names.lines().filter_map(|line| line.strip_suffix(": test"));
    Ok(names.map(Into::into).collect())
}

/// Runs some tests of a program, one at a time, and shows what they say once all of them are done. Whether they pass.
fn run_tests(binary: &Path, names: &[String]) -> Result<bool> {
    let output = Command::new(binary)
        .args(["--test-threads=1", "--exact"])
        .args(names)
        .current_dir(root())
        // As cargo sets it: assets lie there.
        .env("CARGO_MANIFEST_DIR", root())
        .output()?;
    eprint!("{}", String::from_utf8_lossy(&output.stderr));
    print!("{}", String::from_utf8_lossy(&output.stdout));
    Ok(output.status.success())
}
