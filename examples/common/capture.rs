//! Pictures and statistics as files.

use std::{collections::BTreeMap, path::Path};

use bevy::{prelude::*, render::renderer::RenderAdapterInfo};
use bevy_gi::{GiStatistics, prelude::*};

use super::headless::{Headless, Picture};

/// Writes a picture as PNG (its values as they are, 8 bit) or EXR (its values over `exposure`).
pub fn write(picture: &Picture, exposure: f32, path: &Path) -> Result<(), String> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    let (width, height) = (picture.size.x as usize, picture.size.y as usize);
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("exr"))
    {
        use exr::prelude::*;
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
            let p = picture.pixels[at.y() * width + at.x()];
            (p[0] / exposure, p[1] / exposure, p[2] / exposure)
        });
        // One thread: blocks in the order of the picture, the same bytes each time.
        Image::from_channels((width, height), channels)
            .write()
            .non_parallel()
            .to_file(path)
            .map_err(|e| fail(&e))
    } else {
        let mut bytes = Vec::with_capacity(width * height * 3);
        for p in &picture.pixels {
            bytes.extend(
                p[..3]
                    .iter()
                    .map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8),
            );
        }
        image::save_buffer(
            path,
            &bytes,
            width as u32,
            height as u32,
            image::ExtendedColorType::Rgb8,
        )
        .map_err(|e| fail(&e))
    }
}

/// The middle one of some values, 0 if there are none.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Everything that is known of the last frames, for `--stats`.
pub fn statistics(headless: &Headless) -> serde_json::Value {
    let world = headless.app.world();
    // What a frame costs: medians over the second half of the frames, in which a pass that did not run
    // took no time; and over all those frames in which it ran.
    let mut passes: BTreeMap<String, BTreeMap<&str, f64>> = BTreeMap::new();
    for (path, frames) in &headless.passes_ms {
        let Some(rest) = path.strip_prefix("render/") else {
            continue;
        };
        let Some((pass, figure)) = rest.rsplit_once('/') else {
            continue;
        };
        let (unit, when_run) = match figure {
            "elapsed_gpu" => ("gpu_ms", "gpu_ms_when_run"),
            "elapsed_cpu" => ("cpu_ms", "cpu_ms_when_run"),
            _ => continue,
        };
        let ran: Vec<f64> = frames.iter().copied().filter(|ms| *ms > 0.0).collect();
        let measured = &frames[frames.len() / 2..];
        let pass = passes.entry(pass.into()).or_default();
        pass.insert(unit, median(measured));
        pass.insert(when_run, median(&ran));
        pass.insert("frames_run", ran.len() as f64);
    }
    let sum = |gi: bool| -> f64 {
        passes
            .iter()
            .filter(|(name, _)| name.starts_with("gi/") == gi)
            .filter_map(|(_, figures)| figures.get("gpu_ms"))
            .sum()
    };
    let adapter = world.get_resource::<RenderAdapterInfo>().map(|info| {
        serde_json::json!({
            "name": info.name,
            "driver": info.driver_info,
            "backend": format!("{:?}", info.backend),
            "type": format!("{:?}", info.device_type),
        })
    });
    let statistics = world.resource::<GiStatistics>();
    let memory = statistics.memory();
    serde_json::json!({
        "adapter": adapter,
        "gi_gpu_ms": sum(true),
        "other_gpu_ms": sum(false),
        "frames_measured": headless.frame_ms.len(),
        "frame_wall_ms": median(&headless.frame_ms),
        "passes": passes,
        "memory_total_bytes": memory.values().sum::<u64>(),
        "memory_bytes": memory,
        "counts": statistics.counts(),
        "settings": {
            "GiSettings": world.resource::<GiSettings>(),
            "VoxelConeTracingSettings": world.resource::<VoxelConeTracingSettings>(),
        },
    })
}
