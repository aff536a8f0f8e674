//! Cameras of every kind: side by side, above each other, orthographic, far away, in scenes of any size, with targets
//! that change.

use std::sync::{Mutex, PoisonError};

use bevy::{
    camera::{Hdr, ScalingMode, Viewport},
    pbr::ScreenSpaceAmbientOcclusion,
    prelude::*,
    render::{render_resource::TextureFormat, view::Msaa},
};
use bevy_gi::prelude::*;

use crate::{
    common::{
        figures::{Errors, blocks},
        headless::{Headless, Picture, image_target, readable_target},
        scenes::stage::{Stage, diffuse, shining},
    },
    shared::SharedApp,
    support::{
        self, CONES, HINTS, TECHNIQUES, UNIT_EV100, app, assert_sane, choose, luminance, mean,
        settle, show,
    },
};

const SIZE: UVec2 = UVec2::new(96, 64);
const EYE: Vec3 = Vec3::new(0.2, 1.1, 3.6);
const LOOK: Vec3 = Vec3::new(0.0, 0.9, 0.0);
const HISTORY: u32 = 32;

/// A room of 2 m, open towards +z, with a block and a panel that shines, `scale` times as large; its indirect light
/// is seen.
fn open_room(technique: GiTechnique, scale: f32) -> SharedApp {
    let mut headless = app();
    choose(&mut headless, technique);
    show(&mut headless, GiView::Indirect);
    let mut stage = Stage(headless.app.world_mut());
    let (white, red) = (stage.paint([0.7; 3]), stage.paint([0.6, 0.1, 0.1]));
    let panel = stage.material(shining([50.0, 45.0, 40.0], UNIT_EV100));
    for (min, max, paint) in [
        ([-1.1, -0.1, -1.1], [1.1, 0.0, 1.0], &white),
        ([-1.1, 2.0, -1.1], [1.1, 2.1, 1.0], &white),
        ([-1.1, 0.0, -1.1], [1.1, 2.0, -1.0], &white),
        ([-1.1, 0.0, -1.0], [-1.0, 2.0, 1.0], &red),
        ([1.0, 0.0, -1.0], [1.1, 2.0, 1.0], &white),
        ([-0.6, 0.0, -0.5], [0.0, 1.1, 0.1], &white),
        ([0.1, 1.8, -0.3], [0.6, 1.9, 0.3], &panel),
    ] {
        stage.slab(scale * Vec3::from(min), scale * Vec3::from(max), paint);
    }
    let (min, max) = (Vec3::new(-1.1, -0.1, -1.1), Vec3::new(1.1, 2.1, 1.0));
    let world = headless.app.world_mut();
    // Few probes: it is cameras that are compared.
    let probes = ProbeSet::default().with_resolution(10);
    world.spawn((GiVolume::around(scale * min, scale * max, 48), probes));
    headless
}

/// A camera with half of the usual history, which is full after half of the frames.
fn camera(
    headless: &mut Headless,
    size: UVec2,
    eye: Vec3,
    look: Vec3,
    fov: f32,
) -> (Entity, Handle<Image>) {
    let (camera, target) = support::camera(headless, size, eye, look, fov);
    let world = headless.app.world_mut();
    world.get_mut::<GiCamera>(camera).unwrap().history_frames = HISTORY;
    (camera, target)
}

/// Relative RMSE of 8x8-pixel means.
fn difference(a: &Picture, b: &Picture) -> f32 {
    let errors = Errors::new(&blocks(a), &blocks(b));
    errors.expect("something is lit").relative_rmse
}

fn settled(headless: &mut Headless, target: &Handle<Image>) -> Picture {
    // Until light rests, and nothing else is left in the history of pictures.
    settle(headless, 32 + HISTORY);
    let picture = headless.picture(target);
    assert_sane(&picture, "settled");
    picture
}

