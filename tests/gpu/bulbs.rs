//! Things close to lamps: what bounces follows Bevy's own direct light, which begins at `shadow_map_near_z`.

use bevy::{light::NotShadowCaster, prelude::*};
use bevy_gi::prelude::*;

use crate::{
    common::{headless::Headless, scenes::stage::diffuse},
    support::{HINTS, TECHNIQUES, app, camera, choose, material, mean, room, settle, show},
};

const LAMP: Vec3 = Vec3::new(0.2, 0.4, 0.1);

/// A room with a lamp, seen by its indirect light.
fn lit_room(technique: GiTechnique, near: f32) -> (Headless, Handle<Image>) {
    let mut headless = app();
    choose(&mut headless, technique);
    show(&mut headless, GiView::Indirect);
    let white = material(&mut headless, diffuse([0.6; 3]));
    room(
        &mut headless,
        Vec3::splat(-1.0),
        Vec3::splat(1.0),
        0.1,
        &white,
    );
    let world = headless.app.world_mut();
    let lamp = PointLight {
        intensity: 1000.0,
        range: 100.0,
        shadow_maps_enabled: true,
        shadow_map_near_z: near,
        ..default()
    };
    world.spawn((lamp, Transform::from_translation(LAMP)));
    world.spawn(GiVolume::new(Vec3::splat(2.4)).with_resolution(48));
    let (eye, look) = (Vec3::new(-0.8, 0.0, 0.8), Vec3::new(0.3, -0.3, -0.3));
    let (_, target) = camera(&mut headless, UVec2::new(32, 24), eye, look, 70.0);
    (headless, target)
}

fn sphere(headless: &mut Headless, radius: f32, two_sided: bool) -> Entity {
    let bulb = StandardMaterial {
        double_sided: two_sided,
        cull_mode: None,
        ..diffuse([0.8; 3])
    };
    let bulb = material(headless, bulb);
    let world = headless.app.world_mut();
    let mesh = world
        .resource_mut::<Assets<Mesh>>()
        .add(Sphere::new(radius));
    world
        .spawn((
            Mesh3d(mesh),
            MeshMaterial3d(bulb),
            Transform::from_translation(LAMP),
        ))
        .id()
}

/// Bulbs inside of Bevy's near plane let the light through, as Bevy does.
#[test]
fn a_bulb_lets_its_light_through() {
    for technique in TECHNIQUES {
        let (mut headless, target) = lit_room(technique, 0.1);
        settle(&mut headless, 24);
        let without = mean(&headless.picture(&target));
        for (radius, two_sided) in [(0.01, true), (0.05, true)] {
            let bulb = sphere(&mut headless, radius, two_sided);
            settle(&mut headless, 24);
            let ratio = mean(&headless.picture(&target)) / without;
            println!("{technique:?}, {radius} m, two-sided {two_sided}: {ratio}");
            // The bulb itself hides a little of the room from itself.
            assert!(
                (ratio - 1.0).abs() < 0.1,
                "{technique:?}, {radius} m: {ratio}"
            );
            headless.app.world_mut().despawn(bulb);
        }
    }
}

/// What casts no shadow lets the light through, however large it is.
#[test]
fn a_shade_without_shadow_lets_its_light_through() {
    let (mut headless, target) = lit_room(HINTS, 0.1);
    settle(&mut headless, 24);
    let without = mean(&headless.picture(&target));
    let shade = sphere(&mut headless, 0.2, true);
    headless
        .app
        .world_mut()
        .entity_mut(shade)
        .insert(NotShadowCaster);
    settle(&mut headless, 24);
    let ratio = mean(&headless.picture(&target)) / without;
    println!("{ratio}");
    // It is in the way of a part of the light that bounces.
    assert!((0.75..1.1).contains(&ratio), "{ratio}");
}

/// A closed opaque lantern with walls of two voxels keeps the light in, with hints. (Cones look through it, and thinner ones leak
/// with both: `docs/known_errors.md`.)
#[test]
fn a_closed_lantern_keeps_the_light_in() {
    let (mut headless, target) = lit_room(HINTS, 0.1);
    settle(&mut headless, 24);
    let without = mean(&headless.picture(&target));
    let walls = material(&mut headless, diffuse([0.8; 3]));
    room(&mut headless, LAMP - 0.15, LAMP + 0.15, 0.1, &walls);
    settle(&mut headless, 24);
    let ratio = mean(&headless.picture(&target)) / without;
    println!("{ratio}");
    assert!(ratio < 0.05, "{ratio}");
}
