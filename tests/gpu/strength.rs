//! Light of any strength: from the night sky to a filament, whatever else shines, and whatever the exposure.

use std::f32::consts::PI;

use bevy::{camera::Exposure, light::NotShadowCaster, material::OpaqueRendererMethod, prelude::*};
use bevy_gi::prelude::*;

use crate::{
    common::{
        headless::{Headless, Picture},
        scenes::stage::{Stage, diffuse},
    },
    shared::SharedApp,
    support::{
        HINTS, TECHNIQUES, UNIT_EV100, app, assert_sane, camera, choose, evaluate, luminance,
        material, mean, read_vpls, room, settle, show, slab,
    },
};

const SIZE: UVec2 = UVec2::new(48, 32);
/// Frames until light that is compared has settled.
const FRAMES: u32 = 34;

/// Lets the camera's white be so many nits.
fn expose(headless: &mut Headless, camera: Entity, white: f32) {
    let ev100 = UNIT_EV100 + white.log2();
    let mut camera = headless.app.world_mut().entity_mut(camera);
    camera.insert(Exposure { ev100 });
}

/// Relative RMSE of a picture.
fn difference(picture: &Picture, truth: &Picture) -> f32 {
    let pairs = picture.pixels.iter().zip(&truth.pixels);
    let squares = pairs.map(|(a, b)| (luminance(a) - luminance(b)).powi(2));
    (squares.sum::<f32>() / truth.pixels.len() as f32).sqrt() / mean(truth)
}

/// Mean of the middle of a picture.
fn middle(picture: &Picture) -> f32 {
    let (size, mut sum) = (picture.size, 0.0);
    for y in size.y / 2 - 2..size.y / 2 + 2 {
        for x in size.x / 2 - 2..size.x / 2 + 2 {
            sum += luminance(&picture.pixels[(y * size.x + x) as usize]);
        }
    }
    sum / 16.0
}

/// A room with a window, and all that shines: a lamp, a sun, a sky, and a panel. In the middle of the picture is a
/// forward-rendered ball that none of them but the sky and the panel reaches: Bevy's own light is not in it.
struct Everything {
    headless: SharedApp,
    camera: Entity,
    target: Handle<Image>,
    lamp: Entity,
    sun: Entity,
    panel: Handle<StandardMaterial>,
}

impl Everything {
    fn new(technique: GiTechnique) -> Self {
        let mut headless = app();
        choose(&mut headless, technique);
        let world = headless.app.world_mut();
        world.resource_mut::<VoxelConeTracingSettings>().bounces = 4;
        let mut stage = Stage(world);
        let white = stage.paint([0.6; 3]);
        let red = stage.paint([0.6, 0.2, 0.1]);
        let mut slab = |min: [f32; 3], max: [f32; 3], material: &Handle<StandardMaterial>| {
            stage.slab(Vec3::from(min), Vec3::from(max), material)
        };
        slab([-2.3, -1.8, -2.3], [2.3, -1.5, 2.3], &white);
        slab([-2.3, 1.5, -2.3], [2.3, 1.8, 2.3], &white);
        slab([-2.3, -1.5, -2.3], [-2.0, 1.5, 2.3], &red);
        slab([-2.0, -1.5, -2.3], [2.3, 1.5, -2.0], &white);
        slab([-2.0, -1.5, 2.0], [2.3, 1.5, 2.3], &white);
        // Around the window.
        slab([2.0, -1.5, -2.0], [2.3, -0.5, 2.0], &white);
        slab([2.0, 0.9, -2.0], [2.3, 1.5, 2.0], &white);
        slab([2.0, -0.5, -2.0], [2.3, 0.9, -1.6], &white);
        slab([2.0, -0.5, -0.6], [2.3, 0.9, 2.0], &white);
        let panel = stage.material(diffuse([0.0; 3]));
        stage.slab(
            Vec3::new(-2.0, -0.6, 0.2),
            Vec3::new(-1.8, 0.6, 1.6),
            &panel,
        );
        let ball = stage.material(StandardMaterial {
            opaque_render_method: OpaqueRendererMethod::Forward,
            ..diffuse([0.8; 3])
        });
        let ball = stage.mesh(Sphere::new(0.35), &ball, Transform::default());
        world
            .entity_mut(ball)
            .insert((NotGiCaster, NotShadowCaster));
        // Up at the ceiling, behind the camera.
        let lamp = world.spawn((
            SpotLight {
                range: 100.0,
                outer_angle: 0.6,
                inner_angle: 0.4,
                shadow_maps_enabled: true,
                ..default()
            },
            Transform::from_xyz(1.2, -1.2, 1.5).looking_to(Vec3::Y, Vec3::X),
        ));
        let lamp = lamp.id();
        // Through the window, onto the floor.
        let sun = world.spawn((
            DirectionalLight {
                shadow_maps_enabled: true,
                ..default()
            },
            Transform::default().looking_to(Vec3::new(-1.0, -1.2, 0.0), Vec3::Y),
        ));
        let sun = sun.id();
        let volume = GiVolume::new(Vec3::new(5.2, 4.2, 5.2)).with_resolution(48);
        world.spawn((volume, ProbeSet::default().with_resolution(12)));
        show(&mut headless, GiView::Irradiance);
        let eye = Vec3::new(0.3, 0.2, 1.7);
        let (camera, target) = camera(&mut headless, SIZE, eye, Vec3::ZERO, 70.0);
        Self {
            headless,
            camera,
            target,
            lamp,
            sun,
            panel,
        }
    }

