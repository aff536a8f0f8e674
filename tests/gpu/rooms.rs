//! Closed rooms, whose light is known.

use bevy::prelude::*;
use bevy_gi::prelude::*;

use crate::{
    common::scenes::stage::diffuse,
    support::{CONES, HINTS, app, assert_sane, camera, choose, material, mean, room, settle, slab},
};

/// In a closed room whose walls emit 1 nit and reflect half, each bounce adds half of the last:
/// 1 + 1/2 + 1/4 + ... = 2 nits everywhere.
fn check_furnace(technique: GiTechnique, most: f32) {
    let mut headless = app();
    choose(&mut headless, technique);
    let walls = material(
        &mut headless,
        StandardMaterial {
            emissive: LinearRgba::rgb(1.0, 1.0, 1.0),
            emissive_exposure_weight: 1.0,
            ..diffuse([0.5; 3])
        },
    );
    room(
        &mut headless,
        Vec3::splat(-2.0),
        Vec3::splat(2.0),
        0.4,
        &walls,
    );
    let volume = GiVolume::new(Vec3::splat(5.2)).with_resolution(64);
    let probes = ProbeSet::default().with_resolution(16);
    headless.app.world_mut().spawn((volume, probes));
    headless
        .app
        .world_mut()
        .resource_mut::<VoxelConeTracingSettings>()
        .bounces = 12;
    let (_, target) = camera(
        &mut headless,
        UVec2::new(48, 32),
        Vec3::new(-1.2, -0.4, 1.4),
        Vec3::new(1.0, 0.3, -1.0),
        80.0,
    );
    settle(&mut headless, 48);
    let picture = headless.picture(&target);
    assert_sane(&picture, "furnace");
    let nits = mean(&picture);
    println!("white furnace, {technique:?}: {nits:.4} nits, truth 2");
    let apart = (nits - 2.0).abs();
    assert!(apart < most, "{technique:?}: {nits} nits in place of 2");
}

#[test]
fn white_furnace_has_two_nits() {
    // Nits that may be missing. Of twelve bounces in voxels, and of opacity that lets some light out: 2.5 %.
    for (technique, most) in [(CONES, 0.1), (HINTS, 0.02)] {
        check_furnace(technique, most);
    }
}

/// Light in a room does not pass a wall of some voxels into the sealed room beside it. Swept over
/// phases of the wall against the grid.
fn check_sealed(technique: GiTechnique, voxels: f32, phases: u32, most: f32) {
    let mut headless = app();
    choose(&mut headless, technique);
    let white = material(&mut headless, diffuse([0.7; 3]));
    // 64 voxels over 6.4 m: a voxel is 0.1 m.
    let half = 0.05 * voxels;
    room(
        &mut headless,
        Vec3::new(-2.6, -0.9, -0.9),
        Vec3::new(2.6, 0.9, 0.9),
        0.3,
        &white,
    );
    let (min, max) = (Vec3::new(-half, -0.9, -0.9), Vec3::new(half, 0.9, 0.9));
    let wall = slab(&mut headless, min, max, &white);
    let world = headless.app.world_mut();
    // As high and as deep as the rooms are: probes stand as close as by default, and are fewer.
    world.spawn(GiVolume::new(Vec3::new(6.4, 2.8, 2.8)).with_resolution(64));
    world.spawn((
        PointLight {
            intensity: 2000.0,
            range: 100.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(1.4, 0.6, 0.0),
    ));
    world.resource_mut::<GiDebugSettings>().view = GiView::Irradiance;
    // Further bounces add a little to both rooms.
    world.resource_mut::<VoxelConeTracingSettings>().bounces = 4;
    let [dark, lit] = [-2.4, 2.4].map(|x| {
        let (size, eye) = (UVec2::new(48, 48), Vec3::new(x, 0.0, 0.0));
        camera(&mut headless, size, eye, Vec3::new(0.0, 0.0, 0.01), 90.0).1
    });
    let mut worst = 0.0f32;
    for phase in 0..phases {
        let mut wall = headless.app.world_mut().entity_mut(wall);
        wall.get_mut::<Transform>().unwrap().translation.x = 0.1 * phase as f32 / phases as f32;
        // All virtual point lights have had their turn, and light has bounced.
        settle(&mut headless, 14);
        let (dark, lit) = (
            mean(&headless.picture(&dark)),
            mean(&headless.picture(&lit)),
        );
        println!(
            "phase {phase}: lit {lit:.3} nits, dark {dark:.5} nits, leak {:.3} %",
            100.0 * dark / lit
        );
        assert!(lit > 1.0, "the lit room is lit");
        worst = worst.max(dark / lit);
    }
    assert!(worst < most, "{technique:?}: {worst} of the light leaks");
}

#[test]
fn sealed_room_stays_dark() {
    // Thickness of the wall in voxels, phases, and the part of the light that may leak: 1.8 % and 0.02 % do. A cone's cells
    // are two voxels wide, so that those at the foot of such a wall show both its sides.
    for (technique, voxels, phases, most) in [(CONES, 2.0, 4, 0.02), (HINTS, 1.0, 8, 0.001)] {
        check_sealed(technique, voxels, phases, most);
    }
}
