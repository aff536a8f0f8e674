//! Reflective shadow maps: they hold all of the light that a light sends out, and nothing else.

use std::f32::consts::{FRAC_PI_4, PI};

use bevy::{color::palettes::css, prelude::*};
use bevy_gi::{GiStatistics, LightShare, prelude::*};

use crate::{
    common::{
        figures::luminance,
        headless::{Headless, Picture},
        scenes::stage::diffuse,
    },
    shared::SharedApp,
    support::{CONES, Vpl, app, assert_sane, camera, material, read_vpls, room, settle, slab},
};

const ALBEDO: f32 = 0.5;

/// A closed room of 4 x 3 x 4 m, white as far as it goes, in a volume; its maps are computed because they
/// are shown.
fn closed_room(colour: [f32; 3]) -> (SharedApp, Handle<Image>) {
    let mut headless = app();
    let walls = material(&mut headless, diffuse(colour));
    let (min, max) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0));
    room(&mut headless, min, max, 0.2, &walls);
    let world = headless.app.world_mut();
    world.resource_mut::<GiDebugSettings>().show_vpls = true;
    world.spawn((
        GiVolume::new(Vec3::new(4.8, 3.8, 4.8)).with_resolution(32),
        Transform::from_xyz(0.0, 1.5, 0.0),
    ));
    let (_, target) = camera(
        &mut headless,
        UVec2::new(96, 64),
        Vec3::new(0.0, 1.5, 1.9),
        Vec3::new(0.0, 1.2, 0.0),
        70.0,
    );
    (headless, target)
}

fn total(vpls: &[Vpl]) -> f32 {
    vpls.iter().map(|vpl| luminance(&vpl.flux.to_array())).sum()
}

/// Of the closed room.
fn lies_on_a_wall(vpl: &Vpl) -> bool {
    let inside = (vpl.position - Vec3::new(0.0, 1.5, 0.0)).abs();
    let to_wall = (Vec3::new(2.0, 1.5, 2.0) - inside).min_element();
    to_wall.abs() < 0.03
}