/// What a camera of the usual place and lens sees of the room of the usual size.
fn usual(technique: GiTechnique) -> Picture {
    static SEEN: Mutex<Vec<(GiTechnique, Picture)>> = Mutex::new(Vec::new());
    let mut seen = SEEN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, picture)) = seen.iter().find(|(of, _)| *of == technique) {
        return picture.clone();
    }
    let mut headless = open_room(technique, 1.0);
    let (_, target) = camera(&mut headless, SIZE, EYE, LOOK, 40.0);
    let picture = settled(&mut headless, &target);
    seen.push((technique, picture.clone()));
    picture
}

/// Light of panels does not depend on the size of the world, nor the way in which it is filtered.
#[test]
fn a_scene_of_any_size_looks_the_same() {
    for technique in TECHNIQUES {
        let shot = |scale: f32| {
            let mut headless = open_room(technique, scale);
            let (camera, target) = camera(&mut headless, SIZE, scale * EYE, scale * LOOK, 40.0);
            let mut lens = headless.app.world_mut().entity_mut(camera);
            if let Projection::Perspective(lens) = &mut *lens.get_mut::<Projection>().unwrap() {
                lens.near *= scale;
            }
            settled(&mut headless, &target)
        };
        let at_one = usual(technique);
        for scale in [1e-3, 1e3] {
            let apart = difference(&shot(scale), &at_one);
            println!("{technique:?}, scale {scale}: relative RMSE to scale 1 is {apart:.4}");
            // What is left are voxels on whose border a face lies, which rounding decides.
            assert!(apart < 0.03, "{technique:?} at scale {scale}: {apart}");
        }
    }
}

/// A camera in a scaled hierarchy, as glTF files bring it, measures depth in other units than metres.
#[test]
fn the_scale_of_a_camera_is_not_seen() {
    let mut headless = open_room(CONES, 1.0);
    let (camera, target) = camera(&mut headless, SIZE, EYE, LOOK, 40.0);
    let usual = usual(CONES);
    for scale in [0.002, 500.0] {
        let mut camera = headless.app.world_mut().entity_mut(camera);
        camera.get_mut::<Transform>().unwrap().scale = Vec3::splat(scale);
        if let Projection::Perspective(lens) = &mut *camera.get_mut::<Projection>().unwrap() {
            lens.near = 0.05 / scale;
        }
        let scaled = settled(&mut headless, &target);
        let apart = difference(&scaled, &usual);
        println!("camera scaled by {scale}: relative RMSE {apart:.4}");
        assert!(apart < 0.005, "scaled by {scale}: {apart}");
    }
}

/// A camera that walks and turns sees about what one sees that has always stood there: the history of its pictures moves
/// along with what they show.
#[test]
fn a_camera_that_moves_sees_what_a_still_one_sees() {
    // Relative RMSE: 0.21 and 0.38, most of it on the ceiling beside the panel. Without any history, it is 0.15 and 0.05.
    for (technique, most) in [(CONES, 0.25), (HINTS, 0.45)] {
        let mut headless = open_room(technique, 1.0);
        let (camera, target) = camera(&mut headless, SIZE, EYE, LOOK, 40.0);
        settled(&mut headless, &target);
        let frames = 30;
        let mut moving = None;
        headless.record(
            &target,
            frames,
            |world, frame| {
                // 1.4 m/s, and up to 30 degrees a second.
                let way = (frame + 1) as f32 / frames as f32;
                let eye = EYE + Vec3::new(-0.6, 0.1, -0.3) * way;
                let mut place = Transform::from_translation(eye).looking_at(LOOK, Vec3::Y);
                place.rotate_y(15f32.to_radians() * (1.0 - way) * way);
                world.entity_mut(camera).insert(place);
            },
            |_, picture| {
                assert_sane(&picture, "moving");
                moving = Some(picture);
            },
        );
        let moving = moving.expect("pictures are taken");
        headless.steps(70);
        let still = headless.picture(&target);
        let mut fresh = None;
        headless.record(
            &target,
            1,
            |world, _| world.get_mut::<GiCamera>(camera).unwrap().reset = true,
            |_, picture| fresh = Some(picture),
        );
        let fresh = fresh.expect("a picture is taken");
        let (apart, fresh) = (difference(&moving, &still), difference(&fresh, &still));
        println!(
            "{technique:?}: relative RMSE {apart:.4} while moving, {fresh:.4} without history"
        );
        assert!(apart < most, "{technique:?}: {apart}");
    }
}

