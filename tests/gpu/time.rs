//! Light over time: still where nothing changes, quick where something does; and volumes that move
//! or overlap.

use bevy::{diagnostic::FrameCount, prelude::*};
use bevy_gi::prelude::*;

use crate::{
    common::{
        figures::Stability,
        headless::Headless,
        scenes::{
            cornell::{self, CornellLight},
            stage::diffuse,
        },
    },
    support::{app, assert_sane, camera, material, mean, room, settle, show, spawn_cornell},
};

const SIZE: UVec2 = UVec2::new(192, 112);

fn cornell_box() -> (Headless, Handle<Image>) {
    let mut headless = app();
    spawn_cornell(&mut headless);
    let view = cornell::view();
    let (_, target) = camera(&mut headless, SIZE, view.eye, view.look, view.fov);
    show(&mut headless, GiView::Irradiance);
    (headless, target)
}

/// Temporal standard deviation of a still picture, over its mean.
#[test]
fn a_still_picture_stands_still() {
    let (mut headless, target) = cornell_box();
    settle(&mut headless, 80);
    let mut stability = Stability::new(SIZE);
    headless.record(&target, 48, |_, _| {}, |_, picture| stability.add(&picture));
    let relative = stability.deviation();
    println!(
        "still scene: mean temporal deviation {:.3} %",
        100.0 * relative
    );
    // Not to be seen: a step of an 8-bit sRGB display is about 1 % of luminance at mid grey.
    assert!(relative < 0.0075, "{relative}");
}

/// Frames until the light of a switched lamp has come to 90 % of where it goes.
#[test]
fn light_that_changes_is_followed() {
    let (mut headless, target) = cornell_box();
    settle(&mut headless, 60);
    let lit = mean(&headless.picture(&target));
    let set = |headless: &mut Headless, on: bool| {
        let world = headless.app.world_mut();
        let mut lights = world.query_filtered::<&mut PointLight, With<CornellLight>>();
        for mut light in lights.iter_mut(world) {
            light.intensity *= if on { 1e3 } else { 1e-3 };
        }
    };
    let frames_to = |headless: &mut Headless, from: f32, to: f32| {
        let count = |headless: &Headless| headless.app.world().resource::<FrameCount>().0;
        let start = count(headless);
        while count(headless) < start + 120 {
            // A read-back renders a few frames itself.
            let now = mean(&headless.picture(&target));
            if ((now - from) / (to - from)) > 0.9 {
                return count(headless) - start;
            }
        }
        panic!("the light does not change from {from} to {to} within 120 frames");
    };
    set(&mut headless, false);
    let off = frames_to(&mut headless, lit, 0.0);
    headless.steps(60);
    let dark = mean(&headless.picture(&target));
    assert!(dark < 0.01 * lit, "{dark} of {lit} lingers");
    set(&mut headless, true);
    let on = frames_to(&mut headless, dark, lit);
    println!("to 90 %: {off} frames after switching off, {on} after switching on");
    headless.steps(60);
    let again = mean(&headless.picture(&target));
    assert!(
        (again / lit - 1.0).abs() < 0.01,
        "{again} is not {lit} again"
    );
}

/// A lit room; its irradiance, seen from inside.
fn lit_room(volumes: impl FnOnce(&mut World)) -> (Headless, Entity, Handle<Image>) {
    let mut headless = app();
    let white = material(&mut headless, diffuse([0.6; 3]));
    room(
        &mut headless,
        Vec3::new(-3.0, -1.5, -3.0),
        Vec3::new(3.0, 1.5, 3.0),
        0.4,
        &white,
    );
    let world = headless.app.world_mut();
    world.spawn((
        PointLight {
            intensity: 20_000.0,
            range: 100.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(0.5, 0.7, -0.5),
    ));
    volumes(world);
    let (camera, target) = camera(
        &mut headless,
        SIZE,
        Vec3::new(2.2, 0.2, 2.2),
        Vec3::new(-1.0, -0.3, -1.0),
        70.0,
    );
    show(&mut headless, GiView::Irradiance);
    (headless, camera, target)
}

#[test]
fn volumes_may_follow_and_overlap() {
    let one = GiVolume::new(Vec3::new(7.0, 4.0, 7.0)).with_resolution(96);
    let (mut headless, _, target) = lit_room(|world| {
        world.spawn(one);
    });
    settle(&mut headless, 60);
    let truth = mean(&headless.picture(&target));

    // A finer volume inside a coarser one.
    let (mut headless, _, target) = lit_room(|world| {
        world.spawn(GiVolume::new(Vec3::new(9.0, 6.0, 9.0)).with_resolution(64));
        world.spawn(one);
    });
    settle(&mut headless, 60);
    let nested = mean(&headless.picture(&target));

    // A volume around the camera that covers the room, wherever the camera is.
    let (mut headless, camera, target) = lit_room(|world| {
        world.spawn(
            GiVolume::new(Vec3::splat(14.0))
                .with_resolution(192)
                .following_camera(),
        );
    });
    settle(&mut headless, 60);
    let following = mean(&headless.picture(&target));
    // There and back again, by no whole number of voxels.
    for x in [0.37, -0.61, 0.23, 0.01] {
        headless
            .app
            .world_mut()
            .get_mut::<Transform>(camera)
            .unwrap()
            .translation
            .x += x;
        headless.steps(2);
        assert_sane(&headless.picture(&target), "while moving");
    }
    headless.steps(50);
    let back = mean(&headless.picture(&target));
    println!("one {truth:.2}, nested {nested:.2}, following {following:.2}, back {back:.2} nits");
    assert!(
        (nested / truth - 1.0).abs() < 0.05,
        "nested: {nested}, one: {truth}"
    );
    assert!(
        (following / truth - 1.0).abs() < 0.05,
        "following: {following}, one: {truth}"
    );
    assert!(
        (back / following - 1.0).abs() < 0.02,
        "back: {back}, before: {following}"
    );
}
