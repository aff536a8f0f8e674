//! Radiance hints: their modes, and the probes that they stand on.

use bevy::prelude::*;
use bevy_gi::{
    HintAlbedo, HintBounce, HintDepthTest, HintDisk, HintExchange, HintOcclusion,
    HintReconstruction, HintSampling, HintTaps, HintView, RadianceHintsDebugSettings, ShOrder,
    prelude::*, scene::probes::SceneProbes,
};

use crate::{
    common::scenes::stage::diffuse,
    shared::SharedApp,
    support::{
        HINTS, app, assert_sane, camera, choose, evaluate, in_render_world, lit_room, material,
        mean, settle, show, slab, spawn_coarse_cornell, spawn_cornell, words,
    },
};

/// An app with radiance hints under a sky of 1 nit all around: a camera looks at a black plate, too thin and small
/// to be in the way, in the middle of 16 x 16 x 16 hints of 0.4 m.
fn uniform_field() -> (SharedApp, Handle<Image>) {
    let mut headless = app();
    choose(&mut headless, HINTS);
    headless.app.world_mut().resource_mut::<GiSettings>().sky =
        GiSky::Constant(LinearRgba::rgb(1.0, 1.0, 1.0));
    let black = material(&mut headless, diffuse([0.0; 3]));
    let (min, max) = (Vec3::new(-0.3, -0.05, -0.3), Vec3::new(0.3, 0.0, 0.3));
    slab(&mut headless, min, max, &black);
    let volume = GiVolume::new(Vec3::splat(6.4)).with_resolution(64);
    let set = ProbeSet::default().with_resolution(16);
    headless.app.world_mut().spawn((volume, set));
    show(&mut headless, GiView::Irradiance);
    let eye = Vec3::new(0.0, 0.5, 0.0);
    let (_, target) = camera(&mut headless, UVec2::new(32, 32), eye, Vec3::ZERO, 30.0);
    (headless, target)
}

/// `E / pi` of the plate, nits.
fn light_plate(
    (headless, target): &mut (SharedApp, Handle<Image>),
    settings: RadianceHintsSettings,
) -> f32 {
    let world = headless.app.world_mut();
    *world.resource_mut::<RadianceHintsSettings>() = settings;
    settle(headless, 12);
    let picture = headless.picture(target);
    assert_sane(&picture, "uniform field");
    mean(&picture)
}

/// Under a sky of 1 nit all around, hints have 1 nit from everywhere. A bounce from hint to hint, normalised,
/// adds the average albedo of it, and the next one that of the bounce.
#[test]
fn a_uniform_field_bounces_with_the_average_albedo() {
    let mut scene = uniform_field();
    let nits = [1, 2, 3].map(|bounces| {
        let settings = RadianceHintsSettings {
            order: ShOrder::Two,
            bounces,
            endless: false,
            bounce: HintBounce::Hints(HintExchange {
                samples: 64,
                albedo: HintAlbedo::Average(0.5),
                ..default()
            }),
            reconstruction: HintReconstruction::Taps(HintTaps::default()),
            ..default()
        };
        light_plate(&mut scene, settings)
    });
    println!("after 0, 1 and 2 bounces: {nits:?} nits");
    // Two bands overshoot where the plate hides a part of the sky.
    assert!((nits[0] - 1.0).abs() < 0.06, "{nits:?}");
    let ratio = |i: usize| nits[i] / nits[0];
    assert!((ratio(1) - 1.5).abs() < 0.08, "{nits:?}");
    assert!((ratio(2) - 1.75).abs() < 0.12, "{nits:?}");
}

/// Equation 8 as printed divides by the number of places once too often, and lets all light so far bounce again:
/// with 16 places and an albedo of 1, a bounce adds a sixteenth of everything, as far as the confidences of all places
/// (equation 9) sum up to one.
#[test]
fn the_literal_equation_bounces_as_it_is_printed() {
    let mut scene = uniform_field();
    let nits = [1, 2, 3].map(|bounces| {
        let settings = RadianceHintsSettings {
            bounces,
            bounce: HintBounce::HintsLiteral(HintExchange {
                samples: 16,
                // All places lie in the volume.
                reach: 0.1,
                albedo: HintAlbedo::Average(1.0),
                ..default()
            }),
            ..RadianceHintsSettings::paper()
        };
        light_plate(&mut scene, settings)
    });
    println!("after 0, 1 and 2 literal bounces: {nits:?} nits");
    let factor = 1.0 + 1.0 / 16.0;
    assert!((nits[1] / nits[0] - factor).abs() < 0.015, "{nits:?}");
    assert!(
        (nits[2] / nits[0] - factor * factor).abs() < 0.03,
        "{nits:?}"
    );
}

