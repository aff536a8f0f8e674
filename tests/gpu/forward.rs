//! What is drawn forward has indirect light too, from the volume's export; and nothing has it twice.

use bevy::{camera::Hdr, material::OpaqueRendererMethod, prelude::*};
use bevy_gi::prelude::*;

use crate::{
    common::{
        headless::{Headless, Picture},
        scenes::stage::diffuse,
    },
    support::{app, assert_sane, camera, luminance, material, room, settle},
};

const SIZE: UVec2 = UVec2::new(96, 64);

/// A lit room with a ball in it, and a light that the ball does not see: all its light is indirect.
fn ball(material_of_ball: StandardMaterial, change: impl FnOnce(&mut Headless, Entity)) -> Picture {
    let mut headless = app();
    let walls = material(&mut headless, diffuse([0.7; 3]));
    let ball = material(&mut headless, material_of_ball);
    room(
        &mut headless,
        Vec3::new(-2.0, -1.5, -2.0),
        Vec3::new(2.0, 1.5, 2.0),
        0.3,
        &walls,
    );
    let world = headless.app.world_mut();
    let mesh = world
        .resource_mut::<Assets<Mesh>>()
        .add(Sphere::new(0.5).mesh().ico(5).unwrap());
    world.spawn((Mesh3d(mesh), MeshMaterial3d(ball), NotGiCaster));
    world.spawn((
        SpotLight {
            intensity: 100_000.0,
            range: 100.0,
            outer_angle: 0.5,
            inner_angle: 0.3,
            shadow_maps_enabled: true,
            ..default()
        },
        // Up, at the ceiling behind the camera.
        Transform::from_xyz(0.0, -1.0, 1.7).looking_to(Vec3::Y, Vec3::X),
    ));
    world.spawn(GiVolume::new(Vec3::new(4.8, 3.8, 4.8)).with_resolution(48));
    let (camera, target) = camera(
        &mut headless,
        SIZE,
        Vec3::new(0.0, 0.0, 1.8),
        Vec3::ZERO,
        60.0,
    );
    change(&mut headless, camera);
    settle(&mut headless, 40);
    let picture = headless.picture(&target);
    assert_sane(&picture, "ball");
    picture
}

/// Mean over the middle of the picture, where the ball is.
fn middle(picture: &Picture) -> f32 {
    let (mut sum, mut n) = (0.0, 0);
    for y in SIZE.y / 2 - 8..SIZE.y / 2 + 8 {
        for x in SIZE.x / 2 - 8..SIZE.x / 2 + 8 {
            sum += luminance(&picture.pixels[(y * SIZE.x + x) as usize]);
            n += 1;
        }
    }
    sum / n as f32
}

fn white() -> StandardMaterial {
    diffuse([0.8; 3])
}

#[test]
fn what_is_drawn_forward_is_lit_alike() {
    let deferred = middle(&ball(white(), |_, _| {}));
    let forward = |method, alpha_mode| StandardMaterial {
        opaque_render_method: method,
        alpha_mode,
        ..white()
    };
    let opaque = forward(OpaqueRendererMethod::Forward, AlphaMode::Opaque);
    let blended = forward(OpaqueRendererMethod::Auto, AlphaMode::Blend);
    let off = middle(&ball(opaque.clone(), |headless, _| {
        headless
            .app
            .world_mut()
            .resource_mut::<GiSettings>()
            .forward_light = false;
    }));
    let forward = middle(&ball(opaque, |_, _| {}));
    let blended = middle(&ball(blended, |_, _| {}));
    println!(
        "deferred {deferred:.2}, forward {forward:.2}, blended {blended:.2}, off {off:.2} nits"
    );
    assert!(deferred > 1.0, "the ball is lit");
    assert!(
        off < 0.01 * deferred,
        "{off}: the spot does not see the ball"
    );
    for (what, nits) in [("forward", forward), ("blended", blended)] {
        // Probes stand 0.6 m apart, and ambient cubes know six directions.
        assert!(
            (nits / deferred - 1.0).abs() < 0.2,
            "{what}: {nits} nits, deferred {deferred}"
        );
    }
}

/// Deferred pixels have the composite's light and no more; cameras without GI have none.
#[test]
fn nothing_is_lit_twice() {
    let bits = |picture: &Picture| -> Vec<u32> {
        picture
            .pixels
            .iter()
            .flatten()
            .map(|c| c.to_bits())
            .collect()
    };
    let with = ball(white(), |_, _| {});
    let without = ball(white(), |headless, _| {
        headless
            .app
            .world_mut()
            .resource_mut::<GiSettings>()
            .forward_light = false;
    });
    assert!(bits(&with) == bits(&without), "deferred pixels differ");

    let dark = ball(white(), |headless, camera| {
        headless
            .app
            .world_mut()
            .entity_mut(camera)
            .remove::<GiCamera>();
        // Another camera shows GI, so that there is an export to be seen.
        headless.app.world_mut().entity_mut(camera).insert(Hdr);
        let target = headless.target(
            UVec2::splat(16),
            bevy::render::render_resource::TextureFormat::Rgba32Float,
        );
        headless.app.world_mut().spawn((
            Camera3d::default(),
            Camera {
                order: -1,
                ..default()
            },
            GiCamera::default(),
            crate::common::headless::image_target(&target),
        ));
    });
    assert_eq!(middle(&dark), 0.0, "a camera without GI");
}
