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
    shared::SharedApp,
    support::{
        CONES, HINTS, app, assert_sane, camera, choose, material, mean, room, settle, show,
        spawn_coarse_cornell,
    },
};

const SIZE: UVec2 = UVec2::new(128, 72);

fn cornell_box(technique: GiTechnique) -> (SharedApp, Handle<Image>) {
    let mut headless = app();
    choose(&mut headless, technique);
    // Half of the usual detail: what takes time does so with fewer voxels as well.
    spawn_coarse_cornell(&mut headless, 64, 12);
    let view = cornell::view();
    let (_, target) = camera(&mut headless, SIZE, view.eye, view.look, view.fov);
    show(&mut headless, GiView::Irradiance);
    (headless, target)
}

/// Temporal standard deviation of a still picture, over its mean. A step of an 8-bit sRGB display is about 1 % of
/// luminance at mid grey.
fn stands_still(
    headless: &mut Headless,
    target: &Handle<Image>,
    technique: GiTechnique,
    most: f32,
) {
    let mut stability = Stability::new(SIZE);
    headless.record(target, 48, |_, _| {}, |_, picture| stability.add(&picture));
    let relative = stability.deviation();
    println!(
        "still scene, {technique:?}: mean temporal deviation {:.3} %",
        100.0 * relative
    );
    assert!(relative < most, "{relative}");
}

/// Frames until the light of a lamp that is switched has come to 90 % of where it goes, for good, and that none of
/// it lingers.
fn follows_a_lamp(
    headless: &mut Headless,
    target: &Handle<Image>,
    technique: GiTechnique,
    most: u32,
) {
    let lit = mean(&headless.picture(target));
    let [(off, dark), (on, again)] = [false, true].map(|on| {
        let world = headless.app.world_mut();
        let mut lights = world.query_filtered::<&mut PointLight, With<CornellLight>>();
        for mut light in lights.iter_mut(world) {
            light.intensity *= if on { 1e3 } else { 1e-3 };
        }
        let mut means = Vec::new();
        headless.record(
            target,
            48,
            |_, _| {},
            |_, picture| means.push(mean(&picture)),
        );
        headless.steps(24);
        let to = mean(&headless.picture(target));
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
fn light_stands_still_and_follows_what_changes() {
    // Deviation of a still picture, and frames of a reaction.
    for (technique, deviation, frames) in [(CONES, 0.0075, 40), (HINTS, 0.002, 8)] {
        let (mut headless, target) = cornell_box(technique);
        settle(&mut headless, 80);
        stands_still(&mut headless, &target, technique, deviation);
        follows_a_lamp(&mut headless, &target, technique, frames);
    }
}

/// A lit room; its irradiance, seen from inside.
fn lit_room(volumes: impl FnOnce(&mut World)) -> (SharedApp, Entity, Handle<Image>) {
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
    let one = GiVolume::new(Vec3::new(7.0, 4.0, 7.0)).with_resolution(56);
    let spawn_one = |world: &mut World| _ = world.spawn(one);
    let light = |volumes: &dyn Fn(&mut World)| {
        let (mut headless, _, target) = lit_room(volumes);
        settle(&mut headless, 40);
        mean(&headless.picture(&target))
    };
    let truth = light(&spawn_one);
    // A finer volume inside a coarser one.
    let nested = light(&|world| {
        world.spawn(GiVolume::new(Vec3::new(9.0, 6.0, 9.0)).with_resolution(36));
        spawn_one(world);
    });

    // A volume around the camera that covers the room, wherever the camera is.
    let (mut headless, camera, target) = lit_room(|world| {
        world.spawn(
            GiVolume::new(Vec3::splat(14.0))
                .with_resolution(112)
                .following_camera(),
        );
    });
    settle(&mut headless, 40);
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
