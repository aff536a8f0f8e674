//! Curtains between the ground-floor columns and banners on the upper storey.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, vec2, vec3};

use super::arcades::bay_x;
use super::dims::*;
use super::materials::Mat;
use super::mesh::Soup;
use super::rng::unit;
use super::scene::Scene;
use super::shapes::{chamfered, grid, lathe, tube};

/// Height of the curtain rods: just under the capitals.
const ROD: f32 = 3.38;
/// Clear width between two columns.
const CLEAR: f32 = 2.56;

/// Smooth 1D noise in -1..1 for irregular folds.
fn wander(x: f32, seed: u32) -> f32 {
    let i = x.floor();
    let f = x - i;
    let e = f * f * (3.0 - 2.0 * f);
    let a = unit(i as i32, 3, seed);
    let b = unit(i as i32 + 1, 3, seed);
    (a + (b - a) * e) * 2.0 - 1.0
}

/// One sheet of cloth hanging from y = 0 down to -`drop`.
struct Sheet {
    /// Pleats across.
    folds: f32,
    /// Fall of the cloth.
    drop: f32,
    /// Depth of the pleats at the rod and at the hem.
    depth: (f32, f32),
    /// Seed of the irregularity.
    seed: u32,
}

/// Depth (z) and sideways shift (x) of the pleats at `u` across, `v` down.
fn pleat(s: &Sheet, u: f32, v: f32, pitch: f32, scale: f32) -> Vec2 {
    // Pleats are regular at the rod and wander and merge on the way down.
    let loose = v * v * (3.0 - 2.0 * v);
    let phase = TAU * s.folds * u
        + loose * 1.5 * wander(u * s.folds * 0.45 + 1.3 * v, s.seed)
        + 0.25 * wander(u * 5.0, s.seed + 1);
    let amp = (s.depth.0 + (s.depth.1 - s.depth.0) * loose)
        * scale
        * (1.0 + 0.35 * wander(u * s.folds * 0.8 + 7.0 + v, s.seed + 2));
    let wave = phase.sin() + 0.22 * (2.0 * phase + 0.8).sin() * loose;
    // Pulling the flanks under the crests gives the omega shape of heavy
    // cloth rather than a sine wave.
    let omega = 0.16 * pitch * (2.0 * phase).sin() * (0.4 + 0.6 * loose);
    // A broad sway of the whole sheet.
    let sway = 0.05 * loose * wander(u * 2.3 + 0.7 * v, s.seed + 3);
    vec2(omega, amp * wave + sway)
}

/// A curtain that closes a bay from column to column.
fn full_curtain(width: f32, s: &Sheet) -> Soup {
    let pitch = width / s.folds;
    grid(68, 13, |u, v| {
        let d = pleat(s, u, v, pitch, 1.0);
        // Between its rings the upper edge sags a little.
        let sag = 0.03 * (PI * s.folds * u * 2.0).sin().abs() * (1.0 - v).powi(6);
        let hem = 0.02 * wander(u * 9.0, s.seed + 5) * v.powi(4);
        let x = (u - 0.5) * width * (1.0 - 0.03 * v) + d.x;
        let p = vec3(x, -s.drop * v - sag + hem, d.y);
        // Two repeats of the pattern across the gathered cloth.
        (p, vec2(u * 2.0, v))
    })
    .flipped()
}

