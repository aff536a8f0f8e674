//! Light from outside of a volume: what casts into it, and what shines into it, from anywhere.

use bevy::prelude::*;
use bevy_gi::prelude::*;

use crate::{
    common::{headless::Headless, scenes::stage::diffuse},
    shared::SharedApp,
    support::{TECHNIQUES, app, camera, choose, material, mean, settle, show, slab},
};

fn sun(headless: &mut Headless, direction: Vec3) {
    let light = DirectionalLight {
        illuminance: 10_000.0,
        shadow_maps_enabled: true,
        ..default()
    };
    let transform = Transform::default().looking_to(direction, Vec3::Z);
    headless.app.world_mut().spawn((light, transform));
}

/// A volume around what stands at a place.
fn small_volume(at: Vec3) -> impl Bundle {
    (
        GiVolume::new(Vec3::new(6.0, 4.0, 6.0)).with_resolution(32),
        ProbeSet::default().with_resolution(10),
        Transform::from_translation(at + Vec3::Y),
    )
}

/// A floor and a red wall in a small volume, seen from close by; indirect light only.
fn yard(technique: GiTechnique) -> (SharedApp, Handle<Image>) {
    let mut headless = app();
    choose(&mut headless, technique);
    show(&mut headless, GiView::Indirect);
    let white = material(&mut headless, diffuse([0.7; 3]));
    let red = material(&mut headless, diffuse([0.6, 0.1, 0.1]));
    slab(
        &mut headless,
        Vec3::new(-9.0, -0.5, -9.0),
        Vec3::new(9.0, 0.0, 9.0),
        &white,
    );
    slab(
        &mut headless,
        Vec3::new(-2.0, 0.0, -2.0),
        Vec3::new(2.0, 2.0, -1.5),
        &red,
    );
    headless.app.world_mut().spawn(small_volume(Vec3::ZERO));
    let (eye, look) = (Vec3::new(1.5, 1.6, 2.6), Vec3::new(0.0, 0.5, -1.0));
    let (_, target) = camera(&mut headless, UVec2::new(48, 32), eye, look, 50.0);
    (headless, target)
}

/// A roof two hundred metres above, far outside of the volume, keeps all of the sun out: nothing is lit, so nothing may
/// bounce.
#[test]
fn a_roof_far_above_the_volume_keeps_the_sun_out() {
    for technique in TECHNIQUES {
        let (mut headless, target) = yard(technique);
        sun(&mut headless, Vec3::new(0.2, -1.0, -0.3));
        settle(&mut headless, 24);
        let open = mean(&headless.picture(&target));
        assert!(open > 10.0, "{technique:?}: {open} nits in the open");
        let white = material(&mut headless, diffuse([0.7; 3]));
        // As wide as the sun's slant needs it: 40 m to one side, 60 m to the other.
        slab(
            &mut headless,
            Vec3::new(-60.0, 200.0, 40.0),
            Vec3::new(-20.0, 201.0, 80.0),
            &white,
        );
        settle(&mut headless, 24);
        let below = mean(&headless.picture(&target));
        println!("{technique:?}: {open} nits in the open, {below} below the roof");
        assert!(below < 0.01 * open, "{technique:?}: {below} of {open} nits");
    }
}

/// A lamp that stands outside of the volume lights it, and what stands between casts into it, though neither is near.
#[test]
fn lamps_outside_of_a_volume_reach_into_it() {
    for technique in TECHNIQUES {
        let (mut headless, target) = yard(technique);
        let lamp = PointLight {
            intensity: 4e6,
            range: 200.0,
            shadow_maps_enabled: true,
            ..default()
        };
        let at = Transform::from_xyz(0.0, 30.0, 30.0);
        headless.app.world_mut().spawn((lamp, at));
        settle(&mut headless, 24);
        let open = mean(&headless.picture(&target));
        assert!(open > 1.0, "{technique:?}: {open} nits");
        let white = material(&mut headless, diffuse([0.7; 3]));
        slab(
            &mut headless,
            Vec3::new(-4.0, 20.0, 17.0),
            Vec3::new(4.0, 21.0, 25.0),
            &white,
        );
        settle(&mut headless, 24);
        let below = mean(&headless.picture(&target));
        println!("{technique:?}: {open} nits, {below} behind the board");
        assert!(below < 0.02 * open, "{technique:?}: {below} of {open} nits");
    }
}

/// Two yards 400 m apart, each with its volume: the one looks the same with and without the other. A map around both
/// would have texels of metres.
#[test]
fn a_second_volume_far_away_changes_nothing() {
    for technique in TECHNIQUES {
        let (mut headless, target) = yard(technique);
        sun(&mut headless, Vec3::new(-1.0, -0.6, 0.2));
        settle(&mut headless, 32);
        let alone = headless.picture(&target);
        headless
            .app
            .world_mut()
            .spawn(small_volume(Vec3::Z * 400.0));
        let white = material(&mut headless, diffuse([0.7; 3]));
        slab(
            &mut headless,
            Vec3::new(-9.0, -0.5, 391.0),
            Vec3::new(9.0, 0.0, 409.0),
            &white,
        );
        settle(&mut headless, 32);
        let both = headless.picture(&target);
        let ratio = mean(&both) / mean(&alone);
        println!("{technique:?}: {ratio}");
        // What is left is the noise of hints, which look at other virtual point lights.
        assert!((ratio - 1.0).abs() < 0.03, "{technique:?}: {ratio}");
    }
}

/// Volumes that overlap count the sun's light once: a smaller one inside of another changes nothing but the detail.
#[test]
fn nested_volumes_count_the_sun_once() {
    for technique in TECHNIQUES {
        let (mut headless, target) = yard(technique);
        sun(&mut headless, Vec3::new(-0.5, -1.0, 0.2));
        settle(&mut headless, 32);
        let one = mean(&headless.picture(&target));
        headless.app.world_mut().spawn((
            GiVolume::new(Vec3::new(18.0, 12.0, 18.0)).with_resolution(64),
            ProbeSet::default().with_resolution(14),
            Transform::from_xyz(0.0, 1.0, 0.0),
        ));
        settle(&mut headless, 32);
        let nested = mean(&headless.picture(&target));
        let ratio = nested / one;
        println!("{technique:?}: {one} and {nested} nits, {ratio}");
        // The floor around the small volume lights the wall as well, and the volume's border no longer fades into nothing;
        // counted twice, it would be 2.
        assert!((0.95..1.35).contains(&ratio), "{technique:?}: {ratio}");
    }
}