    /// All that shines has so many times its usual strength, which lights the room with about a nit.
    fn set(&mut self, strength: f32) {
        let world = self.headless.app.world_mut();
        let mut lamp = world.get_mut::<SpotLight>(self.lamp).unwrap();
        lamp.intensity = strength * 30.0 * 4.0 * PI;
        let mut sun = world.get_mut::<DirectionalLight>(self.sun).unwrap();
        sun.illuminance = strength * 40.0;
        let sky = LinearRgba::rgb(strength, 1.5 * strength, 2.0 * strength);
        world.resource_mut::<GiSettings>().sky = GiSky::Constant(sky);
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        let mut panel = materials.get_mut(&self.panel).unwrap();
        panel.emissive = LinearRgba::rgb(8.0 * strength, 6.0 * strength, 4.0 * strength);
    }

    /// What the camera sees with that exposure; over the strength, nits.
    fn see(&mut self, strength: f32, white: f32) -> Picture {
        self.set(strength);
        expose(&mut self.headless, self.camera, white);
        settle(&mut self.headless, FRAMES);
        let picture = self.headless.picture(&self.target);
        assert_sane(&picture, "everything");
        picture.scaled(white / strength)
    }
}

/// The same light times a factor is the same picture times the factor: with the exposure as it was, and with one that
/// follows.
#[test]
fn the_same_scene_of_another_strength_looks_the_same() {
    for technique in TECHNIQUES {
        let mut scene = Everything::new(technique);
        let usual = scene.see(1.0, 1.0);
        let (nits, ball) = (mean(&usual), middle(&usual));
        println!("{technique:?}: {nits} nits, ball {ball} nits");
        assert!(nits > 0.2 && nits < 5.0 && ball > 0.1, "{nits}, {ball}");
        for strength in [1e-4, 1e4] {
            for white in [1.0, strength] {
                let other = scene.see(strength, white);
                let ratios = [mean(&other) / nits, middle(&other) / ball];
                let off = difference(&other, &usual);
                println!("{technique:?} x {strength}, white {white}: {ratios:?}, {off}");
                // The target itself is of half floats; and light is rounded otherwise.
                assert!(
                    ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.01) && off < 0.01,
                    "{technique:?} x {strength}, white {white}: {ratios:?}, {off}"
                );
            }
        }
    }
}

