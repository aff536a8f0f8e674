//! Lanterns on chains, hanging from the crowns of the aisle vaults.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Quat, Vec3, vec3};

use super::arcades::bay_x;
use super::dims::*;
use super::materials::Mat;
use super::mesh::Soup;
use super::scene::Scene;
use super::shapes::{lathe, torus, tube};

/// Outer length of a chain link.
const LINK: f32 = 0.15;

/// A stadium-shaped link standing in the xy plane.
fn link() -> Soup {
    let (half, r) = (0.5 * LINK - 0.030, 0.021);
    let mut path: Vec<Vec3> = Vec::new();
    for (sign, start) in [(1.0_f32, 0.0_f32), (-1.0, PI)] {
        for i in 0..=3 {
            let a = start + PI * i as f32 / 3.0;
            path.push(vec3(r * a.cos(), sign * half + r * a.sin(), 0.0));
        }
    }
    tube(&path, 0.010, 3, true)
}

/// A chain of `n` links hanging down from y = 0.
fn chain(n: usize) -> Soup {
    let mut soup = Soup::default();
    // Each link passes through the bend of the next, at right angles to it.
    let step = LINK - 0.034;
    for i in 0..n {
        let turn = Quat::from_rotation_y(if i % 2 == 0 { 0.0 } else { 0.5 * PI });
        let at = vec3(0.0, -0.04 - step * i as f32, 0.0);
        soup.add(link().transformed(Affine3A::from_rotation_translation(turn, at)));
    }
    // Ceiling rose.
    let rose = [
        (0.0, -0.045),
        (0.03, -0.04),
        (0.055, -0.02),
        (0.06, 0.03),
        (0.0, 0.03),
    ];
    soup.add(lathe(&rose, 14, 0.5));
    soup
}

/// Metal frame of a hexagonal lantern, its top ring at y = 0.
fn frame() -> Soup {
    let mut soup = Soup::default();
    let ring: Vec<Vec3> = (0..8)
        .map(|i| {
            let a = TAU * i as f32 / 8.0;
            vec3(0.028 * a.cos(), -0.03 + 0.028 * a.sin(), 0.0)
        })
        .collect();
    soup.add(tube(&ring, 0.007, 4, true));
    // Roof with a ball, then the lower tray with a pendant.
    let roof = [
        (0.0, -0.20),
        (0.165, -0.20),
        (0.175, -0.185),
        (0.10, -0.13),
        (0.055, -0.095),
        (0.03, -0.08),
        (0.036, -0.065),
        (0.02, -0.05),
        (0.0, -0.05),
    ];
    soup.add(lathe(&roof, 6, 0.5));
    let mut tray = vec![(0.0, -0.66), (0.018, -0.65), (0.022, -0.63), (0.012, -0.61)];
    tray.push((0.05, -0.585));
    tray.push((0.10, -0.555));
    torus(&mut tray, 0.105, 0.024, 3);
    tray.push((0.10, -0.525));
    tray.push((0.0, -0.525));
    soup.add(lathe(&tray, 6, 0.5));
    for k in 0..6 {
        let a = TAU * k as f32 / 6.0;
        let (c, s) = (a.cos(), a.sin());
        soup.add(tube(
            &[
                vec3(0.108 * c, -0.54, 0.108 * s),
                vec3(0.150 * c, -0.19, 0.150 * s),
            ],
            0.008,
            4,
            false,
        ));
    }
    soup
}

/// The glowing glass body inside the frame.
fn glass() -> Soup {
    lathe(
        &[(0.0, -0.53), (0.096, -0.53), (0.136, -0.195), (0.0, -0.195)],
        6,
        0.5,
    )
}

/// Hangs the lamps.
pub fn build(scene: &mut Scene) {
    let links = 10;
    let drop = 0.04 + (LINK - 0.034) * links as f32 - 0.035;
    let mut metal = chain(links);
    metal.add(frame().moved(vec3(0.0, -drop, 0.0)));
    let id = scene.mesh(
        "Lantern",
        vec![
            (metal, 50.0, Mat::Iron),
            (glass().moved(vec3(0.0, -drop, 0.0)), 30.0, Mat::LampGlass),
        ],
    );
    let z = 0.5 * (AXIS_Z + GROUND_HALF + INNER_Z);
    let y = SPRING + VAULT_RISE;
    for side in [1.0_f32, -1.0] {
        for i in (0..BAYS).step_by(2) {
            let bay = if side > 0.0 { i } else { i + 1 };
            scene.place("Lantern", id, vec3(bay_x(bay), y, side * z), 0.0);
        }
        let x = side * 0.5 * (AXIS_X + GROUND_HALF + INNER_X);
        scene.place("Lantern", id, vec3(x, y - 0.1, 0.0), 0.0);
    }
}
