//! Pictures and statistics as files.

use std::{collections::BTreeMap, path::Path};

use bevy::{prelude::*, render::renderer::RenderAdapterInfo};
use bevy_gi::{GiSettingsRegistry, GiStatistics};
use image::ImageEncoder;
use wgpu::DeviceType;

use crate::headless::{Headless, Picture};

/// Writes a picture's values as they are, as PNG (8 bit) or EXR.
pub fn write(picture: &Picture, path: &Path) -> Result<(), String> {
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
            (p[0], p[1], p[2])
        });
        // One thread: blocks in the order of the picture, the same bytes each time.
        Image::from_channels((width, height), channels)
            .write()
            .non_parallel()
            .to_file(path)
            .map_err(|e| fail(&e))
    } else {
        std::fs::write(path, png(picture)).map_err(|e| fail(&e))
    }
}

/// A picture's values as they are, 8 bit, red, green and blue of each pixel.
pub fn bytes(picture: &Picture) -> Vec<u8> {
    let byte = |c: &f32| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
    let pixels = picture.pixels.iter();
    pixels.flat_map(|p| p[..3].iter().map(byte)).collect()
}

/// A picture's values as they are, 8 bit, as a PNG file.
pub fn png(picture: &Picture) -> Vec<u8> {
    let bytes = bytes(picture);
    let mut file = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut file);
    encoder
        .write_image(
            &bytes,
            picture.size.x,
            picture.size.y,
            image::ExtendedColorType::Rgb8,
        )
        .expect("memory takes a picture of any size");
    file
}

/// The first layer of an EXR file.
pub fn read_exr(path: &Path) -> Result<Picture, String> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| Picture {
            size: UVec2::new(size.width() as u32, size.height() as u32),
            pixels: vec![[0.0; 4]; size.area()],
        },
        |picture, at, (r, g, b, a): (f32, f32, f32, f32)| {
            picture.pixels[at.y() * picture.size.x as usize + at.x()] = [r, g, b, a];
        },
    )
    .map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(image.layer_data.channel_data.pixels)
}

/// The middle one of some values, 0 if there are none.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// Wall-clock time of a frame, milliseconds: the median over the second half of the last steps.
pub fn frame_ms(headless: &Headless) -> f64 {
    median(&headless.frame_ms)
}

/// What global illumination takes of a frame, milliseconds; `without` is a frame's wall-clock time with
/// the technique off. On a GPU, passes are timed by its own clock. A software driver reads that when it
/// likes (lavapipe 22.3 stamps compute passes that ran long ago): there it is what a frame takes longer.
pub fn gi_ms(headless: &Headless, without: f64) -> f64 {
    let adapter = headless.app.world().get_resource::<RenderAdapterInfo>();
    if adapter.is_some_and(|info| info.device_type == DeviceType::Cpu) {
        return (frame_ms(headless) - without).max(0.0);
    }
    statistics(headless)["gi_gpu_ms"].as_f64().unwrap_or(0.0)
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
    let registry = world.resource::<GiSettingsRegistry>();
    let settings = registry.serialize(world, serde_json::value::Serializer);
    let settings = settings.unwrap_or_else(|error| error.to_string().into());
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
        "settings": settings,
    })
}
