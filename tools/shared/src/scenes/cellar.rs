//! A vaulted cellar of two bays, dark but for a torch that somebody carries.

use bevy::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "cellar",
    about: "a dark cellar, lit by the spot of a carried torch alone",
    content: Content::Built(spawn),
    view,
    motion: Some(sweep),
    ..Scene::PLAIN
};

/// The carried lamp.
#[derive(Component)]
pub struct Torch;

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(-3.6, 1.6, 1.5),
        look: Vec3::new(1.2, 1.0, -1.0),
        fov: 64.0,
        ev100: 2.3,
        speed: 1.6,
    }
}

/// The lamp in a hand beside the eye, as strong as a good torch.
pub fn torch() -> impl Bundle {
    (
        Torch,
        SpotLight {
            color: Color::linear_rgb(1.0, 0.93, 0.82),
            intensity: 1500.0 * 4.0 * std::f32::consts::PI,
            range: 40.0,
            shadow_maps_enabled: true,
            inner_angle: 0.16,
            outer_angle: 0.36,
            ..default()
        },
    )
}

/// The torch points along the wall, over the barrels and into the corner.
fn sweep(world: &mut World, time: f32) {
    let mut torches = world.query_filtered::<&mut Transform, With<Torch>>();
    let target = Vec3::new(1.4, 0.9, -1.9).lerp(Vec3::new(3.6, 0.7, 0.6), time);
    for mut torch in torches.iter_mut(world) {
        *torch = Transform::from_xyz(-2.6, 1.35, 1.0).looking_at(target, Vec3::Y);
    }
}

fn spawn(world: &mut World) {
    build(world);
    world.spawn((torch(), Transform::default()));
    sweep(world, 0.0);
}

/// Half the width of a bay, and the height at which its vault springs, metres.
const HALF: f32 = 2.2;
const SPRING: f32 = 1.5;

