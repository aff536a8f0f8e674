//! Light over time: still where nothing changes, quick where something does; and volumes that move
//! or overlap.

use bevy::prelude::*;
use bevy_gi::prelude::*;

use crate::{
    common::{
        figures::{Stability, frames_to_90_percent},
        headless::Headless,
        scenes::{
            cornell::{self, CornellLight},
            stage::diffuse,
        },
    },
    support::{
        CONES, HINTS, app, assert_sane, camera, choose, material, mean, room, settle, show,
        spawn_cornell,
    },
};

const SIZE: UVec2 = UVec2::new(192, 112);

fn cornell_box(technique: GiTechnique) -> (Headless, Handle<Image>) {
    let mut headless = app();
    choose(&mut headless, technique);
    spawn_cornell(&mut headless);
    let view = cornell::view();
    let (_, target) = camera(&mut headless, SIZE, view.eye, view.look, view.fov);
    show(&mut headless, GiView::Irradiance);
    (headless, target)
}

/// Temporal standard deviation of a still picture, over its mean. A step of an 8-bit sRGB display is about 1 % of
/// luminance at mid grey.
fn check_stillness(technique: GiTechnique, most: f32) {
    let (mut headless, target) = cornell_box(technique);
    settle(&mut headless, 80);
    let mut stability = Stability::new(SIZE);
    headless.record(&target, 48, |_, _| {}, |_, picture| stability.add(&picture));
    let relative = stability.deviation();
    println!(
        "still scene, {technique:?}: mean temporal deviation {:.3} %",
        100.0 * relative
    );
    assert!(relative < most, "{relative}");
}

#[test]
fn a_still_picture_stands_still() {
    check_stillness(CONES, 0.0075);
}

#[test]
fn a_still_picture_of_hints_stands_still() {
    check_stillness(HINTS, 0.002);
}

/// Frames until the light of a lamp that is switched has come to 90 % of where it goes, for good, and that none of
/// it lingers.
fn check_reaction(technique: GiTechnique, most: u32) {
    let (mut headless, target) = cornell_box(technique);
    settle(&mut headless, 60);
    let lit = mean(&headless.picture(&target));
    let [(off, dark), (on, again)] = [false, true].map(|on| {
        let world = headless.app.world_mut();
        let mut lights = world.query_filtered::<&mut PointLight, With<CornellLight>>();
        for mut light in lights.iter_mut(world) {
            light.intensity *= if on { 1e3 } else { 1e-3 };
        }
        let mut means = Vec::new();
        headless.record(
            &target,
            60,
            |_, _| {},
            |_, picture| means.push(mean(&picture)),
        );
        headless.steps(40);
        let to = mean(&headless.picture(&target));
        let from = if on { 1e-3 * lit } else { lit };
        let ways: Vec<_> = [from]
            .iter()
            .chain(&means)
            .map(|now| (now - to).abs())
            .collect();
        (frames_to_90_percent(&ways), to)
    });
    println!("{technique:?}, to 90 %: {off} frames after switching off, {on} after switching on");
    assert!(dark < 0.01 * lit, "{dark} of {lit} lingers");
    assert!(
        (again / lit - 1.0).abs() < 0.01,
        "{again} is not {lit} again"
    );
    assert!(off < most && on < most, "{off} and {on} frames");
}

#[test]
fn light_that_changes_is_followed() {
    check_reaction(CONES, 40);
}

#[test]
fn hints_follow_light_that_changes() {
    check_reaction(HINTS, 8);
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