/// Half of a parted curtain, drawn back to the column at -x by a cord.
fn tied_curtain(width: f32, s: &Sheet) -> Soup {
    let tie = 0.60;
    grid(32, 16, |u, v| {
        // Width of the sheet: full at the rod, a bundle at the tie, flaring
        // again below.
        let k = if v < tie {
            let t = v / tie;
            1.0 - 0.80 * (t * PI * 0.5).sin().powf(1.6)
        } else {
            let t = (v - tie) / (1.0 - tie);
            0.20 + 0.26 * (1.0 - (1.0 - t) * (1.0 - t))
        };
        let w = width * k;
        let bundle = ((1.0 - k) / 0.8).clamp(0.0, 1.0);
        let d = pleat(s, u, v, w / s.folds, 0.8 + 0.55 * bundle);
        // The free edge droops in a swag before it meets the tie.
        let swag = if v < tie {
            0.22 * u * (PI * v / tie).sin() * (v / tie)
        } else {
            0.0
        };
        let bulge = 0.05 * bundle * (PI * u).sin();
        let x = -0.5 * CLEAR + 0.06 + w * u + d.x * k;
        let p = vec3(x, -s.drop * v - swag, d.y + bulge);
        (p, vec2(u, v))
    })
    .flipped()
}

/// The cord around the bundle of a tied curtain.
fn cord(width: f32, drop: f32) -> Soup {
    let n = 14;
    let path: Vec<Vec3> = (0..n)
        .map(|i| {
            let a = TAU * i as f32 / n as f32;
            vec3(
                -0.5 * CLEAR + 0.06 + width * 0.10 + (0.11 * width + 0.03) * a.cos(),
                -drop * 0.60 - 0.05 * a.cos(),
                0.14 * a.sin() + 0.02,
            )
        })
        .collect();
    tube(&path, 0.022, 5, true)
}

/// Rod with knobs and rings.
fn rod() -> Soup {
    let half = 0.5 * CLEAR + 0.05;
    let mut soup = tube(
        &[vec3(-half, 0.0, 0.0), vec3(half, 0.0, 0.0)],
        0.022,
        8,
        false,
    );
    let n = 10;
    for i in 0..n {
        let x = (i as f32 + 0.5 - 0.5 * n as f32) * (CLEAR - 0.1) / n as f32;
        let ring: Vec<Vec3> = (0..5)
            .map(|k| {
                let a = TAU * k as f32 / 5.0;
                vec3(x, -0.012 + 0.038 * a.sin(), 0.038 * a.cos())
            })
            .collect();
        soup.add(tube(&ring, 0.007, 3, true));
    }
    soup
}

/// A long flat banner with a dovetailed foot, 1 x `drop`, moving slightly.
fn banner(width: f32, drop: f32) -> Soup {
    grid(8, 26, |u, v| {
        let wave = 0.035 * v * (TAU * (0.9 * v + 0.35 * u)).sin()
            + 0.018 * v * (TAU * (2.1 * u + 0.6 * v)).sin()
            + 0.012 * (1.0 - v) * (TAU * 3.0 * u).cos();
        let tail = (1.0 - (2.0 * u - 1.0).abs()) * 0.24 * v.powi(12);
        let p = vec3(
            (u - 0.5) * width * (1.0 - 0.03 * (PI * v).sin()),
            -drop * v + tail,
            wave,
        );
        (p, vec2(u, v))
    })
    .flipped()
}

/// Bar and brackets a banner hangs from; it reaches back 0.5 m to the rail,
/// so that the cloth clears the string course.
fn banner_bar(width: f32) -> Soup {
    let h = 0.5 * width + 0.08;
    let mut soup = tube(&[vec3(-h, 0.0, 0.0), vec3(h, 0.0, 0.0)], 0.02, 8, false);
    for s in [-1.0, 1.0] {
        let knob = [
            (0.0, -0.05),
            (0.03, -0.045),
            (0.042, 0.0),
            (0.03, 0.045),
            (0.0, 0.05),
        ];
        soup.add(lathe(&knob, 10, 0.3).moved(vec3(s * h, 0.0, 0.0)));
        let x = s * 0.36 * width;
        soup.add(chamfered(
            vec3(x - 0.015, -0.018, -0.50),
            vec3(x + 0.015, 0.024, 0.012),
            0.004,
        ));
    }
    soup
}

/// Hangs all curtains and banners.
pub fn build(scene: &mut Scene) {
    curtains(scene);
    banners(scene);
}