/// Everything but the torch.
pub fn build(world: &mut World) {
    let mut stage = Stage(world);
    let brick = stage.paint([0.42, 0.2, 0.13]);
    let lime = stage.paint([0.62, 0.57, 0.48]);
    let flags = stage.paint([0.3, 0.28, 0.26]);
    let oak = stage.paint([0.34, 0.19, 0.09]);
    let hoop = stage.paint([0.1, 0.1, 0.11]);
    let glass = stage.paint([0.05, 0.22, 0.08]);
    let cloth = stage.paint([0.55, 0.08, 0.06]);
    let (min, max) = (Vec3::new(-4.4, 0.0, -HALF), Vec3::new(4.4, 3.3, HALF));
    let wall = 0.4;

    // The shell: floor, ends, and walls up to where the vault springs.
    stage.slab(
        min - Vec3::splat(wall),
        Vec3::new(max.x, 0.0, max.z) + Vec3::new(wall, 0.0, wall),
        &flags,
    );
    for side in [-1.0, 1.0] {
        let (a, b) = (side * HALF, side * (HALF + wall));
        stage.slab(
            Vec3::new(min.x - wall, 0.0, a.min(b)),
            Vec3::new(max.x + wall, SPRING, a.max(b)),
            &lime,
        );
        let (a, b) = (side * max.x, side * (max.x + wall));
        stage.slab(
            Vec3::new(a.min(b), 0.0, -HALF - wall),
            Vec3::new(a.max(b), max.y + 0.6, HALF + wall),
            &lime,
        );
    }
    // The barrel vault, course by course.
    let courses = 18;
    let rise = 0.82;
    let at = |i: f32, out: f32| {
        let angle = std::f32::consts::PI * i / courses as f32;
        let radius = HALF + out;
        Vec2::new(-radius * angle.cos(), SPRING + rise * radius * angle.sin())
    };
    for i in 0..courses {
        let (from, to) = (at(i as f32, 0.0), at(i as f32 + 1.0, 0.0));
        let along = to - from;
        let middle = 0.5 * (from + to);
        let outward = Vec2::new(-along.y, along.x).normalize();
        let center = middle + outward * 0.5 * wall;
        let tilt = along.y.atan2(along.x);
        stage.mesh(
            Cuboid::new(max.x - min.x + 2.0 * wall, wall, along.length() + 0.12),
            &brick,
            Transform::from_xyz(0.0, center.y, center.x)
                .with_rotation(Quat::from_rotation_x(-tilt)),
        );
    }
    // Ribs, and the piers that carry them; the middle one leaves a passage between the bays.
    for x in [-4.2, 0.0, 4.2] {
        let middle = x == 0.0;
        let depth = if middle { 0.9 } else { 0.25 };
        for side in [-1.0, 1.0] {
            let (a, b) = (side * HALF, side * (HALF - depth));
            stage.slab(
                Vec3::new(x - 0.22, 0.0, a.min(b)),
                Vec3::new(
                    x + 0.22,
                    SPRING + if middle { 0.75 } else { 0.15 },
                    a.max(b),
                ),
                &lime,
            );
        }
        if middle {
            stage.slab(
                Vec3::new(x - 0.22, 2.25, -HALF),
                Vec3::new(x + 0.22, max.y + 0.3, HALF),
                &lime,
            );
        }
    }
    // Barrels on beams along the far wall, and some that stand.
    for z in [-1.75, -1.05] {
        stage.slab(
            Vec3::new(0.6, 0.0, z - 0.08),
            Vec3::new(3.4, 0.16, z + 0.08),
            &oak,
        );
    }
    for x in [1.05, 2.0, 2.95] {
        barrel(&mut stage, Vec3::new(x, 0.56, -1.4), true, &oak, &hoop);
    }
    barrel(&mut stage, Vec3::new(1.52, 1.3, -1.4), true, &oak, &hoop);
    barrel(&mut stage, Vec3::new(3.7, 0.45, 1.5), false, &oak, &hoop);
    barrel(&mut stage, Vec3::new(-3.6, 0.45, -1.5), false, &oak, &hoop);
    // A table with bottles and a cloth.
    let table = Vec3::new(2.2, 0.72, 1.4);
    stage.slab(
        table - Vec3::new(0.7, 0.03, 0.4),
        table + Vec3::new(0.7, 0.03, 0.4),
        &oak,
    );
    for (x, z) in [(-0.6, -0.3), (0.6, -0.3), (-0.6, 0.3), (0.6, 0.3)] {
        let foot = Vec3::new(table.x + x, 0.0, table.z + z);
        stage.slab(
            foot - Vec3::new(0.04, 0.0, 0.04),
            foot + Vec3::new(0.04, table.y, 0.04),
            &oak,
        );
    }
    stage.slab(
        table + Vec3::new(-0.3, 0.03, -0.43),
        table + Vec3::new(0.25, 0.045, 0.43),
        &cloth,
    );
    for (x, z) in [(-0.5, 0.1), (0.42, -0.12), (0.55, 0.15)] {
        let foot = table + Vec3::new(x, 0.03, z);
        stage.mesh(
            Cylinder::new(0.045, 0.2),
            &glass,
            Transform::from_translation(foot + Vec3::Y * 0.1),
        );
        stage.mesh(
            Cylinder::new(0.015, 0.12),
            &glass,
            Transform::from_translation(foot + Vec3::Y * 0.24),
        );
    }
    // Crates.
    stage.block(Vec2::new(-2.0, -1.65), Vec3::splat(0.8), 8.0, &oak);
    stage.block(Vec2::new(-1.2, -1.75), Vec3::splat(0.6), -14.0, &oak);
    stage.block(Vec2::new(-3.3, 1.7), Vec3::new(0.9, 0.5, 0.6), 5.0, &oak);

    stage.volume(
        Vec3::new(min.x - wall, -wall, -HALF - wall),
        Vec3::new(max.x + wall, max.y + 0.6, HALF + wall),
    );
}

/// A barrel of 0.9 m, with its hoops; lying along z, or standing.
fn barrel(
    stage: &mut Stage,
    at: Vec3,
    lying: bool,
    oak: &Handle<StandardMaterial>,
    hoop: &Handle<StandardMaterial>,
) {
    let turn = match lying {
        true => Quat::from_rotation_x(std::f32::consts::FRAC_PI_2),
        false => Quat::IDENTITY,
    };
    let mut part = |height: f32, from: f32, to: f32, offset: f32, paint| {
        let cone = ConicalFrustum {
            radius_top: to,
            radius_bottom: from,
            height,
        };
        let place = Transform::from_translation(at + turn * Vec3::Y * offset).with_rotation(turn);
        stage.mesh(cone.mesh().resolution(28), paint, place);
    };
    part(0.45, 0.33, 0.4, -0.225, oak);
    part(0.45, 0.4, 0.33, 0.225, oak);
    for (offset, radius) in [(-0.38, 0.355), (-0.15, 0.395), (0.15, 0.395), (0.38, 0.355)] {
        part(0.05, radius, radius, offset, hoop);
    }
}
