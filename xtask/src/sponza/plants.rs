//! Vases with leafy plants.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Quat, Vec3, vec2, vec3};

use super::dims::*;
use super::materials::Mat;
use super::mesh::Soup;
use super::rng::Rng;
use super::scene::Scene;
use super::shapes::{chamfered, grid, lathe, torus};

/// Height of the vase's rim.
const RIM: f32 = 0.78;

/// A wide-bellied urn on a square foot, hollow down to the soil.
fn vase() -> Soup {
    let mut p = vec![(0.0, 0.06), (0.20, 0.06)];
    torus(&mut p, 0.185, 0.04, 3);
    p.push((0.15, 0.115));
    p.push((0.125, 0.15));
    p.push((0.13, 0.18));
    for i in 1..=6 {
        let t = i as f32 / 6.0;
        let r = 0.14 + 0.21 * (t * PI * 0.62).sin().powf(0.9) - 0.05 * t.powi(5);
        p.push((r, 0.18 + 0.40 * t));
    }
    let r = p[p.len() - 1].0;
    p.push((r - 0.03, 0.61));
    p.push((r - 0.035, 0.66));
    p.push((r + 0.02, 0.72));
    torus(&mut p, r + 0.03, 0.06, 4);
    p.push((r - 0.02, RIM));
    p.push((r - 0.055, RIM - 0.05));
    p.push((r - 0.06, RIM - 0.16));
    p.push((0.0, RIM - 0.16));
    let mut soup = lathe(&p, 20, 2.4);
    soup.add(chamfered(
        vec3(-0.24, -0.02, -0.24),
        vec3(0.24, 0.065, 0.24),
        0.012,
    ));
    soup
}

/// A slightly domed disc of soil.
fn soil() -> Soup {
    lathe(
        &[(0.27, RIM - 0.13), (0.20, RIM - 0.085), (0.0, RIM - 0.07)],
        16,
        1.0,
    )
}

/// A bush of curved cards, each showing a leafy twig.
fn bush(seed: u32, cards: usize, reach: f32) -> Soup {
    let mut rng = Rng::new(seed);
    let mut soup = Soup::default();
    for i in 0..cards {
        let t = i as f32 / cards as f32;
        // Golden-angle spiral from upright in the middle to drooping outside.
        let yaw = i as f32 * 2.399_963 + rng.range(-0.3, 0.3);
        let lean = 0.12 + 1.15 * t.powf(0.8) + rng.range(-0.12, 0.12);
        let length = reach * (1.0 - 0.35 * t) * rng.range(0.8, 1.15);
        let width = length * rng.range(0.42, 0.55);
        let droop = rng.range(0.25, 0.75) * (0.4 + t);
        let cup = rng.range(0.1, 0.35);
        let roll = rng.range(-0.5, 0.5);
        // Four twigs share the texture side by side.
        let twig = (rng.next() * 4.0).floor().min(3.0);
        let card = grid(2, 3, |u, v| {
            let s = u - 0.5;
            let bend = droop * v * v;
            let up = length * (v - 0.25 * bend * v);
            let out = length * bend * 0.55;
            let p = vec3(s * width, up, out + cup * width * (4.0 * s * s - 0.5) * v);
            (p, vec2((twig + 0.02 + 0.96 * u) * 0.25, 1.0 - v))
        });
        let turn =
            Quat::from_rotation_y(yaw) * Quat::from_rotation_x(lean) * Quat::from_rotation_y(roll);
        let foot = vec3(yaw.sin(), 0.0, yaw.cos()) * 0.16 * t.sqrt() + Vec3::Y * (RIM - 0.10);
        soup.add(card.transformed(Affine3A::from_rotation_translation(turn, foot)));
    }
    soup
}

/// Places the planters: along the court between the columns, and at the ends.
pub fn build(scene: &mut Scene) {
    let vase = scene.geometry(vase(), 45.0, Mat::Vase);
    let soil = scene.geometry(soil(), 60.0, Mat::Soil);
    let kinds: Vec<_> = [(5_u32, 42, 0.95), (17, 36, 0.80), (31, 46, 1.1)]
        .into_iter()
        .enumerate()
        .map(|(i, (seed, cards, reach))| {
            let leaves = scene.geometry(bush(seed, cards, reach), 60.0, Mat::Leaf);
            let id = scene.shared(&format!("Planter{i}"), vase, Mat::Vase);
            scene.extend(id, soil, Mat::Soil);
            scene.extend(id, leaves, Mat::Leaf);
            id
        })
        .collect();
    let mut k = 0;
    for side in [1.0_f32, -1.0] {
        for i in [1, 3, 5, 7] {
            let x = BAY * i as f32 - AXIS_X;
            let at = vec3(x, 0.0, side * (COURT_Z - 0.58));
            let yaw = TAU * 0.11 * k as f32;
            // The foot is square: it stays parallel to the walls.
            let yaw = (yaw / (0.5 * PI)).round() * 0.5 * PI;
            scene.place_scaled(
                "Planter",
                kinds[k % 3],
                at,
                yaw,
                1.0 + 0.06 * (k % 3) as f32,
            );
            k += 1;
        }
        // In the corners of the aisles.
        for end in [1.0_f32, -1.0] {
            let at = vec3(end * (INNER_X - 0.75), 0.0, side * (INNER_Z - 0.75));
            scene.place_scaled("Planter", kinds[k % 3], at, 0.0, 1.15);
            k += 1;
        }
    }
}