/// However far away it stands, a camera whose lens shows the same room sees the same light; from infinitely far away
/// it is orthographic.
#[test]
fn distance_and_lens_do_not_matter() {
    let height = 2.4f32;
    let at = |distance: f32| LOOK + Vec3::new(0.05, 0.08, 1.0).normalize() * distance;
    let shot = |distance: f32, projection: Projection| {
        // Hints meet the panel by the same rays.
        let mut headless = open_room(HINTS, 1.0);
        let (camera, target) = camera(&mut headless, SIZE, at(10.0), LOOK, 40.0);
        let place = Transform::from_translation(at(distance)).looking_at(LOOK, Vec3::Y);
        let mut camera = headless.app.world_mut().entity_mut(camera);
        camera.insert((place, projection));
        settled(&mut headless, &target)
    };
    let orthographic = shot(
        10.0,
        Projection::from(OrthographicProjection {
            scaling_mode: ScalingMode::FixedVertical {
                viewport_height: height,
            },
            near: 0.0,
            far: 100.0,
            ..OrthographicProjection::default_3d()
        }),
    );
    let distance = 1000.0;
    let lens = PerspectiveProjection {
        fov: 2.0 * (0.5 * height / distance).atan(),
        near: 0.5 * distance,
        far: 2.0 * distance,
        ..default()
    };
    let apart = difference(&shot(distance, Projection::from(lens)), &orthographic);
    println!("{distance} m away: relative RMSE to an orthographic camera {apart:.4}");
    // At 1 km perspective is a tenth of a pixel; from much farther away, single-precision positions are too coarse for a
    // room (at 30 km: 0.29).
    assert!(apart < 0.05, "{distance} m away: {apart}");
}

/// Cuts one half out of a picture.
fn half(picture: &Picture, side: u32) -> Picture {
    let size = UVec2::new(picture.size.x / 2, picture.size.y);
    let pixel = |i: u32| {
        picture.pixels[(i / size.x * picture.size.x + side * size.x + i % size.x) as usize]
    };
    let pixels = (0..size.element_product()).map(pixel).collect();
    Picture { size, pixels }
}

/// Spawns a camera beside the first on the right half of its target, with the first on the left half.
fn split(headless: &mut Headless, first: Entity) -> Entity {
    let world = headless.app.world_mut();
    let second = world.entity_mut(first).clone_and_spawn();
    for (side, camera) in [first, second].into_iter().enumerate() {
        world.get_mut::<Camera>(camera).unwrap().viewport = Some(Viewport {
            physical_position: UVec2::new(side as u32 * SIZE.x, 0),
            physical_size: SIZE,
            ..default()
        });
    }
    let mut camera = world.get_mut::<Camera>(second).unwrap();
    camera.order = 1;
    camera.clear_color = ClearColorConfig::None;
    second
}