/// The guess of visibility at its edges (equation 11), and where the taps stand (section 5).
#[test]
fn guesses_and_taps_have_the_numbers_of_the_paper() {
    let mut headless = app();
    let visibility = evaluate(
        &mut headless,
        "#import bevy_gi::technique::hints::guess::guessed_visibility
        fn value(i: u32) -> f32 {
            // Both see surfaces from 1 m to 3 m away, or from 1 m to 2 m.
            let a = vec2(1.0, 3.0);
            let b = vec2(1.0, 2.0);
            // The last two: a place that knows one distance only.
            let same = vec2(1.0, 1.0);
            switch i {
                case 0u: { return guessed_visibility(0.0, a, b); }
                case 1u: { return guessed_visibility(2.0, a, b); }
                case 2u: { return guessed_visibility(3.5, a, b); }
                case 3u: { return guessed_visibility(5.0, a, b); }
                case 4u: { return guessed_visibility(50.0, a, b); }
                case 5u: { return guessed_visibility(1.99, same, same); }
                default: { return guessed_visibility(2.01, same, same); }
            }
        }",
        7,
    );
    assert_eq!(visibility, [1.0, 1.0, 0.5, 0.0, 0.0, 1.0, 0.0]);
    let taps = evaluate(
        &mut headless,
        "#import bevy_gi::technique::hints::guess::tap_offset
        fn value(i: u32) -> f32 {
            // The paper's four, and seven on a wider ring.
            let few = i < 12u;
            let j = select(i - 12u, i, few);
            let tap = tap_offset(j / 3u, select(7u, 4u, few), select(0.5, 0.17364818, few));
            return tap[j % 3u];
        }",
        12 + 21,
    );
    let taps: Vec<_> = taps.chunks(3).map(Vec3::from_slice).collect();
    assert!((taps[0] - Vec3::new(0.0, 0.0, 1.5)).length() < 1e-5);
    for tap in &taps[1..4] {
        assert!((tap.z - 0.674).abs() < 1e-3 && (tap.truncate().length() - 0.985).abs() < 1e-3);
    }
    for tap in &taps[5..] {
        assert!((tap.z - 1.0).abs() < 1e-3 && (tap.truncate().length() - 0.866).abs() < 1e-3);
    }
    // Evenly around.
    for ring in [&taps[1..4], &taps[5..]] {
        let sum: Vec3 = ring.iter().sum();
        assert!(sum.truncate().length() < 1e-4);
        let neighbours = ring.windows(2).map(|pair| pair[0].distance(pair[1]));
        let first = ring[0].distance(ring[1]);
        assert!(neighbours.into_iter().all(|d| (d - first).abs() < 1e-4));
    }
}

