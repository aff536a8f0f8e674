//! Where probes stand: by hand, around what is there, and around a camera that travels.

use bevy::prelude::*;
use bevy_gi::{ProbePin, ProbePlacement, prelude::*, scene::probes::SceneProbes};

use crate::{
    common::{headless::Headless, scenes::stage::diffuse},
    support::{
        HINTS, app, assert_sane, camera, choose, in_render_world, lit_room, material, mean, settle,
        show, slab, words,
    },
};

/// Lattice, and per probe the metres from the middle of its cell and the distance to the nearest surface.
fn probes(headless: &mut Headless) -> (bevy_gi::scene::probes::Lattice, Vec<Vec4>) {
    let found = in_render_world(headless, |world| {
        let (device, queue) = (world.resource(), world.resource());
        let mut volumes = world.try_query::<&SceneProbes>()?;
        let probes = volumes.iter(world).next()?;
        Some((probes.lattice, words(probes.offsets(), device, queue)))
    });
    let (lattice, words) = found.expect("the volume has probes");
    let offsets = words
        .chunks(4)
        .map(|w| Vec4::from_array([0, 1, 2, 3].map(|c| f32::from_bits(w[c]))));
    (lattice, offsets.take(lattice.count() as usize).collect())
}

/// A pin moves the probe in whose cell it lies, and no other; without it, the probe goes back.
#[test]
fn a_pin_places_one_probe() {
    let set = ProbeSet::default().with_resolution(12);
    let volume = GiVolume::new(Vec3::splat(6.0)).with_resolution(64);
    let (mut headless, _, _) = lit_room([0.7; 3], (volume, set));
    settle(&mut headless, 4);
    let (lattice, before) = probes(&mut headless);
    let place = Vec3::new(0.33, -0.21, 0.4);
    let pin = (ProbePin, Transform::from_translation(place));
    let pin = headless.app.world_mut().spawn(pin).id();
    headless.steps(4);
    let (_, pinned) = probes(&mut headless);
    let cell = ((place - lattice.origin) / lattice.cell).floor();
    let d = lattice.dims.as_vec3();
    let index = ((cell.z * d.y + cell.y) * d.x + cell.x) as usize;
    for (i, (a, b)) in before.iter().zip(&pinned).enumerate() {
        if i == index {
            let center = lattice.origin + (cell + 0.5) * lattice.cell;
            assert!((center + b.truncate() - place).length() < 1e-4, "{b}");
            assert!(b.w > 0.0);
        } else {
            assert_eq!(a, b, "probe {i}");
        }
    }
    headless.app.world_mut().despawn(pin);
    headless.steps(4);
    assert_eq!(probes(&mut headless).1, before);
}

/// In a volume that is much larger than what is in it, probes stand where that is, and light it as before.
#[test]
fn automatic_placement_follows_what_is_there() {
    let volume = GiVolume::new(Vec3::splat(16.0)).with_resolution(80);
    let set = ProbeSet::default().with_resolution(24);
    let (mut headless, entity, target) = lit_room([0.7; 3], (volume, set));
    settle(&mut headless, 12);
    let (everywhere, _) = probes(&mut headless);
    let before = mean(&headless.picture(&target));
    headless
        .app
        .world_mut()
        .entity_mut(entity)
        .insert(ProbeSet {
            placement: ProbePlacement::Automatic,
            ..set
        });
    headless.steps(2);
    settle(&mut headless, 12);
    let (around, _) = probes(&mut headless);
    let picture = headless.picture(&target);
    assert_sane(&picture, "automatic placement");
    let after = mean(&picture);
    println!(
        "{} probes, then {}; {before:.3} nits, then {after:.3}",
        everywhere.count(),
        around.count()
    );
    // The room is 4.6 m of 16 m.
    assert!(around.count() < everywhere.count() / 16);
    assert!((after / before - 1.0).abs() < 0.03);
    // Something farther away.
    let white = material(&mut headless, diffuse([0.7; 3]));
    slab(&mut headless, Vec3::splat(5.0), Vec3::splat(6.0), &white);
    headless.steps(4);
    assert!(probes(&mut headless).0.count() > 2 * around.count());
}