/// Light that a spot of Bevy's sends into its cone, lumens.
fn spot_lumens(light: &SpotLight) -> f32 {
    let (inner, outer) = (light.inner_angle.cos(), light.outer_angle.cos());
    let steps = 10_000;
    let sum: f32 = (0..steps)
        .map(|i| {
            let theta = light.outer_angle * (i as f32 + 0.5) / steps as f32;
            let cone = ((theta.cos() - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
            cone * cone * theta.sin() * light.outer_angle / steps as f32
        })
        .sum();
    light.intensity / (4.0 * PI) * 2.0 * PI * sum
}

/// The sum over all texels is the light's power into the frustum, times what surfaces reflect: within 1 %,
/// for every kind of light.
#[test]
fn the_flux_of_all_texels_is_that_of_the_light() {
    let far = 1e4;
    let point = PointLight {
        intensity: 1000.0,
        range: far,
        ..default()
    };
    let spot = SpotLight {
        intensity: 1000.0,
        range: far,
        inner_angle: 0.4,
        outer_angle: FRAC_PI_4,
        ..default()
    };
    let rect = RectLight {
        intensity: 1000.0,
        range: far,
        width: 0.2,
        height: 0.3,
        ..default()
    };
    let down = Transform::from_xyz(0.3, 2.2, -0.2).looking_to(Vec3::NEG_Y, Vec3::X);
    type Insert<'a> = &'a dyn Fn(&mut EntityWorldMut);
    let cases: [(&str, f32, Insert); 3] = [
        ("point", 1000.0, &|entity| _ = entity.insert(point)),
        ("spot", spot_lumens(&spot), &|entity| {
            _ = entity.insert(spot)
        }),
        ("rect", 1000.0, &|entity| _ = entity.insert(rect)),
    ];
    for (name, lumens, insert) in cases {
        let (mut headless, _) = closed_room([ALBEDO; 3]);
        let world = headless.app.world_mut();
        insert(&mut world.spawn(down));
        settle(&mut headless, 3);
        let vpls = read_vpls(&mut headless);
        let sum = total(&vpls);
        println!("{name}: {sum} of {} lm", ALBEDO * lumens);
        assert!(
            (sum / (ALBEDO * lumens) - 1.0).abs() < 0.01,
            "{name}: {sum}"
        );
        // They lie on the walls, and stand for as much surface as the light reaches.
        assert!(vpls.iter().all(lies_on_a_wall), "{name}");
        // 2 * 16 + 4 * 12 square metres; each patch is as large as if all of it were lit like its middle.
        let area: f32 = vpls.iter().map(|vpl| vpl.area).sum();
        if name == "point" {
            assert!(
                (area / 80.0 - 1.0).abs() < 0.1,
                "{name}: {area} square metres"
            );
        }
    }
}

#[test]
fn a_directional_light_lights_the_whole_volume() {
    let mut headless = app();
    let floor = material(&mut headless, diffuse([ALBEDO; 3]));
    slab(
        &mut headless,
        Vec3::new(-10.0, -0.2, -10.0),
        Vec3::new(10.0, 0.0, 10.0),
        &floor,
    );
    let world = headless.app.world_mut();
    world.resource_mut::<GiDebugSettings>().show_vpls = true;
    world.spawn(GiVolume::new(Vec3::splat(8.0)).with_resolution(32));
    for tilt in [0.0_f32, 0.6] {
        let world = headless.app.world_mut();
        let direction = Vec3::new(tilt.sin(), -tilt.cos(), 0.0);
        let sun = world
            .spawn((
                DirectionalLight {
                    illuminance: 1000.0,
                    ..default()
                },
                Transform::default().looking_to(direction, Vec3::Z),
            ))
            .id();
        if tilt == 0.0 {
            camera(
                &mut headless,
                UVec2::splat(16),
                Vec3::new(0.0, 3.0, 5.0),
                Vec3::ZERO,
                60.0,
            );
        }
        settle(&mut headless, 3);
        let sum = total(&read_vpls(&mut headless));
        // The map is as large as the volume looks from the sun; a floor lies all over it.
        let across = 8.0 * tilt.cos() + 8.0 * tilt.sin();
        let lumens = 1000.0 * 8.0 * across;
        println!("tilt {tilt}: {sum} of {} lm", ALBEDO * lumens);
        assert!(
            (sum / (ALBEDO * lumens) - 1.0).abs() < 0.01,
            "{tilt}: {sum}"
        );
        headless.app.world_mut().despawn(sun);
    }
}

/// Textures, colours of lights, and darkness: what reflects nothing gets no virtual light.
#[test]
fn virtual_lights_have_the_colours_of_what_is_lit() {
    let (mut headless, target) = closed_room([0.8, 0.4, 0.2]);
    let black = material(&mut headless, diffuse([0.0; 3]));
    slab(
        &mut headless,
        Vec3::new(-1.0, 0.0, -1.0),
        Vec3::new(1.0, 0.1, 1.0),
        &black,
    );
    headless.app.world_mut().spawn((
        PointLight {
            intensity: 1000.0,
            range: 1e4,
            color: css::WHITE.into(),
            ..default()
        },
        Transform::from_xyz(0.0, 1.5, 0.0),
    ));
    settle(&mut headless, 3);
    let vpls = read_vpls(&mut headless);
    for vpl in &vpls {
        let Vec3 { x, y, z } = vpl.flux;
        assert!(
            (x / y - 2.0).abs() < 0.05 && (y / z - 2.0).abs() < 0.05,
            "{vpl:?}"
        );
        let on_black = vpl.position.xz().abs().max_element() < 0.97 && vpl.position.y < 0.5;
        assert!(!on_black, "{vpl:?}");
    }
    assert_eq!(vpls.len(), 1024);

    // Spheres of that light are in the picture.
    let picture = headless.picture(&target);
    assert_sane(&picture, "virtual lights");
    let plain = shown(&mut headless, &target, |debug| debug.show_vpls = false);
    let differs = picture.pixels.iter().zip(&plain.pixels);
    let differs = differs.filter(|(a, b)| (a[0] - b[0]).abs() > 0.1 * b[0]);
    assert!(differs.count() > 100, "no spheres are seen");
}

/// A lamp beside one a hundred times as bright: by power it gets a hundredth of the virtual lights, evenly a half.
/// Either way they carry all of the light.
#[test]
fn virtual_lights_are_shared_as_the_settings_say() {
    let (mut headless, _) = closed_room([ALBEDO; 3]);
    for (lumens, color) in [(10_000.0, css::RED), (100.0, css::LIME)] {
        headless.app.world_mut().spawn((
            PointLight {
                intensity: lumens,
                color: color.into(),
                range: 1e4,
                shadow_maps_enabled: true,
                ..default()
            },
            Transform::from_xyz(0.3, 1.5, 0.2),
        ));
    }
    let mut share = |light_share| {
        headless
            .app
            .world_mut()
            .resource_mut::<GiCaptureSettings>()
            .light_share = light_share;
        settle(&mut headless, 8);
        let vpls = read_vpls(&mut headless);
        let dim = vpls.iter().filter(|vpl| vpl.flux.y > vpl.flux.x).count();
        (dim as f32 / vpls.len() as f32, total(&vpls))
    };
    let (by_power, all) = share(LightShare::Power);
    let (evenly, as_well) = share(LightShare::Even);
    println!(
        "of the dim lamp: {by_power:.3} by power, {evenly:.3} evenly; {all:.1} and {as_well:.1} lm"
    );
    // Green looks 3.4 times as bright as red.
    assert!((0.02..0.05).contains(&by_power), "{by_power}");
    assert!((evenly - 0.5).abs() < 0.01, "{evenly}");
    assert!((all / as_well - 1.0).abs() < 0.01, "{all} and {as_well}");
}

fn shown(
    headless: &mut Headless,
    target: &Handle<Image>,
    change: impl FnOnce(&mut GiDebugSettings),
) -> Picture {
    let mut debug = headless.app.world_mut().resource_mut::<GiDebugSettings>();
    change(&mut debug);
    headless.steps(3);
    headless.picture(target)
}

/// Maps that are drawn in each of the next `count` frames.
fn drawn(headless: &mut Headless, count: u32) -> Vec<u64> {
    let frames = 0..count;
    frames
        .map(|_| {
            headless.step();
            let statistics = headless.app.world().resource::<GiStatistics>();
            statistics.counts()["scene/light_maps_drawn"]
        })
        .collect()
}

fn all_drawn(headless: &mut Headless, count: u32) -> u64 {
    drawn(headless, count).iter().sum()
}

/// A lamp with six maps.
fn lamp(headless: &mut Headless, lumens: f32, x: f32, range: f32) -> Entity {
    let light = PointLight {
        intensity: lumens,
        range,
        ..default()
    };
    let at = Transform::from_xyz(x, 1.5, 0.0);
    headless.app.world_mut().spawn((light, at)).id()
}

fn shift(headless: &mut Headless, entity: Entity) {
    let mut entity = headless.app.world_mut().entity_mut(entity);
    entity.get_mut::<Transform>().unwrap().translation.x += 0.1;
}

/// A map is drawn when its light or what it sees has moved, and only then.
#[test]
fn maps_are_drawn_only_when_something_moved() {
    let (mut headless, _) = closed_room([ALBEDO; 3]);
    let light = lamp(&mut headless, 1000.0, 0.0, 5.0);
    let box_material = material(&mut headless, diffuse([ALBEDO; 3]));
    let near = slab(
        &mut headless,
        Vec3::new(-0.2, 0.0, -0.2),
        Vec3::new(0.2, 0.4, 0.2),
        &box_material,
    );
    let far = slab(
        &mut headless,
        Vec3::new(6.4, 0.0, -0.2),
        Vec3::new(6.8, 0.4, 0.2),
        &box_material,
    );
    settle(&mut headless, 6);
    assert_eq!(all_drawn(&mut headless, 6), 0, "nothing moves");

    let before = total(&read_vpls(&mut headless));
    let world = headless.app.world_mut();
    world.get_mut::<PointLight>(light).unwrap().intensity = 2000.0;
    assert_eq!(
        all_drawn(&mut headless, 6),
        0,
        "the light only changes its strength"
    );
    let after = total(&read_vpls(&mut headless));
    assert!((after / before - 2.0).abs() < 1e-3, "{before} to {after}");

    let moved = |headless: &mut Headless, entity| {
        shift(headless, entity);
        all_drawn(headless, 6)
    };
    assert_eq!(moved(&mut headless, light), 6, "the light moves");
    assert_eq!(
        moved(&mut headless, near),
        1,
        "what one of six faces sees moves"
    );
    assert_eq!(moved(&mut headless, far), 0, "what it does not reach moves");
}

/// Depth for shadows and surfaces for bounces come from one drawing of each map, also where depth is finer.
#[test]
fn a_light_is_drawn_once_for_shadows_and_surfaces() {
    let (mut headless, _) = closed_room([ALBEDO; 3]);
    headless
        .app
        .world_mut()
        .resource_mut::<GiSettings>()
        .technique = GiTechnique::OFF;
    let light = lamp(&mut headless, 1000.0, 0.0, 5.0);
    settle(&mut headless, 6);
    let alone = total(&read_vpls(&mut headless));

    // Cones read shadows, of twice the resolution.
    headless
        .app
        .world_mut()
        .resource_mut::<GiSettings>()
        .technique = CONES;
    settle(&mut headless, 12);
    let vpls = read_vpls(&mut headless);
    assert!(vpls.iter().all(lies_on_a_wall));
    let both = total(&vpls);
    assert!((both / alone - 1.0).abs() < 5e-3, "{alone} to {both}");
    shift(&mut headless, light);
    assert_eq!(all_drawn(&mut headless, 6), 6);

    // Nobody reads surfaces any more: their memory is given back, and shadows stay.
    let world = headless.app.world_mut();
    world.resource_mut::<GiDebugSettings>().show_vpls = false;
    assert_eq!(all_drawn(&mut headless, 6), 0);
    let statistics = headless.app.world().resource::<GiStatistics>();
    assert_eq!(statistics.counts()["scene/vpls"], 0);
    assert_eq!(statistics.counts()["scene/light_maps"], 6);
}

/// At most as many as the settings say, each in its turn, and all in the end.
#[test]
fn a_frame_draws_no_more_maps_than_it_may() {
    let (mut headless, _) = closed_room([ALBEDO; 3]);
    headless
        .app
        .world_mut()
        .resource_mut::<GiCaptureSettings>()
        .rsm_updates = 4;
    let lamps = [
        lamp(&mut headless, 1000.0, -0.5, 1e4),
        lamp(&mut headless, 500.0, 0.5, 1e4),
    ];
    settle(&mut headless, 6);
    for lamp in lamps {
        shift(&mut headless, lamp);
    }
    let counts = drawn(&mut headless, 8);
    println!("{counts:?}");
    let working: Vec<_> = counts.iter().filter(|count| **count > 0).collect();
    assert_eq!(working, [&4, &4, &4]);
    // While they go on moving, every map has its turn again after three frames.
    for frame in 0..6 {
        for lamp in lamps {
            shift(&mut headless, lamp);
        }
        assert_eq!(drawn(&mut headless, 1), [4], "frame {frame}");
    }
    // What was drawn at other places is all the light there is.
    headless.steps(4);
    let sum = total(&read_vpls(&mut headless));
    assert!((sum / (ALBEDO * 1500.0) - 1.0).abs() < 0.01, "{sum} lm");
}

/// Lamps that change places by power, come or go, leave the maps of the others as they are.
#[test]
fn maps_stay_with_their_lights() {
    let (mut headless, _) = closed_room([ALBEDO; 3]);
    let first = lamp(&mut headless, 1000.0, -0.5, 1e4);
    let second = lamp(&mut headless, 500.0, 0.5, 1e4);
    settle(&mut headless, 6);
    let lumens = |headless: &mut Headless, expected: f32, what: &str| {
        let vpls = read_vpls(headless);
        let sum = total(&vpls);
        // A map of another face or lamp would put its light off the walls.
        assert!(vpls.iter().all(lies_on_a_wall), "{what}");
        println!("{what}: {sum} lm");
        assert!(
            (sum / (ALBEDO * expected) - 1.0).abs() < 0.01,
            "{what}: {sum}"
        );
    };
    lumens(&mut headless, 1500.0, "two lamps");

    let world = headless.app.world_mut();
    world.get_mut::<PointLight>(first).unwrap().intensity = 100.0;
    assert_eq!(all_drawn(&mut headless, 4), 0, "they change places");
    lumens(&mut headless, 600.0, "the first is dimmed");

    let third = lamp(&mut headless, 3000.0, 0.0, 1e4);
    assert_eq!(all_drawn(&mut headless, 4), 6, "only the new one is drawn");
    lumens(&mut headless, 3600.0, "with a third");

    headless.app.world_mut().despawn(first);
    assert_eq!(all_drawn(&mut headless, 4), 0, "one is gone");
    lumens(&mut headless, 3500.0, "without the first");
    // Nothing is left of where it was: every virtual light belongs to one of the others.
    headless.app.world_mut().despawn(third);
    assert_eq!(all_drawn(&mut headless, 4), 0, "another one is gone");
    lumens(&mut headless, 500.0, "only the second");
    assert!(headless.app.world().get_entity(second).is_ok());
}

/// Where there is no room for all maps at full size, they are smaller, and all lights bounce; only where not even the smallest
/// fit, the least important go without, and it is said.
#[test]
fn maps_that_do_not_fit_are_smaller() {
    let (mut headless, _) = closed_room([ALBEDO; 3]);
    // Nobody reads shadows.
    headless
        .app
        .world_mut()
        .resource_mut::<GiSettings>()
        .technique = GiTechnique::OFF;
    let mut settings = headless.app.world_mut().resource_mut::<GiCaptureSettings>();
    settings.max_shadow_maps = 7;
    for (lumens, x) in [(1000.0, -0.5), (500.0, 0.5), (200.0, 0.0)] {
        lamp(&mut headless, lumens, x, 1e4);
    }
    let warnings = |headless: &Headless| {
        let statistics = headless.app.world().resource::<GiStatistics>();
        let all = statistics.warnings().into_iter();
        all.filter(|w| w.contains("do not bounce")).count()
    };
    settle(&mut headless, 6);
    let sum = total(&read_vpls(&mut headless));
    let expected = ALBEDO * 1700.0;
    assert!((sum / expected - 1.0).abs() < 0.02, "{sum} of {expected}");
    assert_eq!(warnings(&headless), 0);

    // Sixteen tiles of the smallest size: two lamps have room.
    let mut settings = headless.app.world_mut().resource_mut::<GiCaptureSettings>();
    (settings.max_shadow_maps, settings.rsm_size) = (1, 64);
    settle(&mut headless, 6);
    let sum = total(&read_vpls(&mut headless));
    let expected = ALBEDO * 1500.0;
    // A face has 16 texels along a side.
    assert!((sum / expected - 1.0).abs() < 0.05, "{sum} of {expected}");
    assert_eq!(warnings(&headless), 1);
}

/// What a map lacked while pipelines were compiled comes at once, even if it is drawn rarely or frozen from the start.
#[test]
fn maps_are_completed_whatever_the_settings() {
    for frozen in [false, true] {
        let (mut headless, _) = closed_room([ALBEDO; 3]);
        let light = lamp(&mut headless, 1000.0, 0.0, 1e4);
        let world = headless.app.world_mut();
        world.resource_mut::<GiCaptureSettings>().freeze = frozen;
        world.entity_mut(light).insert(GiLight {
            rsm_interval: 256,
            ..default()
        });
        settle(&mut headless, 3);
        let sum = total(&read_vpls(&mut headless));
        assert!((sum / (ALBEDO * 1000.0) - 1.0).abs() < 0.01, "{sum} lm");
        // After that they stay as they are.
        shift(&mut headless, light);
        assert_eq!(all_drawn(&mut headless, 6), 0, "frozen: {frozen}");
    }
}

/// A lamp that becomes another kind of lamp, and maps of another size.
#[test]
fn maps_follow_what_their_light_is() {
    let (mut headless, _) = closed_room([ALBEDO; 3]);
    let light = lamp(&mut headless, 1000.0, 0.0, 1e4);
    settle(&mut headless, 3);
    let spot = SpotLight {
        intensity: 1000.0,
        range: 1e4,
        ..default()
    };
    let mut entity = headless.app.world_mut().entity_mut(light);
    entity.remove::<PointLight>().insert(spot);
    for rsm_size in [0, 64, 512] {
        let mut entity = headless.app.world_mut().entity_mut(light);
        entity.insert(GiLight {
            rsm_size,
            ..default()
        });
        headless.steps(3);
        let sum = total(&read_vpls(&mut headless));
        let expected = ALBEDO * spot_lumens(&spot);
        assert!(
            (sum / expected - 1.0).abs() < 0.02,
            "{rsm_size}: {sum} of {expected}"
        );
    }
}