fn curtains(scene: &mut Scene) {
    let full = Sheet {
        folds: 9.5,
        drop: 2.75,
        depth: (0.060, 0.115),
        seed: 11,
    };
    let tied = Sheet {
        folds: 6.0,
        drop: 3.05,
        depth: (0.05, 0.06),
        seed: 29,
    };
    let tied_width = 0.5 * CLEAR - 0.06;
    let full = scene.geometry(full_curtain(CLEAR - 0.08, &full), 80.0, Mat::CurtainRed);
    let half = tied_curtain(tied_width, &tied);
    let left = scene.geometry(half.clone(), 80.0, Mat::CurtainRed);
    let right = scene.geometry(half.mirrored_x(), 80.0, Mat::CurtainRed);
    let rope = scene.geometry(cord(tied_width, 3.05), 60.0, Mat::Bronze);
    let rope_right = scene.geometry(cord(tied_width, 3.05).mirrored_x(), 60.0, Mat::Bronze);
    let rod = scene.geometry(rod(), 50.0, Mat::Iron);

    let colours = [
        (Mat::CurtainRed, "Red"),
        (Mat::CurtainGreen, "Green"),
        (Mat::CurtainBlue, "Blue"),
    ];
    let meshes: Vec<_> = colours
        .iter()
        .map(|&(mat, name)| {
            let closed = scene.shared(&format!("Curtain{name}"), full, mat);
            scene.extend(closed, rod, Mat::Iron);
            let parted = scene.shared(&format!("CurtainTied{name}"), left, mat);
            scene.extend(parted, right, mat);
            scene.extend(parted, rope, Mat::Bronze);
            scene.extend(parted, rope_right, Mat::Bronze);
            scene.extend(parted, rod, Mat::Iron);
            (closed, parted)
        })
        .collect();
    // Per bay from west to east: colour, and whether it hangs closed.
    let north = [
        Some((0, true)),
        Some((1, false)),
        Some((2, true)),
        None,
        Some((0, false)),
        Some((1, true)),
        Some((2, false)),
        Some((0, true)),
    ];
    let south = [
        Some((1, true)),
        Some((2, false)),
        Some((0, true)),
        Some((1, false)),
        None,
        Some((2, true)),
        Some((0, false)),
        Some((1, true)),
    ];
    for (side, row) in [(1.0_f32, north), (-1.0, south)] {
        for (i, slot) in row.into_iter().enumerate() {
            let Some((colour, closed)) = slot else {
                continue;
            };
            let mesh = if closed {
                meshes[colour].0
            } else {
                meshes[colour].1
            };
            let yaw = if side > 0.0 { PI } else { 0.0 };
            let at = vec3(bay_x(i), ROD, side * (AXIS_Z - 0.02));
            scene.place("Curtain", mesh, at, yaw);
        }
    }
}

fn banners(scene: &mut Scene) {
    let (width, drop) = (0.86, 3.3);
    let cloth = scene.geometry(banner(width, drop), 80.0, Mat::BannerRed);
    let bar = scene.geometry(banner_bar(width), 40.0, Mat::Iron);
    let meshes = [
        (Mat::BannerRed, "BannerRed"),
        (Mat::BannerBlue, "BannerBlue"),
    ]
    .map(|(mat, name)| {
        let id = scene.shared(name, cloth, mat);
        scene.extend(id, bar, Mat::Iron);
        id
    });
    for (s, side) in [1.0_f32, -1.0].into_iter().enumerate() {
        for k in 0..3 {
            // In front of every second column, hung from the balustrade.
            let x = (k as f32 - 1.0) * 2.0 * BAY;
            let at = vec3(x, RAIL - 0.06, side * (AXIS_Z - 0.62));
            let yaw = if side > 0.0 { PI } else { 0.0 };
            scene.place("Banner", meshes[(k + s) % 2], at, yaw);
        }
    }
}
