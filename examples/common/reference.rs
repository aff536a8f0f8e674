//! The path tracer, in the viewer.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use bevy::{
    asset::RenderAssetUsages,
    camera::{Hdr, ScalingMode, visibility::RenderLayers},
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    image::ImageSampler,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_gi::{
    GiView, NotGiCaster,
    reference::{Reference, ReferenceCamera, ReferenceScene, ReferenceSettings, ReferenceView},
};
use indicatif::{ProgressBar, ProgressStyle};

use super::headless::{Picture, image_target};

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

/// What a camera sees, path-traced with `samples` paths a pixel; with fewer, once interrupted.
pub fn trace(
    world: &mut World,
    camera: Entity,
    size: UVec2,
    samples: u32,
    settings: ReferenceSettings,
) -> Result<Reference, String> {
    let scene = Arc::new(ReferenceScene::new(world));
    let (Some(transform), Some(projection)) = (
        world.get::<GlobalTransform>(camera),
        world.get::<Projection>(camera),
    ) else {
        return Err("there is no camera".into());
    };
    let mut projection = projection.clone();
    projection.update(size.x as f32, size.y as f32);
    let camera = ReferenceCamera {
        world_from_view: transform.to_matrix(),
        clip_from_view: projection.get_clip_from_view(),
    };
    let mut reference = Reference::new(scene, camera, size, settings);

    let stop = Arc::new(AtomicBool::new(false));
    let interrupted = stop.clone();
    // A second handler in one process is refused; the first then serves both.
    let _ = ctrlc::set_handler(move || interrupted.store(true, Ordering::Relaxed));
    let bar = ProgressBar::new(u64::from(samples) * u64::from(size.y));
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {percent} %, {eta} left") {
        bar.set_style(style);
    }
    // A few paths at a time, so that an interrupted picture is even.
    while reference.samples() < samples && !stop.load(Ordering::Relaxed) {
        let pass = (samples - reference.samples()).min(8);
        reference.render(pass, &stop, || bar.inc(u64::from(pass)));
    }
    bar.finish_and_clear();
    Ok(reference)
}

/// A view of the result, as [`Headless::picture`](super::headless::Headless::picture) gives it: luminances
/// times `exposure`.
pub fn picture(reference: &Reference, view: GiView, exposure: f32) -> Result<Picture, String> {
    let values = reference.picture(self::view(view)?);
    let pixels = values
        .iter()
        .map(|value| {
            let shown = match view {
                GiView::Normal => *value * 0.5 + 0.5,
                _ if view.is_luminance() => *value * exposure,
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

/// Shows an exposed picture in `target`, tone-mapped as Bevy does it.
pub fn show(world: &mut World, picture: &Picture, target: &Handle<Image>) {
    let size = picture.size;
    let mut image = Image::new(
        Extent3d {
            width: size.x,
            height: size.y,
            depth_or_array_layers: 1,
        },
        TextureDimension::D2,
        picture
            .pixels
            .iter()
            .flatten()
            .flat_map(|c| half::f16::from_f32(c.min(65504.0)).to_le_bytes())
            .collect(),
        TextureFormat::Rgba16Float,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.sampler = ImageSampler::nearest();
    let image = world.resource_mut::<Assets<Image>>().add(image);
    let mesh = world
        .resource_mut::<Assets<Mesh>>()
        .add(Rectangle::from_size(size.as_vec2()));
    let material = world
        .resource_mut::<Assets<StandardMaterial>>()
        .add(StandardMaterial {
            base_color_texture: Some(image),
            unlit: true,
            ..default()
        });
    // A layer that the scene's camera does not see.
    let layer = RenderLayers::layer(1);
    world.spawn((
        Mesh3d(mesh),
        MeshMaterial3d(material),
        NotGiCaster,
        layer.clone(),
    ));
    world.spawn((
        Camera3d::default(),
        Camera {
            order: 1,
            ..default()
        },
        Hdr,
        Msaa::Off,
        image_target(target),
        Tonemapping::TonyMcMapface,
        DebandDither::Disabled,
        Projection::from(OrthographicProjection {
            scaling_mode: ScalingMode::Fixed {
                width: size.x as f32,
                height: size.y as f32,
            },
            ..OrthographicProjection::default_3d()
        }),
        Transform::from_xyz(0.0, 0.0, 1.0),
        layer,
    ));
}