/// A floor of albedo 0.8 lit by a sun at an angle `beta`, one lux across its rays, gives a plate that hangs
/// over it `E = 0.8 cos(beta)`, but for what is beyond the floor's edge. No cosine is counted twice.
#[test]
fn a_lit_plane_is_a_plane_of_light() {
    const HALF: f32 = 5.0;
    const ALBEDO: f32 = 0.8;
    let mut headless = app();
    choose(&mut headless, HINTS);
    let floor = material(&mut headless, diffuse([ALBEDO; 3]));
    let (min, max) = (Vec3::new(-HALF, -0.5, -HALF), Vec3::new(HALF, 0.0, HALF));
    slab(&mut headless, min, max, &floor);
    let (min, max) = (Vec3::new(-1.0, 1.0, -1.0), Vec3::new(1.0, 1.2, 1.0));
    let plate = slab(&mut headless, min, max, &floor);
    let world = headless.app.world_mut();
    world.entity_mut(plate).insert(NotGiCaster);
    // One for each 500 cm2: the plate is near.
    world.resource_mut::<GiCaptureSettings>().vpls = 2048;
    let volume = GiVolume::new(Vec3::new(11.0, 3.5, 11.0)).with_resolution(64);
    let set = ProbeSet::default().with_resolution(22);
    world.spawn((volume, set, Transform::from_xyz(0.0, 1.2, 0.0)));
    let sun = DirectionalLight {
        illuminance: 1.0,
        shadow_maps_enabled: true,
        ..default()
    };
    let sun = world.spawn((sun, Transform::default())).id();
    show(&mut headless, GiView::Irradiance);
    let eye = Vec3::new(0.0, 0.1, 0.0);
    let (_, target) = camera(&mut headless, UVec2::splat(32), eye, Vec3::Y, 80.0);
    // From a point 1 m over the middle of the floor: four corners of a parallel rectangle.
    let h = (1.0 + HALF * HALF).sqrt();
    let factor = 4.0 * (HALF / h * (HALF / h).atan() / std::f32::consts::PI);
    // Disks with few samples in them are noisy.
    let disk = HintDisk {
        spread: 0.3,
        ..default()
    };
    for (sampling, tolerance) in [
        (HintSampling::VirtualPointLights, 0.06),
        (HintSampling::Disk(disk), 0.15),
    ] {
        let world = headless.app.world_mut();
        *world.resource_mut::<RadianceHintsSettings>() = RadianceHintsSettings {
            bounces: 1,
            sampling,
            samples: 256,
            ..default()
        };
        for beta in [0.0f32, 60.0] {
            let world = headless.app.world_mut();
            let (sin, cos) = beta.to_radians().sin_cos();
            let aim = Transform::default().looking_to(Vec3::new(sin, -cos, 0.0), Vec3::Z);
            *world.get_mut::<Transform>(sun).expect("the sun is there") = aim;
            // All virtual point lights have had their turn.
            settle(&mut headless, 18);
            let picture = headless.picture(&target);
            assert_sane(&picture, "plate");
            let e = std::f32::consts::PI * mean(&picture);
            let expected = factor * ALBEDO * cos;
            println!("{sampling:?} at {beta} degrees: {e:.3} lux, expected {expected:.3}");
            assert!(
                (e / expected - 1.0).abs() < tolerance,
                "{e}, not {expected}"
            );
        }
    }
}

/// From hint to hint, light takes the colour of walls if it may: a green room turns greener.
#[test]
fn bounces_from_hint_to_hint_are_coloured() {
    let volume = GiVolume::new(Vec3::splat(5.0)).with_resolution(64);
    let set = ProbeSet::default().with_resolution(12);
    let (mut headless, _, target) = lit_room([0.1, 0.6, 0.1], (volume, set));
    let mut green_over_red = |albedo| {
        *headless
            .app
            .world_mut()
            .resource_mut::<RadianceHintsSettings>() = RadianceHintsSettings {
            bounces: 3,
            bounce: HintBounce::Hints(HintExchange {
                albedo,
                ..default()
            }),
            ..default()
        };
        settle(&mut headless, 12);
        let picture = headless.picture(&target);
        let sum = |c: usize| picture.pixels.iter().map(|p| p[c]).sum::<f32>();
        sum(1) / sum(0)
    };
    let (grey, coloured) = (
        green_over_red(HintAlbedo::Average(0.5)),
        green_over_red(HintAlbedo::Surfaces),
    );
    println!("green over red: {grey:.2} grey, {coloured:.2} coloured");
    // Once reflected: 6. Each further bounce multiplies by as much.
    assert!((grey - 6.0).abs() < 0.6, "{grey}");
    assert!(coloured > 1.3 * grey, "{coloured}");
}

/// Hints that take all of their samples in one frame follow a lamp as well: a quarter of the light, a quarter of what
/// it lights.
#[test]
fn hints_of_one_frame_follow_a_lamp() {
    let volume = GiVolume::new(Vec3::splat(5.0)).with_resolution(64);
    let set = ProbeSet::default().with_resolution(12);
    let (mut headless, _, target) = lit_room([0.7; 3], (volume, set));
    headless
        .app
        .world_mut()
        .insert_resource(RadianceHintsSettings::paper());
    settle(&mut headless, 6);
    let before = mean(&headless.picture(&target));
    let world = headless.app.world_mut();
    let mut lamps = world.query::<&mut PointLight>();
    for mut lamp in lamps.iter_mut(world) {
        lamp.intensity *= 0.25;
    }
    // The picture's own history fades.
    headless.steps(16);
    let after = mean(&headless.picture(&target));
    println!("{before:.2} nits, then {after:.2}");
    assert!((after / before - 0.25).abs() < 0.02, "{before}, {after}");
}