/// Each half of a split screen has the light of its own technique, and ambient occlusion of its own pixels.
#[test]
fn halves_of_a_screen_are_lit_alike() {
    for ssao in [false, true] {
        let mut headless = open_room(CONES, 1.0);
        let single = match ssao {
            false => usual(CONES),
            true => {
                let (alone, target) = camera(&mut headless, SIZE, EYE, LOOK, 40.0);
                let world = headless.app.world_mut();
                let occlusion = ScreenSpaceAmbientOcclusion::default();
                world.entity_mut(alone).insert(occlusion);
                let single = settled(&mut headless, &target);
                headless.app.world_mut().despawn(alone);
                single
            }
        };

        let wide = UVec2::new(2 * SIZE.x, SIZE.y);
        let (left, target) = camera(&mut headless, wide, EYE, LOOK, 40.0);
        let right = split(&mut headless, left);
        let world = headless.app.world_mut();
        for camera in [left, right] {
            if ssao {
                let occlusion = ScreenSpaceAmbientOcclusion::default();
                world.entity_mut(camera).insert(occlusion);
            }
        }
        let both = settled(&mut headless, &target);
        for side in 0..2 {
            let apart = difference(&half(&both, side), &single);
            println!("side {side}, ssao {ssao}: relative RMSE to a camera alone {apart:.4}");
            // Bevy 0.19.1 computes the occlusion of a viewport from the depth of the whole target, squeezed
            // (bevyengine/bevy#25319). Without light in one half it would be 1.
            // Cones have turned by other angles before.
            let bound = if ssao { 0.25 } else { 0.003 };
            assert!(apart < bound, "side {side}, ssao {ssao}: {apart}");
        }
    }
}

/// Two cameras with two techniques show what each shows alone.
#[test]
fn cameras_have_techniques_of_their_own() {
    let alone = TECHNIQUES.map(usual);
    let mut headless = open_room(GiTechnique::OFF, 1.0);
    let wide = UVec2::new(2 * SIZE.x, SIZE.y);
    let (left, target) = camera(&mut headless, wide, EYE, LOOK, 40.0);
    let right = split(&mut headless, left);
    for (camera, technique) in [left, right].into_iter().zip(TECHNIQUES) {
        let camera = &mut headless.app.world_mut().entity_mut(camera);
        camera.insert(GiCamera {
            history_frames: HISTORY,
            ..GiCamera::with_technique(technique)
        });
    }
    let both = settled(&mut headless, &target);
    for (side, alone) in (0..).zip(&alone) {
        let apart = difference(&half(&both, side), alone);
        // Hints meet the panel by other rays.
        assert!(apart < 0.03, "{:?}: {apart}", TECHNIQUES[side as usize]);
    }
}

/// What a camera above the GI camera draws is over its picture, whatever its format.
#[test]
fn a_camera_above_leaves_the_picture_below() {
    let mut headless = open_room(HINTS, 1.0);
    let (_, target) = camera(&mut headless, SIZE, EYE, LOOK, 40.0);
    let below = settled(&mut headless, &target);
    let over = |order| Camera {
        order,
        clear_color: ClearColorConfig::None,
        ..default()
    };
    // Half of red over the left half.
    let sprite = Sprite::from_color(
        Color::linear_rgba(1.0, 0.0, 0.0, 0.5),
        Vec2::new(SIZE.x as f32 / 2.0, SIZE.y as f32),
    );
    let at = Transform::from_xyz(-(SIZE.x as f32) / 4.0, 0.0, 0.0);
    headless.app.world_mut().spawn((sprite, at));
    for (what, hdr, msaa) in [
        ("plain", false, Msaa::Sample4),
        ("HDR", true, Msaa::Sample4),
        ("without MSAA", false, Msaa::Off),
        ("of the same format", true, Msaa::Off),
    ] {
        let world = headless.app.world_mut();
        let mut overlay = world.spawn((Camera2d, over(1), msaa, image_target(&target)));
        if hdr {
            overlay.insert(Hdr);
        }
        let overlay = overlay.id();
        // One more, which shows nothing; 2D cameras of one target must agree in MSAA, or Bevy fails.
        let layers = bevy::camera::visibility::RenderLayers::layer(5);
        let bundle = (Camera2d, over(2), msaa, layers, image_target(&target));
        let last = headless.app.world_mut().spawn(bundle).id();
        // Enough for what is not cleared to pile up.
        assert!(headless.wait_until(|_| true));
        assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
        headless.steps(4);
        let picture = headless.picture(&target);
        for (x, y) in [(20, 40), (70, 40), (60, 10)] {
            let at = (y * SIZE.x + x) as usize;
            let (ours, under) = (picture.pixels[at], below.pixels[at]);
            let expected = match x < SIZE.x / 2 {
                true => [0.5 + 0.5 * under[0], 0.5 * under[1], 0.5 * under[2]],
                false => [under[0], under[1], under[2]],
            };
            for c in 0..3 {
                let apart = (ours[c] - expected[c]).abs();
                // Half floats, and 8 bits of alpha.
                assert!(
                    apart < 0.01 * expected[c].max(0.5),
                    "{what}, at {x} {y}: {ours:?} in place of {expected:?}"
                );
            }
        }
        headless.app.world_mut().despawn(overlay);
        headless.app.world_mut().despawn(last);
    }
}