/// Light and exposure change by four decades, up and down: nothing flashes, and nothing breaks.
#[test]
fn switching_strengths_does_not_flash() {
    for technique in TECHNIQUES {
        let mut scene = Everything::new(technique);
        scene.see(1.0, 1.0);
        // Until the history knows nothing of the first bounces alone.
        scene.headless.steps(70);
        let usual = mean(&scene.headless.picture(&scene.target));
        let Everything {
            mut headless,
            camera,
            target,
            lamp,
            ..
        } = scene;
        // Only the exposure first: in every frame the light is the same, whatever the units.
        let whites: [f32; 12] = [
            1.0, 1.0, 1e4, 1e4, 1e4, 1e4, 1e-2, 1e-2, 1e-2, 1.0, 1.0, 1.0,
        ];
        let mut exposed = Vec::new();
        headless.record(
            &target,
            whites.len() as u32,
            |world, frame| {
                let ev100 = UNIT_EV100 + whites[frame as usize].log2();
                world.entity_mut(camera).insert(Exposure { ev100 });
            },
            |frame, picture| {
                assert_sane(&picture, "exposed");
                exposed.push(mean(&picture) * whites[frame as usize] / usual);
            },
        );
        println!("{technique:?}: over the usual {exposed:?}");
        // Cones are turned in each frame: the mean of so few pixels moves by up to a hundredth.
        for ratio in &exposed {
            assert!((ratio - 1.0).abs() < 0.03, "{technique:?}: {exposed:?}");
        }
        // Now the lamp.
        let usual_lamp = headless
            .app
            .world()
            .get::<SpotLight>(lamp)
            .unwrap()
            .intensity;
        let mut lit = Vec::new();
        headless.record(
            &target,
            120,
            |world, frame| {
                let strength = if (10..60).contains(&frame) { 1e4 } else { 1.0 };
                let mut lamp = world.get_mut::<SpotLight>(lamp).unwrap();
                lamp.intensity = strength * usual_lamp;
            },
            |_, picture| {
                assert_sane(&picture, "switched");
                lit.push(mean(&picture) / usual);
            },
        );
        let (before, bright, after) = (lit[8], lit[58], lit[119]);
        println!("{technique:?}: {before}, {bright}, {after} of the usual");
        assert!(bright > 300.0, "{technique:?}: {bright}");
        let most = lit.iter().copied().fold(0.0, f32::max);
        assert!(most < 1.1 * bright, "{technique:?}: a flash of {most}");
        assert!((before - 1.0).abs() < 0.03, "{technique:?}: {before}");
        // What is left goes with what was there: of four more bounces, each of albedo 0.6, a thirtieth.
        assert!(after < 0.05 * bright, "{technique:?}: {after} of {bright}");
    }
}

/// A closed room with a panel; far away, a filament burns in a closed box.
#[test]
fn a_panel_lights_the_same_beside_a_filament() {
    for technique in TECHNIQUES {
        let mut headless = app();
        choose(&mut headless, technique);
        let world = headless.app.world_mut();
        world.resource_mut::<VoxelConeTracingSettings>().bounces = 4;
        let mut stage = Stage(world);
        let white = stage.paint([0.6; 3]);
        let (min, max) = (Vec3::new(-5.4, -1.2, -1.4), Vec3::new(-2.6, 1.2, 1.4));
        stage.room(min, max, 0.6, &white);
        let at = Vec3::new(4.6, 0.0, 0.0);
        stage.room(at - 0.4, at + 0.4, 0.6, &white);
        let panel = stage.material(diffuse([0.0; 3]));
        let filament = stage.material(diffuse([0.0; 3]));
        stage.slab(
            Vec3::new(-5.0, 0.8, -0.6),
            Vec3::new(-3.8, 1.2, 0.6),
            &panel,
        );
        stage.slab(at - 0.04, at + 0.04, &filament);
        // A cell of the probes is 0.8 m.
        let volume = GiVolume::new(Vec3::new(12.8, 4.0, 4.4)).with_resolution(64);
        world.spawn((volume, ProbeSet::default().with_resolution(16)));
        show(&mut headless, GiView::Irradiance);
        let eye = Vec3::new(-2.8, 0.0, 1.2);
        let (camera, target) = camera(&mut headless, SIZE, eye, min, 70.0);
        // The pool of voxels grows to what the scene needs some frames later, and light that is known then bounces on: more
        // often than the four times that are counted here.
        headless.steps(10);
        for nits in [100.0, 1e-3] {
            expose(&mut headless, camera, 0.3 * nits);
            let [alone, beside] = [0.0, 1e9].map(|burning| {
                let world = headless.app.world_mut();
                let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
                let mut shine = |material: &Handle<StandardMaterial>, nits: f32| {
                    let mut material = materials.get_mut(material).unwrap();
                    material.emissive = LinearRgba::rgb(nits, nits, nits);
                };
                shine(&panel, nits);
                shine(&filament, burning);
                settle(&mut headless, FRAMES);
                let picture = headless.picture(&target);
                assert_sane(&picture, "panel");
                picture
            });
            let (ratio, off) = (mean(&beside) / mean(&alone), difference(&beside, &alone));
            println!(
                "{technique:?}, {nits} nits: {} alone, {ratio} beside a filament, {off}",
                mean(&alone)
            );
            // Of white: the panel lights the room.
            assert!(mean(&alone) > 0.05, "{technique:?}: {}", mean(&alone));
            assert!(
                (ratio - 1.0).abs() < 0.01 && off < 0.01,
                "{technique:?}, {nits} nits: {ratio}, {off}"
            );
        }
    }
}