/// Every way of doing it lights the Cornell box, and none of them runs away.
#[test]
fn every_mode_lights_a_room() {
    let mut headless = app();
    // Coarse, for the sake of time.
    spawn_coarse_cornell(&mut headless, 48, 10);
    choose(&mut headless, HINTS);
    show(&mut headless, GiView::Indirect);
    let view = crate::common::scenes::cornell::view();
    let size = UVec2::new(48, 28);
    let (_, target) = camera(&mut headless, size, view.eye, view.look, view.fov);
    let mut light = |name: &str, settings: RadianceHintsSettings| {
        *headless
            .app
            .world_mut()
            .resource_mut::<RadianceHintsSettings>() = settings;
        settle(&mut headless, 12);
        let picture = headless.picture(&target);
        assert_sane(&picture, name);
        let nits = mean(&picture);
        println!("{name}: {nits:.3} nits");
        nits
    };
    let default = RadianceHintsSettings::default();
    let full = light("default", default.clone());
    let one = light(
        "one bounce",
        RadianceHintsSettings {
            bounces: 1,
            ..default.clone()
        },
    );
    let two = light(
        "two bounces",
        RadianceHintsSettings {
            endless: false,
            ..default.clone()
        },
    );
    let order_two = light(
        "order two",
        RadianceHintsSettings {
            order: ShOrder::Two,
            ..default.clone()
        },
    );
    let bare = light(
        "nothing in the way",
        RadianceHintsSettings {
            occlusion: HintOcclusion::None,
            ..default.clone()
        },
    );
    let disk = RadianceHintsSettings {
        sampling: HintSampling::Disk(HintDisk {
            spread: 1.0,
            ..Default::default()
        }),
        samples: 240,
        ..default.clone()
    };
    let disks = light("disks", disk.clone());
    let marched = light(
        "disks, depth of the light",
        RadianceHintsSettings {
            occlusion: HintOcclusion::LightDepth(HintDepthTest::default()),
            ..disk.clone()
        },
    );
    let seen = light(
        "disks, depth of the camera",
        RadianceHintsSettings {
            occlusion: HintOcclusion::CameraDepth(HintDepthTest::default()),
            ..disk.clone()
        },
    );
    let marched_vpls = light(
        "depth of the light",
        RadianceHintsSettings {
            occlusion: HintOcclusion::LightDepth(HintDepthTest::default()),
            ..default.clone()
        },
    );
    let taps = light(
        "seven taps",
        RadianceHintsSettings {
            reconstruction: HintReconstruction::Taps(HintTaps {
                count: 7,
                angle: 60.0,
                ..Default::default()
            }),
            ..default.clone()
        },
    );
    let none = light(
        "no bounce",
        RadianceHintsSettings {
            bounces: 0,
            ..default.clone()
        },
    );
    let gained = light(
        "twice the first bounce alone",
        RadianceHintsSettings {
            first_gain: 2.0,
            later_gain: 0.0,
            ..default.clone()
        },
    );
    let guessed = light(
        "from hint to hint",
        RadianceHintsSettings {
            bounce: HintBounce::Hints(HintExchange::default()),
            endless: false,
            ..default.clone()
        },
    );
    let paper = light("paper", RadianceHintsSettings::paper());
    // Views that light the picture by a part: together, they are all of it.
    let [first, second, later] = [
        HintView::FirstBounce,
        HintView::SecondBounce,
        HintView::LaterBounces,
    ]
    .map(|hint_view| {
        let world = headless.app.world_mut();
        *world.resource_mut::<RadianceHintsSettings>() = RadianceHintsSettings {
            bounces: 3,
            ..default.clone()
        };
        let mut debug = world.resource_mut::<RadianceHintsDebugSettings>();
        (debug.view, debug.only_view) = (hint_view, true);
        settle(&mut headless, 12);
        mean(&headless.picture(&target))
    });
    println!("alone: first bounce {first:.3}, second {second:.3}, later ones {later:.3} nits");
    assert!((first / one - 1.0).abs() < 0.02, "{first}");
    let sum = first + second + later;
    assert!((sum / full - 1.0).abs() < 0.05, "{sum}");

    assert!(one < two && two < full, "each bounce adds light");
    assert!(
        (order_two / full - 1.0).abs() < 0.1,
        "orders agree in the mean"
    );
    assert!(bare > full, "what stands in the way takes light");
    assert!(
        (disks / full - 1.0).abs() < 0.25,
        "two ways to the same light"
    );
    assert!(marched > 0.3 * full && marched < 2.0 * full);
    // Something stands before the camera: the two blocks.
    assert!(seen > 0.3 * full && seen < bare, "{seen}");
    assert!(guessed > one, "hints bounce light on");
    assert_eq!(none, 0.0, "nothing shines but the lamp");
    assert!((gained / (2.0 * one) - 1.0).abs() < 0.02, "{gained}");
    assert!(marched_vpls > full && marched_vpls < bare, "{marched_vpls}");
    assert!((taps / full - 1.0).abs() < 0.3, "{taps}");
    assert!(paper > 0.1 * full && paper < 20.0 * full);
}

