//! What lies between a surface and the eye, and what a surface hides of its own light: fog and ambient occlusion, as the
//! composite applies them to indirect light.

use bevy::{
    asset::RenderAssetUsages,
    image::Image,
    pbr::{DistanceFog, FogFalloff, ScreenSpaceAmbientOcclusion},
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_gi::prelude::*;

use crate::{
    common::{
        headless::{Headless, Picture},
        scenes::stage::diffuse,
    },
    shared::SharedApp,
    support::{app, assert_sane, camera, luminance, material, settle, show, slab},
};

const SIZE: u32 = 48;
/// Height of the camera above the floor, metres.
const HEIGHT: f32 = 3.0;
/// Degrees that the camera sees.
const FOV: f32 = 60.0;

/// A floor under an even sky, seen from above; its indirect light. What is known of its light is that it stays the same.
fn floor(paint: StandardMaterial) -> (SharedApp, Entity, Handle<Image>) {
    let mut headless = app();
    let world = headless.app.world_mut();
    world.resource_mut::<VoxelConeTracingSettings>().bounces = 0;
    world.resource_mut::<GiSettings>().sky =
        GiSky::Constant(LinearRgba::rgb(1000.0, 1000.0, 1000.0));
    world.spawn(GiVolume::new(Vec3::new(6.0, 4.0, 6.0)).with_resolution(32));
    show(&mut headless, GiView::Indirect);
    let paint = material(&mut headless, paint);
    let (min, max) = (Vec3::new(-2.5, -0.5, -2.5), Vec3::new(2.5, 0.0, 2.5));
    slab(&mut headless, min, max, &paint);
    let eye = Vec3::Y * HEIGHT;
    let (camera, target) = camera(&mut headless, UVec2::splat(SIZE), eye, Vec3::ZERO, FOV);
    (headless, camera, target)
}

fn settled(headless: &mut Headless, target: &Handle<Image>) -> Picture {
    // No light bounces, and the turning cones have come to their mean.
    settle(headless, 64);
    let picture = headless.picture(target);
    assert_sane(&picture, "floor");
    picture
}

/// Metres from the camera to the floor, by pixel.
fn distance(pixel: usize) -> f32 {
    let at = UVec2::new(pixel as u32 % SIZE, pixel as u32 / SIZE).as_vec2();
    let across = (at + 0.5) / SIZE as f32 * 2.0 - 1.0;
    let tangent = (0.5 * FOV).to_radians().tan();
    HEIGHT * (across * tangent).extend(1.0).length()
}

/// Fog lets as much of the light through as Bevy's formulas say of each pixel's distance.
#[test]
fn fog_dims_light_by_its_distance() {
    let (mut headless, camera, target) = floor(diffuse([0.5; 3]));
    let clear = settled(&mut headless, &target);
    let alpha = 0.8;
    // What each kind of fog hides at a distance, of red, green and blue.
    type Hidden = fn(f32) -> Vec3;
    let kinds: [(FogFalloff, Hidden); 4] = [
        (
            FogFalloff::Linear {
                start: 1.0,
                end: 5.0,
            },
            |d| Vec3::splat((d - 1.0) / 4.0),
        ),
        (FogFalloff::Exponential { density: 0.2 }, |d| {
            Vec3::splat(1.0 - (-0.2 * d).exp())
        }),
        (FogFalloff::ExponentialSquared { density: 0.2 }, |d| {
            Vec3::splat(1.0 - (-(0.2 * d).powi(2)).exp())
        }),
        (
            FogFalloff::Atmospheric {
                extinction: Vec3::new(0.1, 0.2, 0.3),
                inscattering: Vec3::ONE,
            },
            |d| 1.0 - (-d * Vec3::new(0.1, 0.2, 0.3)).exp(),
        ),
    ];
    for (falloff, hidden) in kinds {
        let fog = DistanceFog {
            color: Color::WHITE.with_alpha(alpha),
            falloff: falloff.clone(),
            ..default()
        };
        headless.app.world_mut().entity_mut(camera).insert(fog);
        headless.steps(2);
        let foggy = headless.picture(&target);
        for (i, (seen, clear)) in foggy.pixels.iter().zip(&clear.pixels).enumerate() {
            let expected = 1.0 - alpha * hidden(distance(i));
            for c in 0..3 {
                let ratio = seen[c] / clear[c];
                // Cones turn on: a pixel's light moves by a part of a hundredth. The target is of half floats.
                assert!(
                    (ratio - expected[c]).abs() < 0.02,
                    "{falloff:?}, pixel {i}: {ratio} in place of {expected}"
                );
            }
        }
    }
}

/// The occlusion map of a material takes its part of the light that the surface reflects.
#[test]
fn a_material_hides_a_part_of_its_light() {
    let light = |occlusion: Option<u8>| {
        let (mut headless, _, target) = floor(diffuse([0.5; 3]));
        if let Some(part) = occlusion {
            let size = Extent3d {
                width: 1,
                height: 1,
                depth_or_array_layers: 1,
            };
            let map = Image::new(
                size,
                TextureDimension::D2,
                vec![part, 0, 0, 255],
                TextureFormat::Rgba8Unorm,
                RenderAssetUsages::RENDER_WORLD,
            );
            let world = headless.app.world_mut();
            let map = world.resource_mut::<Assets<Image>>().add(map);
            let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
            for (_, material) in materials.iter_mut() {
                material.occlusion_texture = Some(map.clone());
            }
        }
        let picture = settled(&mut headless, &target);
        luminance(&picture.pixels[(SIZE * SIZE / 2 + SIZE / 2) as usize])
    };
    let open = light(None);
    for part in [0, 51, 255] {
        let ratio = light(Some(part)) / open;
        // The G-buffer holds 8 bits.
        let expected = f32::from(part) / 255.0;
        assert!((ratio - expected).abs() < 0.01, "{ratio}, not {expected}");
    }
}

/// Bevy's screen-space ambient occlusion takes its part of each pixel's light: the part that its view shows.
#[test]
fn ambient_occlusion_of_the_screen_takes_what_its_view_shows() {
    let (mut headless, camera, target) = floor(diffuse([0.5; 3]));
    let white = material(&mut headless, diffuse([0.5; 3]));
    let (min, max) = (Vec3::new(-2.5, 0.0, -2.5), Vec3::new(-0.5, 1.0, 2.5));
    slab(&mut headless, min, max, &white);
    let clear = settled(&mut headless, &target);
    let world = headless.app.world_mut();
    let occlusion = ScreenSpaceAmbientOcclusion::default();
    world.entity_mut(camera).insert(occlusion);
    let occluded = settled(&mut headless, &target);
    show(&mut headless, GiView::Occlusion);
    headless.steps(2);
    let view = headless.picture(&target);
    let (mut least, mut most) = (1.0f32, 0.0f32);
    for (i, part) in view.pixels.iter().enumerate() {
        let ratio = occluded.pixels[i][1] / clear.pixels[i][1];
        assert!(
            (ratio - part[1]).abs() < 0.02,
            "pixel {i}: {ratio}, {part:?}"
        );
        (least, most) = (least.min(part[1]), most.max(part[1]));
    }
    println!("from {least:.3} to {most:.3} is left by ambient occlusion");
    // Something is hidden, and not everywhere as much.
    assert!(least < 0.9 && most - least > 0.05, "{least} to {most}");
}