/// A strip of 1e9 nits lights a wall a million times as brightly as one of 1000, and about as it should.
#[test]
fn a_filament_lights_a_wall() {
    const SIDE: f32 = 0.1;
    const LENGTH: f32 = 2.0;
    const AWAY: f32 = 0.8;
    for technique in TECHNIQUES {
        let mut headless = app();
        choose(&mut headless, technique);
        let white = material(&mut headless, diffuse([0.5; 3]));
        let strip = material(&mut headless, diffuse([0.0; 3]));
        slab(
            &mut headless,
            Vec3::new(-1.5, -1.5, -0.3),
            Vec3::new(1.5, 1.5, 0.0),
            &white,
        );
        let half = 0.5 * Vec3::new(SIDE, LENGTH, SIDE);
        let at = Vec3::new(0.0, 0.0, AWAY + 0.5 * SIDE);
        slab(&mut headless, at - half, at + half, &strip);
        let volume = GiVolume::new(Vec3::new(3.2, 3.2, 2.4)).with_resolution(64);
        let world = headless.app.world_mut();
        let at = Transform::from_xyz(0.0, 0.0, 0.5);
        world.spawn((volume, at, ProbeSet::default().with_resolution(12)));
        show(&mut headless, GiView::Irradiance);
        let eye = Vec3::new(0.5, 0.0, 0.6);
        let (camera, target) = camera(&mut headless, UVec2::splat(16), eye, Vec3::ZERO, 20.0);
        let mut see = |nits: f32| {
            expose(&mut headless, camera, 0.1 * nits);
            let world = headless.app.world_mut();
            let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
            materials.get_mut(&strip).unwrap().emissive = LinearRgba::rgb(nits, nits, nits);
            settle(&mut headless, FRAMES);
            let picture = headless.picture(&target);
            assert_sane(&picture, "wall");
            mean(&picture) * 0.1
        };
        let (dim, bright) = (see(1e3), see(1e9));
        // A strip of width w at distance r, looked at squarely: `L w / (2 r)`, times the part of an infinite one,
        // `(t + sin t cos t) / (pi / 2)`, that ends at angle t.
        let t = (0.5 * LENGTH / AWAY).atan();
        let truth = SIDE / (2.0 * AWAY) * (t + t.sin() * t.cos()) / (0.5 * PI);
        println!("{technique:?}: {bright} of the strip's, dim {dim}, truth {truth}");
        assert!((bright / dim - 1.0).abs() < 0.01, "{bright}, {dim}");
        // What is thinner than a cell looks wider to cones, and rays of hints are few.
        assert!((0.5..3.0).contains(&(bright / truth)), "{bright}, {truth}");
    }
}

/// A plate under the night sky, seen with the exposure that it takes.
#[test]
fn the_night_sky_lights_what_is_below() {
    const NIGHT: f32 = 1e-5;
    for technique in TECHNIQUES {
        let mut headless = app();
        choose(&mut headless, technique);
        let white = material(&mut headless, diffuse([0.5; 3]));
        let world = headless.app.world_mut();
        let sky = LinearRgba::rgb(NIGHT, NIGHT, NIGHT);
        world.resource_mut::<GiSettings>().sky = GiSky::Constant(sky);
        let volume = GiVolume::new(Vec3::splat(2.0)).with_resolution(32);
        world.spawn((volume, ProbeSet::default().with_resolution(8)));
        let half = Vec3::new(0.5, 0.1, 0.5);
        slab(&mut headless, -half, half, &white);
        show(&mut headless, GiView::Irradiance);
        let eye = Vec3::new(0.0, 0.9, 0.0);
        let (camera, target) = camera(&mut headless, UVec2::splat(16), eye, Vec3::ZERO, 20.0);
        expose(&mut headless, camera, NIGHT);
        settle(&mut headless, FRAMES);
        let picture = headless.picture(&target);
        assert_sane(&picture, "night");
        let nits = mean(&picture) * NIGHT;
        println!("{technique:?}: {nits} nits");
        assert!((nits / NIGHT - 1.0).abs() < 0.02, "{technique:?}: {nits}");
    }
}