/// A volume that moves takes the light of its hints along: nothing flickers on what stays inside.
#[test]
fn a_moving_volume_keeps_its_light() {
    let volume = GiVolume::new(Vec3::splat(9.6))
        .with_resolution(80)
        .following_camera();
    let set = ProbeSet::default().with_resolution(20);
    let (mut headless, entity, target) = lit_room([0.7; 3], (volume, set));
    settle(&mut headless, 40);
    let still = mean(&headless.picture(&target));
    let (before, _) = probes(&mut headless);
    let mut worst = 0.0f32;
    let mut steps = 0;
    for i in 1..=3 {
        // The transform is an offset from the camera; the grid moves in steps of whole cells of the lattice, half a metre.
        let mut place = headless
            .app
            .world_mut()
            .get_mut::<Transform>(entity)
            .expect("the volume has a place");
        place.translation = Vec3::new(0.55 * i as f32, 0.0, 0.3 * i as f32);
        for frame in 0..8 {
            headless.steps(1);
            let off = mean(&headless.picture(&target)) / still - 1.0;
            println!("step {i}, frame {frame}: {:+.1} % nits", 100.0 * off);
            worst = worst.max(off.abs());
        }
        let (now, _) = probes(&mut headless);
        steps += u32::from(now.origin != before.origin);
        let cells = (now.origin - before.origin) / before.cell;
        assert!((cells - cells.round()).abs().max_element() < 1e-3);
    }
    println!(
        "{still:.3} nits, at most {:.1} % off while it moves",
        100.0 * worst
    );
    assert!(steps >= 2, "it moves");
    assert!(worst < 0.05, "{worst}");
}

/// Nested volumes around the camera light what is near and what is far, without a seam between them.
#[test]
fn cascades_blend_into_each_other() {
    let mut headless = app();
    choose(&mut headless, HINTS);
    headless.app.world_mut().resource_mut::<GiSettings>().sky =
        GiSky::Constant(LinearRgba::rgb(1.0, 1.0, 1.0));
    let white = material(&mut headless, diffuse([0.5; 3]));
    // Land under an even sky: E / pi is 1 everywhere.
    let (min, max) = (Vec3::new(-40.0, -1.0, -40.0), Vec3::new(40.0, 0.0, 40.0));
    slab(&mut headless, min, max, &white);
    let cascades = GiCascades {
        levels: 3,
        extent: Vec3::new(8.0, 4.0, 8.0),
        resolution: 32,
        ..default()
    };
    let set = ProbeSet::default().with_resolution(12);
    headless.app.world_mut().spawn((cascades, set));
    show(&mut headless, GiView::Irradiance);
    let eye = Vec3::new(0.0, 1.0, 0.0);
    let look = Vec3::new(0.0, 0.4, -4.0);
    let (_, target) = camera(&mut headless, UVec2::new(48, 64), eye, look, 60.0);
    settle(&mut headless, 24);
    let picture = headless.picture(&target);
    assert_sane(&picture, "cascades");
    // From the feet of the viewer to 20 m away, and the border of the last volume beyond.
    let row = |y: u32| {
        let row = &picture.pixels[(y * 48) as usize..((y + 1) * 48) as usize];
        row.iter().map(|p| p[1]).sum::<f32>() / 48.0
    };
    let rows: Vec<f32> = (0..64).map(row).collect();
    println!("{rows:.2?}");
    let lit: Vec<f32> = rows.iter().copied().skip(32).collect();
    for pair in lit.windows(2) {
        assert!((pair[0] - pair[1]).abs() < 0.05, "a seam: {pair:?}");
    }
    for nits in &lit {
        assert!((nits - 1.0).abs() < 0.1, "{nits}");
    }
}