/// Probes inside of a block that is closed all around move out or light nothing; those in the open stay.
#[test]
fn probes_stand_outside_of_things() {
    let mut headless = app();
    choose(&mut headless, HINTS);
    let white = material(&mut headless, diffuse([0.7; 3]));
    let (min, max) = (Vec3::splat(-1.0), Vec3::splat(1.0));
    slab(&mut headless, min, max, &white);
    let volume = GiVolume::new(Vec3::splat(6.4)).with_resolution(64);
    let set = ProbeSet::default().with_resolution(16);
    headless.app.world_mut().spawn((volume, set));
    let eye = Vec3::new(3.0, 2.0, 3.0);
    camera(&mut headless, UVec2::new(32, 32), eye, Vec3::ZERO, 60.0);
    settle(&mut headless, 4);
    let found = in_render_world(&mut headless, |world| {
        let (device, queue) = (world.resource(), world.resource());
        let mut volumes = world.try_query::<&SceneProbes>()?;
        let probes = volumes.iter(world).next()?;
        Some((probes.lattice, words(probes.offsets(), device, queue)))
    });
    let (lattice, words) = found.expect("the volume has probes");
    let d = lattice.dims;
    assert_eq!(d, UVec3::splat(16));
    let (mut inside, mut moved) = (0, 0);
    for (i, words) in words.chunks(4).take(lattice.count() as usize).enumerate() {
        let i = i as u32;
        let at = UVec3::new(i % d.x, (i / d.x) % d.y, i / (d.x * d.y));
        let center = lattice.origin + (at.as_vec3() + 0.5) * lattice.cell;
        let [x, y, z, clear] = [0, 1, 2, 3].map(|c| f32::from_bits(words[c]));
        let offset = Vec3::new(x, y, z);
        let p = center + offset;
        let depth = p.abs().max_element();
        if clear > 0.0 {
            // A voxel is 0.1 m.
            assert!(
                depth > 1.0 - 0.1,
                "{p} is inside and lights, {clear} m clear"
            );
        } else {
            inside += 1;
            assert!(depth < 1.1, "{p} is outside and lights nothing");
        }
        assert!(offset.abs().max_element() <= 0.46 * lattice.cell);
        moved += u32::from(offset != Vec3::ZERO);
        // A cell and a half away, nobody is in the way.
        if center.abs().max_element() > 1.7 && center.abs().max_element() < 3.0 {
            assert_eq!(offset, Vec3::ZERO, "{center}");
        }
    }
    println!("{inside} inside, {moved} moved");
    // 5^3 cells of 0.4 m fit into the block; some of the outer ones move out.
    assert!((8..=125).contains(&inside), "{inside}");
    assert!(moved > 0);
}

/// What is out of range is brought into it, in the component as well.
#[test]
fn a_bad_probe_set_is_clamped() {
    let mut headless = app();
    spawn_cornell(&mut headless);
    choose(&mut headless, HINTS);
    let world = headless.app.world_mut();
    let mut volumes = world.query_filtered::<Entity, With<GiVolume>>();
    let volume = volumes.iter(world).next().expect("the scene has a volume");
    world.entity_mut(volume).insert(ProbeSet {
        resolution: 0,
        rays: u32::MAX,
        bias: f32::NAN,
        ..default()
    });
    let view = crate::common::scenes::cornell::view();
    let (_, target) = camera(
        &mut headless,
        UVec2::new(48, 32),
        view.eye,
        view.look,
        view.fov,
    );
    settle(&mut headless, 3);
    assert_sane(&headless.picture(&target), "a bad probe set");
    let set = headless.app.world().get::<ProbeSet>(volume).copied();
    let set = set.expect("it is still there");
    assert_eq!((set.resolution, set.rays, set.bias), (4, 256, 0.0));
}