/// What surfaces reflect of a rect light depends on its power, not on its size: a map's texels hold no areas.
#[test]
fn rect_lights_of_any_size_and_power_bounce_alike() {
    const ALBEDO: f32 = 0.5;
    let mut headless = app();
    choose(&mut headless, HINTS);
    let walls = material(&mut headless, diffuse([ALBEDO; 3]));
    let half = Vec3::splat(2.0);
    room(&mut headless, -half, half, 0.3, &walls);
    let world = headless.app.world_mut();
    let at = Transform::from_xyz(0.3, 1.2, -0.2).looking_to(Vec3::NEG_Y, Vec3::X);
    let light = world.spawn((RectLight::default(), at)).id();
    world.spawn(GiVolume::new(Vec3::splat(4.8)).with_resolution(32));
    camera(&mut headless, UVec2::splat(16), Vec3::ZERO, Vec3::X, 60.0);
    for (side, lumens) in [(3e-4, 1e-6), (0.3, 1000.0), (300.0, 1e12)] {
        headless
            .app
            .world_mut()
            .entity_mut(light)
            .insert(RectLight {
                intensity: lumens,
                range: 1e4,
                width: side,
                height: side,
                ..default()
            });
        settle(&mut headless, 3);
        let vpls = read_vpls(&mut headless);
        let sum: f32 = vpls.iter().map(|vpl| vpl.flux.y).sum();
        println!("{side} m: {sum} of {} lm", ALBEDO * lumens);
        assert!(
            (sum / (ALBEDO * lumens) - 1.0).abs() < 0.01,
            "{side} m: {sum}"
        );
    }
}

/// Radiance from 1e-9 to 1e13 nits survives being packed, and on the mean all of it.
#[test]
fn packed_radiance_keeps_its_strength() {
    let mut headless = app();
    const DECADES: u32 = 22;
    const EACH: u32 = 512;
    let code = format!(
        "#import bevy_gi::gpu::pack::{{pack_radiance, unpack_radiance}}
        fn nits(i: u32) -> vec3<f32> {{
            let strength = pow(10.0, f32(i / {EACH}u) - 9.0 + f32(i % {EACH}u) / {EACH}.0);
            return vec3(1.0, 0.6, 0.3) * strength;
        }}
        fn value(i: u32) -> f32 {{
            let channel = i % 3u;
            let j = i / 3u;
            return unpack_radiance(pack_radiance(nits(j)))[channel] / nits(j)[channel];
        }}"
    );
    let ratios = evaluate(&mut headless, &code, 3 * DECADES * EACH);
    for (channel, most) in [
        (0, 0.5 / 128.0),
        (1, 0.5 / 256.0 / 0.6),
        (2, 0.5 / 128.0 / 0.3),
    ] {
        let own: Vec<_> = ratios.iter().skip(channel).step_by(3).copied().collect();
        let worst = own.iter().map(|r| (r - 1.0).abs()).fold(0.0, f32::max);
        let bias = own.iter().sum::<f32>() / own.len() as f32 - 1.0;
        println!("channel {channel}: worst {worst}, on the mean {bias}");
        assert!(worst <= 1.01 * most, "channel {channel}: {worst}");
        assert!(bias.abs() < 2e-4, "channel {channel}: {bias}");
    }
    let dark = "#import bevy_gi::gpu::pack::{pack_radiance, unpack_radiance}
        fn value(i: u32) -> f32 { return unpack_radiance(pack_radiance(vec3(0.0, 0.0, f32(i) * 1e30)))[2]; }";
    let values = evaluate(&mut headless, dark, 3);
    assert_eq!(values[0], 0.0);
    assert!(
        values[1..].iter().all(|v| v.is_finite() && *v > 1e18),
        "{values:?}"
    );
}
