//! The path tracer, over the world of an app.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use bevy::prelude::*;
use bevy_gi::{
    GiView,
    reference::{Reference, ReferenceCamera, ReferenceScene, ReferenceSettings, ReferenceView},
};
use indicatif::{ProgressBar, ProgressStyle};

use crate::headless::Picture;

/// The part of the result that a view shows.
pub fn view(view: GiView) -> Result<ReferenceView, String> {
    Ok(match view {
        GiView::Full => ReferenceView::Full,
        GiView::Direct => ReferenceView::Direct,
        GiView::Indirect => ReferenceView::Indirect,
        GiView::Diffuse => ReferenceView::Diffuse,
        GiView::Specular => ReferenceView::Specular,
        GiView::Albedo => ReferenceView::Albedo,
        GiView::Normal => ReferenceView::Normal,
        other => {
            return Err(format!(
                "--technique reference has no view '{}'; it has full, direct, indirect, diffuse, \
                 specular, albedo, normal",
                other.name()
            ));
        }
    })
}

/// A camera of Bevy's, with the aspect ratio of `size`.
pub fn camera(
    transform: &GlobalTransform,
    projection: &Projection,
    size: UVec2,
) -> ReferenceCamera {
    let mut projection = projection.clone();
    projection.update(size.x as f32, size.y as f32);
    ReferenceCamera {
        world_from_view: transform.to_matrix(),
        clip_from_view: projection.get_clip_from_view(),
    }
}

/// An empty picture of what a camera sees, to be path-traced.
pub fn prepare(
    world: &mut World,
    camera: Entity,
    size: UVec2,
    settings: ReferenceSettings,
) -> Result<Reference, String> {
    let scene = Arc::new(ReferenceScene::new(world));
    let (Some(transform), Some(projection)) = (
        world.get::<GlobalTransform>(camera),
        world.get::<Projection>(camera),
    ) else {
        return Err("there is no camera".into());
    };
    let camera = self::camera(transform, projection, size);
    Ok(Reference::new(scene, camera, size, settings))
}

/// Traces until there are `samples` paths a pixel, or until Ctrl-C is pressed: false.
pub fn refine(reference: &mut Reference, samples: u32) -> bool {
    static INTERRUPTED: AtomicBool = AtomicBool::new(false);
    // A second handler in one process is refused; the first then serves both.
    let _ = ctrlc::set_handler(|| {
        // Pressed again, it ends the program.
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    let missing = samples.saturating_sub(reference.samples());
    let bar = ProgressBar::new(u64::from(missing) * u64::from(reference.size().y));
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent} %, {eta} left") {
        bar.set_style(style);
    }
    // A few paths at a time, so that an interrupted picture is even.
    while reference.samples() < samples && !INTERRUPTED.load(Ordering::Relaxed) {
        let pass = (samples - reference.samples()).min(8);
        reference.render(pass, &INTERRUPTED, || bar.inc(u64::from(pass)));
    }
    bar.finish_and_clear();
    !INTERRUPTED.load(Ordering::Relaxed)
}

/// A view of the result: luminances in nits, or plain numbers.
pub fn picture(reference: &Reference, view: GiView) -> Result<Picture, String> {
    let values = reference.picture(self::view(view)?);
    let pixels = values
        .iter()
        .map(|value| {
            let shown = match view {
                GiView::Normal => *value * 0.5 + 0.5,
                _ => *value,
            };
            shown.extend(1.0).to_array()
        })
        .collect();
    Ok(Picture {
        size: reference.size(),
        pixels,
    })
}
