//! A technique that is not the plugin's own, from `examples/custom_technique.rs`.

use bevy::{prelude::*, render::settings::WgpuSettings};
use bevy_gi::{GiSettingsRegistry, GiStatistics, prelude::*};

use crate::{
    common::{
        headless::{Headless, Picture},
        scenes::stage::diffuse,
    },
    custom_technique::{AmbientCube, AmbientCubes, AmbientCubesSettings},
    support::{TECHNIQUES, app_on, camera, choose, luminance, material, settle, show, slab},
};

const SIZE: UVec2 = UVec2::new(64, 32);

/// Nits from above, from +x, and from everywhere else, times a factor.
fn cube(x: f32, factor: f32) -> AmbientCube {
    let [above, aside, other] = [300.0, 200.0, 10.0].map(|nits| Vec3::splat(nits * factor));
    AmbientCube {
        position: Vec3::new(x, 0.5, 0.0),
        positive: [aside, above, other],
        negative: [other; 3],
    }
}

fn set_cubes(headless: &mut Headless, cubes: impl Into<Vec<AmbientCube>>) {
    let mut settings = headless
        .app
        .world_mut()
        .resource_mut::<AmbientCubesSettings>();
    settings.cubes = cubes.into();
}

/// Luminance in the middle of the left and of the right half, nits.
fn halves(picture: &Picture) -> [f32; 2] {
    [SIZE.x / 4, 3 * SIZE.x / 4].map(|x| {
        let pixel = SIZE.y / 2 * SIZE.x + x;
        luminance(&picture.pixels[pixel as usize])
    })
}

/// It is listed, it lights surfaces by its closed form, and follows its settings at once.
#[test]
fn a_technique_of_an_app_lights_its_picture() {
    let mut headless = app_on(WgpuSettings::default(), |app| {
        app.add_plugins(TechniquePlugin::<AmbientCubes>::default());
    });
    let world = headless.app.world();
    let listed = world.resource::<GiTechniques>().on().map(|e| e.technique);
    let own = GiTechnique::of::<AmbientCubes>();
    assert_eq!(
        listed.collect::<Vec<_>>(),
        [&TECHNIQUES[..], &[own]].concat()
    );
    let settings = world.resource::<GiSettingsRegistry>();
    let settings = settings.find("AmbientCubesSettings").expect("it is listed");
    assert_eq!(settings.technique, Some(own));

    choose(&mut headless, own);
    show(&mut headless, GiView::Irradiance);
    let white = material(&mut headless, diffuse([0.5; 3]));
    slab(
        &mut headless,
        Vec3::new(-4.0, -0.5, -4.0),
        Vec3::new(4.0, 0.0, 4.0),
        &white,
    );
    let volume = GiVolume::new(Vec3::splat(9.0)).with_resolution(32);
    headless.app.world_mut().spawn(volume);
    let (eye, look) = (Vec3::new(0.0, 3.0, 2.0), Vec3::ZERO);
    let (_, target) = camera(&mut headless, SIZE, eye, look, 40.0);
    set_cubes(&mut headless, [cube(-1.0, 1.0), cube(1.0, 0.1)]);
    settle(&mut headless, 4);
    let near = |picture: &Picture, expected: [f32; 2]| {
        for (nits, expected) in halves(picture).into_iter().zip(expected) {
            let apart = (nits / expected - 1.0).abs();
            assert!(apart < 2e-3, "{nits} nits, {expected} expected");
        }
    };
    near(&headless.picture(&target), [300.0, 30.0]);

    // Nothing was captured, since it needs nothing.
    let counts = headless.app.world().resource::<GiStatistics>().counts();
    for count in ["scene/voxels_occupied", "scene/light_maps"] {
        assert_eq!(counts.get(count).copied().unwrap_or(0), 0, "{count}");
    }

    // Cubes change places: one frame later, light is what it is now.
    set_cubes(&mut headless, [cube(1.0, 1.0), cube(-1.0, 0.1)]);
    headless.steps(2);
    near(&headless.picture(&target), [30.0, 300.0]);

    // Without cubes, there is no light.
    set_cubes(&mut headless, []);
    headless.steps(2);
    assert_eq!(halves(&headless.picture(&target)), [0.0; 2]);
}
