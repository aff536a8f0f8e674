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

/// Everything that is known of the last frames, for `--stats`.
pub fn statistics(headless: &Headless) -> serde_json::Value {
    let world = headless.app.world();
    // Medians of the history that Bevy keeps of each pass.
    let mut passes: BTreeMap<String, BTreeMap<&str, f64>> = BTreeMap::new();
    for diagnostic in headless.diagnostics().iter() {
        let path = diagnostic.path().as_str();
        let Some(rest) = path.strip_prefix("render/") else {
            continue;
        };
        let Some((pass, figure)) = rest.rsplit_once('/') else {
            continue;
        };
        let unit = match figure {
            "elapsed_gpu" => "gpu_ms",
            "elapsed_cpu" => "cpu_ms",
            _ => continue,
        };
        let mut values: Vec<f64> = diagnostic.values().copied().collect();
        values.sort_by(f64::total_cmp);
        if let Some(median) = values.get(values.len() / 2) {
            passes.entry(pass.into()).or_default().insert(unit, *median);
        }
    }
    let mut frames = headless.frame_ms.clone();
    frames.sort_by(f64::total_cmp);
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
        "frame_wall_ms": frames.get(frames.len() / 2),
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
