//! System packages: what a graphics program needs on Debian and Ubuntu.

use std::{path::Path, process::Command};

use anyhow::{Result, bail};

/// A package, and a file that is there when it is installed (the name alone, in any library folder).
const LIBRARIES: &[(&str, &str)] = &[
    ("libvulkan1", "libvulkan.so.1"),
    ("mesa-vulkan-drivers", "libvulkan_lvp.so"),
];
const WINDOW_LIBRARIES: &[(&str, &str)] = &[
    ("libx11-6", "libX11.so.6"),
    ("libx11-xcb1", "libX11-xcb.so.1"),
    ("libxcursor1", "libXcursor.so.1"),
    ("libxi6", "libXi.so.6"),
    ("libxrandr2", "libXrandr.so.2"),
    ("libxkbcommon-x11-0", "libxkbcommon-x11.so.0"),
];
/// What the linker needs, since Rust comes without one; and a compiler of C++, for FLIP.
const TOOLS: &[(&str, &str)] = &[
    ("gcc", "/usr/bin/cc"),
    ("g++", "/usr/bin/c++"),
    ("libc6-dev", "/usr/include/stdio.h"),
];

const FOLDERS: &[&str] = &[
    "/usr/lib",
    "/usr/lib64",
    "/lib",
    "/usr/local/lib",
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
];

fn exists(file: &str) -> bool {
    if file.starts_with('/') {
        return Path::new(file).exists();
    }
    FOLDERS
        .iter()
        .any(|folder| Path::new(folder).join(file).exists())
}

/// Installs what is missing, by `apt-get` where that is allowed; else says how.
pub fn install(window: bool) -> Result<()> {
    if !cfg!(target_os = "linux") {
        return Ok(());
    }
    let mut wanted: Vec<_> = LIBRARIES.iter().chain(TOOLS).collect();
    if window {
        wanted.extend(WINDOW_LIBRARIES);
    }
    let missing: Vec<_> = wanted
        .into_iter()
        .filter(|(_, file)| !exists(file))
        .map(|(package, _)| *package)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let line = format!(
        "apt-get install -y --no-install-recommends {}",
        missing.join(" ")
    );
    if !Path::new("/usr/bin/apt-get").exists() {
        bail!(
            "missing: {}. On Debian or Ubuntu: sudo {line}",
            missing.join(", ")
        );
    }
    let root = Command::new("id")
        .arg("-u")
        .output()?
        .stdout
        .starts_with(b"0\n");
    let sudo = Command::new("sudo")
        .args(["-n", "true"])
        .output()
        .is_ok_and(|o| o.status.success());
    if !root && !sudo {
        bail!("missing: {}. Run: sudo {line}", missing.join(", "));
    }
    println!("installing {}", missing.join(", "));
    let prefix = if root { "" } else { "sudo " };
    let script = format!(
        "export DEBIAN_FRONTEND=noninteractive; {prefix}apt-get update -qq && {prefix}{line} -qq"
    );
    if !Command::new("sh").args(["-c", &script]).status()?.success() {
        bail!("apt-get failed; by hand: sudo {line}");
    }
    Ok(())
}
