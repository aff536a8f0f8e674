//! `cargo xtask check`: what a reviewer should not have to look for.

use std::path::Path;

use anyhow::{Context, Result, bail};

use crate::cargo::{cargo, cargo_with, has, output, root};

/// What tools, examples and tests share: a crate that is not published.
const SHARED: &str = "bevy_gi_tools";

/// Formatting, lints, documentation, dependencies, the package. All of them run, whatever fails.
pub fn run() -> Result<()> {
    let results = [
        formatting(),
        lints(),
        documentation(),
        unused_dependencies(),
        packed(),
    ];
    results.into_iter().collect()
}

fn formatting() -> Result<()> {
    match has("fmt") {
        true => cargo(&["fmt", "--all", "--check"]),
        false => skipped("rustfmt"),
    }
}

/// In the profile and with the features of the tests, so that no dependency is checked twice.
fn lints() -> Result<()> {
    if !has("clippy") {
        return skipped("clippy");
    }
    // The rendering tests are no test of Cargo's: `--all-targets` and `--tests` leave them out, also beside `--test gpu`.
    for (package, targets) in [
        ("xtask", &["--bins", "--tests"][..]),
        (SHARED, &["--lib", "--tests"]),
        ("bevy_gi", &["--lib", "--examples", "--tests"]),
        ("bevy_gi", &["--test", "gpu"]),
    ] {
        let package = ["clippy", "--release", "--package", package];
        cargo(&[&package[..], targets, &["--", "--deny", "warnings"]].concat())?;
    }
    Ok(())
}

/// Of both packages at once: what is shared enables all features, as in the other checks.
fn documentation() -> Result<()> {
    let mut doc = vec!["doc", "--release", "--no-deps"];
    doc.extend(["--package", "bevy_gi", "--package", SHARED]);
    cargo_with(&doc, &[("RUSTDOCFLAGS", "--deny warnings")])
}

fn skipped(component: &str) -> Result<()> {
    println!("{component} is not installed, its check is left out");
    Ok(())
}

/// Each dependency is named in some source file of its package.
fn unused_dependencies() -> Result<()> {
    let mut unused = Vec::new();
    for (folder, sources) in [
        (root(), &["src", "examples", "tools", "tests"][..]),
        (root().join("tools/shared"), &["src"]),
        (root().join("xtask"), &["src"]),
    ] {
        let manifest = folder.join("Cargo.toml");
        let text = std::fs::read_to_string(&manifest)
            .with_context(|| format!("cannot read {}", manifest.display()))?;
        let mut code = String::new();
        for source in sources {
            read_all(&folder.join(source), &mut code)?;
        }
        let unnamed = dependencies(&text).filter(|name| !names(&code, name));
        unused.extend(unnamed.map(|name| format!("{name} ({})", manifest.display())));
    }
    if !unused.is_empty() {
        bail!("dependencies that nothing names: {}", unused.join(", "));
    }
    Ok(())
}

/// What `cargo package` packs needs nothing that it does not.
fn packed() -> Result<()> {
    let list = ["package", "--list", "--allow-dirty", "--package", "bevy_gi"];
    let listed = output(&list)?;
    let mut cannot_build = Vec::new();
    // Some of the files that are listed are made by Cargo.
    for file in listed.lines().filter(|file| root().join(file).exists()) {
        if file.ends_with(".rs") && names(&std::fs::read_to_string(root().join(file))?, SHARED) {
            cannot_build.push(file);
        }
    }
    if !cannot_build.is_empty() {
        let files = cannot_build.join(", ");
        bail!("packed, but in need of {SHARED}, which is not: {files}");
    }
    Ok(())
}

/// Names in the tables of dependencies of a manifest.
fn dependencies(manifest: &str) -> impl Iterator<Item = &str> {
    let mut inside = false;
    manifest.lines().filter_map(move |line| {
        if line.starts_with('[') {
            inside = line.contains("dependencies]");
            return None;
        }
        let starts_entry = line.starts_with(|c: char| c.is_ascii_alphabetic());
        let name = line.split(['=', '.', ' ']).next()?;
        (inside && starts_entry).then_some(name)
    })
}

/// Whether code names a crate: followed by `::`, `;` or ` as `.
fn names(code: &str, dependency: &str) -> bool {
    let krate = dependency.replace('-', "_");
    code.match_indices(&krate).any(|(at, _)| {
        let before = code[..at].chars().next_back();
        let after = &code[at + krate.len()..];
        let is_word = before.is_some_and(|c| c.is_alphanumeric() || c == '_');
        !is_word
            && ["::", ";", " as "]
                .iter()
                .any(|next| after.starts_with(next))
    })
}

/// Appends all Rust files below a folder, those of other packages left out.
fn read_all(folder: &Path, code: &mut String) -> Result<()> {
    for entry in std::fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            if !path.join("Cargo.toml").exists() {
                read_all(&path, code)?;
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            code.push_str(&std::fs::read_to_string(&path)?);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const MANIFEST: &str = "[package]\nname = \"x\"\n\n[dependencies]\nserde = \"1\"\nnv-flip = { version = \"0.1\", features = [\n    \"a\",\n] }\n\n[profile.release]\ndebug = 0\n";

    #[test]
    fn dependencies_are_found_in_their_tables_alone() {
        let found: Vec<_> = dependencies(MANIFEST).collect();
        assert_eq!(found, ["serde", "nv-flip"]);
    }

    #[test]
    fn a_crate_is_named_by_its_path() {
        assert!(names("use serde::Serialize;", "serde"));
        assert!(names("nv_flip::flip(a, b)", "nv-flip"));
        assert!(!names("use serde_json::Value;", "serde"));
        assert!(!names("let serde = 1", "serde"));
    }

    #[test]
    fn no_dependency_of_the_project_is_unused() {
        unused_dependencies().unwrap();
    }
}
