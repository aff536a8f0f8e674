//! Devices that can do less: those that have what WebGPU guarantees and no more, and those that lack something.

use bevy::{
    material::OpaqueRendererMethod,
    prelude::*,
    render::settings::{WgpuLimits, WgpuSettings, WgpuSettingsPriority},
};
use bevy_gi::{GiSupport, prelude::*};

use crate::{
    common::{headless::Picture, scenes::stage::diffuse},
    shared::{Pool, SharedApp},
    support::{
        CONES, HINTS, TECHNIQUES, app, app_of, app_on, assert_sane, camera, choose, luminance,
        material, room, settle,
    },
};

/// An app on a device as with `WGPU_SETTINGS_PRIO=webgpu`.
fn webgpu() -> SharedApp {
    static APPS: Pool = Pool::new(|| {
        let device = WgpuSettings {
            priority: WgpuSettingsPriority::WebGPU,
            ..default()
        };
        app_on(device, |_| {})
    });
    app_of(&APPS)
}

/// An app on a device for which cells of the largest volume would be too large a texture.
fn small_textures() -> SharedApp {
    static APPS: Pool = Pool::new(|| {
        let device = WgpuSettings {
            constrained_limits: Some(WgpuLimits {
                max_texture_dimension_3d: 1024,
                ..WgpuLimits::defaults()
            }),
            ..default()
        };
        app_on(device, |_| {})
    });
    app_of(&APPS)
}

/// A room with a lamp, a red ball that is deferred, and a green one that is drawn forward. Also what the device says
/// about the technique.
fn render(mut headless: SharedApp, technique: GiTechnique) -> (Picture, Option<String>) {
    choose(&mut headless, technique);
    let half = Vec3::splat(1.5);
    let walls = material(&mut headless, diffuse([0.6; 3]));
    room(&mut headless, -half, half, 0.3, &walls);
    let red = material(&mut headless, diffuse([0.7, 0.1, 0.1]));
    let green = material(
        &mut headless,
        StandardMaterial {
            opaque_render_method: OpaqueRendererMethod::Forward,
            ..diffuse([0.1, 0.7, 0.1])
        },
    );
    let world = headless.app.world_mut();
    let ball = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.4));
    for (material, x) in [(red, -0.6), (green, 0.6)] {
        world.spawn((
            Mesh3d(ball.clone()),
            MeshMaterial3d(material),
            Transform::from_xyz(x, -1.0, 0.0),
        ));
    }
    world.spawn((
        PointLight {
            intensity: 3000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(0.0, 1.0, 0.0),
    ));
    world.spawn(GiVolume::new(Vec3::splat(4.0)).with_resolution(32));
    let eye = Vec3::new(0.0, 0.0, 1.4);
    let (_, target) = camera(&mut headless, UVec2::new(96, 64), eye, Vec3::ZERO, 75.0);
    settle(&mut headless, 16);
    let picture = headless.picture(&target);
    assert_sane(&picture, technique.name());
    let support = headless.app.world().resource::<GiSupport>();
    (picture, support.technique(technique).map(String::from))
}

/// Mean difference of two pictures over the mean of the second.
fn difference(a: &Picture, b: &Picture) -> f32 {
    let pairs = || a.pixels.iter().zip(&b.pixels);
    let apart: f32 = pairs()
        .map(|(a, b)| (luminance(a) - luminance(b)).abs())
        .sum();
    apart / pairs().map(|(_, b)| luminance(b)).sum::<f32>()
}

/// With what WebGPU guarantees, every technique runs and shows what it shows elsewhere.
#[test]
fn pictures_are_the_same_with_what_webgpu_guarantees() {
    let off = GiTechnique::OFF;
    let (dark, _) = render(webgpu(), off);
    for technique in [&[off], &TECHNIQUES[..]].concat() {
        let (here, why) = render(webgpu(), technique);
        assert_eq!(why, None);
        let (elsewhere, _) = render(app(), technique);
        let apart = difference(&here, &elsewhere);
        let added = difference(&here, &dark);
        println!("{technique:?}: {apart:.5} apart, {added:.3} is indirect");
        // The Cornell box, all of it deferred, is the same to the last bit. Here Bevy's own light alone is 0.0004
        // apart, and light through its irradiance volumes, which are bound one by one, adds to that.
        assert!(apart < 5e-3, "{technique:?}: {apart} apart");
        // Walls of albedo 0.6 around: much of the light is indirect.
        assert!(technique == off || added > 0.2, "{technique:?}: {added}");
    }
}

/// On a device without something that one technique needs, cameras with it render as with none, and the others do
/// what they did.
#[test]
fn a_technique_that_lacks_something_renders_as_off() {
    let (picture, why) = render(small_textures(), CONES);
    let why = why.expect("it is too small");
    assert!(why.contains("Voxel cone tracing is off"), "{why}");
    let (off, _) = render(small_textures(), GiTechnique::OFF);
    assert!(picture.pixels == off.pixels);
    let (hints, why) = render(small_textures(), HINTS);
    assert_eq!(why, None);
    let added = difference(&hints, &off);
    assert!(added > 0.2, "{added}");
}