/// Targets of any size and format, viewports of one pixel, cameras that go and come back.
#[test]
fn targets_change_and_cameras_come_and_go() {
    let mut headless = open_room(CONES, 1.0);
    let watch = camera;
    let (camera, target) = watch(&mut headless, SIZE, EYE, LOOK, 40.0);
    let usual = settled(&mut headless, &target);
    let change = |headless: &mut Headless, size: UVec2, format: TextureFormat| {
        let mut images = headless.app.world_mut().resource_mut::<Assets<Image>>();
        images
            .insert(target.id(), readable_target(size, format))
            .unwrap();
        headless.steps(3);
        assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
    };
    for size in [[1, 1], [3, 1], [7, 5], [200, 2]] {
        change(&mut headless, size.into(), TextureFormat::Rgba32Float);
        let picture = headless.picture(&target);
        assert_sane(&picture, &format!("{size:?}"));
        // Its one pixel is that of the middle.
        assert!(size != [1, 1] || mean(&picture) > 0.0, "{size:?} is dark");
    }
    change(&mut headless, SIZE, TextureFormat::Rgba8UnormSrgb);
    assert!(mean(&headless.picture(&target)) > 0.1);
    change(&mut headless, SIZE, TextureFormat::Rgba32Float);
    assert!(difference(&settled(&mut headless, &target), &usual) < 0.003);

    // Without a pixel, Bevy 0.19.1 itself makes a texture without texels (`prepare_cluster_dummy_textures`).
    let world = headless.app.world_mut();
    world.get_mut::<Camera>(camera).unwrap().viewport = Some(Viewport {
        physical_size: UVec2::ONE,
        ..default()
    });
    headless.steps(3);
    let world = headless.app.world_mut();
    world.get_mut::<Camera>(camera).unwrap().viewport = None;
    assert!(difference(&settled(&mut headless, &target), &usual) < 0.003);

    // While it is off, the panel goes out, as another camera sees; what this one remembers is not shown.
    let (_, _watching) = watch(&mut headless, UVec2::ONE, EYE, LOOK, 40.0);
    let switch = |headless: &mut Headless, on: bool| {
        let world = headless.app.world_mut();
        world.get_mut::<Camera>(camera).unwrap().is_active = on;
        headless.steps(2);
    };
    switch(&mut headless, false);
    let world = headless.app.world_mut();
    for (_, material) in world.resource_mut::<Assets<StandardMaterial>>().iter_mut() {
        *material = diffuse([0.5; 3]);
    }
    headless.steps(40);
    switch(&mut headless, true);
    headless.steps(1);
    let dark = headless.picture(&target);
    let lit: f32 = usual.pixels.iter().map(|p| luminance(p)).sum();
    let left: f32 = dark.pixels.iter().map(|p| luminance(p)).sum();
    assert!(
        left < 0.01 * lit,
        "{left} of {lit} is left of a panel that is out"
    );
}
