//! `cargo xtask demo`.

use std::{path::Path, process::Command};

use anyhow::{Context, Result, bail};

use crate::cargo::{cargo, example, root};

/// Opens the Cornell box; or, headless, renders pictures.
pub fn run(headless: bool, out: &Path) -> Result<()> {
    let display = std::env::var_os("DISPLAY").is_some()
        || std::env::var_os("WAYLAND_DISPLAY").is_some()
        || !cfg!(target_os = "linux");
    println!("building (the first time takes a while: all of Bevy)");
    if display && !headless {
        cargo(&["build", "--release", "--example", "cornell"])?;
        let status = Command::new(example("cornell"))
            .current_dir(root())
            .status()?;
        if !status.success() {
            bail!("the example ended with {status}");
        }
        return Ok(());
    }
    if !headless {
        println!("there is no display: rendering pictures instead");
    }
    cargo(&["build", "--release", "--example", "viewer"])?;
    std::fs::create_dir_all(out)?;
    let sponza = ["sponza", "--sky", "4500", "--frames", "80"];
    for (scene, arguments) in [
        ("cornell", &["cornell", "--frames", "80"][..]),
        ("sponza", &sponza),
    ] {
        for (suffix, more) in [
            ("off", &["--technique", "off"][..]),
            ("on", &[]),
            ("indirect", &["--view", "indirect"]),
        ] {
            let picture = out.join(format!("{scene}_{suffix}.png"));
            let stats = out.join(format!("{scene}_{suffix}.json"));
            let output = Command::new(example("viewer"))
                .args(arguments)
                .args(more)
                .args(["--headless", "--size", "640x360", "--out"])
                .arg(&picture)
                .arg("--stats")
                .arg(&stats)
                .current_dir(root())
                .output()?;
            if !output.status.success() {
                bail!("{}", String::from_utf8_lossy(&output.stderr));
            }
            println!("{}", picture.display());
            if suffix == "on" {
                print_statistics(&stats)?;
            }
        }
    }
    Ok(())
}

/// The frame, pass by pass.
fn print_statistics(path: &Path) -> Result<()> {
    let text = std::fs::read_to_string(path)?;
    let stats: serde_json::Value = serde_json::from_str(&text)?;
    let adapter = stats["adapter"]["name"].as_str().unwrap_or("unknown");
    println!("  adapter: {adapter}");
    let passes = stats["passes"]
        .as_object()
        .context("statistics without passes")?;
    for (name, figures) in passes.iter().filter(|(name, _)| name.starts_with("gi/")) {
        println!(
            "  {name:28} {:8.2} ms",
            figures["gpu_ms"].as_f64().unwrap_or(0.0)
        );
    }
    println!(
        "  GI {:.1} ms, the rest of the frame {:.1} ms, GI memory {:.1} MiB",
        stats["gi_gpu_ms"].as_f64().unwrap_or(0.0),
        stats["other_gpu_ms"].as_f64().unwrap_or(0.0),
        stats["memory_total_bytes"].as_f64().unwrap_or(0.0) / 1048576.0,
    );
    Ok(())
}
