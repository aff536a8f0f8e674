//! Sculpted reliefs on the end walls: lion medallions and shields.
//!
//! Both are height fields evaluated on a disc or a shield outline, then closed
//! with a skirt and a back that is let into the wall.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Vec2, Vec3, vec2, vec3};

use super::dims::*;
use super::materials::Mat;
use super::mesh::{Corner, Soup, corner};
use super::scene::Scene;
use super::shapes::lathe;

/// Polynomial smooth maximum: `k` is the width of the blend.
fn smax(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.max(b) + h * h * k * 0.25
}

/// Height over the plane of an ellipsoid with centre `c`, half axes `r`,
/// turned by `turn`, peaking at `top`; far below outside of it.
fn lump(p: Vec2, c: Vec2, r: Vec2, turn: f32, base: f32, top: f32) -> f32 {
    let q = Vec2::from_angle(-turn).rotate(p - c) / r;
    let d = q.length_squared();
    if d < 1.0 {
        base + (top - base) * (1.0 - d).sqrt()
    } else {
        base - (d - 1.0) * 0.5
    }
}

/// A soft dent of unit depth.
fn dent(p: Vec2, c: Vec2, r: Vec2, turn: f32) -> f32 {
    let q = Vec2::from_angle(-turn).rotate(p - c) / r;
    (-q.length_squared() * 1.8).exp()
}

/// Height of a lion mask at `p` in the unit disc, in units of its radius.
pub fn lion_height(p: Vec2) -> f32 {
    let m = vec2(p.x.abs(), p.y);
    let r = p.length();
    let ang = p.x.atan2(p.y);

    // The mane: three rings of pointed locks, combed outward with a twist.
    let mut h = 0.03 * (1.0 - r * r).max(0.0);
    for (k, (r0, r1, n, lift)) in [
        (0.56_f32, 0.95_f32, 20.0_f32, 0.16_f32),
        (0.46, 0.82, 17.0, 0.25),
        (0.38, 0.68, 14.0, 0.33),
    ]
    .into_iter()
    .enumerate()
    {
        let t = ((r - r0) / (r1 - r0)).clamp(-0.4, 1.2);
        let twist = 0.20 * (t * 3.2 + k as f32).sin() * p.x.signum();
        let phase = (ang + twist) * n / TAU + 0.5 * k as f32;
        let cell = phase - phase.floor() - 0.5;
        // Locks narrow to a point at the tip.
        let half = 0.5 * (1.0 - t.max(0.0).powi(2) * 0.95).max(0.02);
        let across = 1.0 - (cell / half).abs();
        let round = if across > 0.0 {
            across.sqrt()
        } else {
            across * 2.0
        };
        let strands = 0.018 * (cell * TAU * 3.0 + t * 4.0).cos();
        let lock = lift * (0.45 + 0.55 * round) * (1.0 - 0.45 * t.max(0.0)) + strands;
        if t < 1.05 && across > -0.25 {
            h = smax(h, lock, 0.03);
        }
    }

    // Skull, ears and cheeks.
    let mut f = lump(p, vec2(0.0, 0.05), vec2(0.47, 0.52), 0.0, 0.16, 0.46);
    let ear = lump(m, vec2(0.40, 0.47), vec2(0.15, 0.17), -0.6, 0.22, 0.47)
        - 0.16 * dent(m, vec2(0.405, 0.455), vec2(0.075, 0.10), -0.6);
    f = smax(f, ear, 0.05);
    f = smax(
        f,
        lump(m, vec2(0.27, -0.10), vec2(0.20, 0.24), 0.25, 0.2, 0.47),
        0.10,
    );
    // Forehead with a furrow, and heavy brows slanting to the nose.
    f = smax(
        f,
        lump(m, vec2(0.10, 0.33), vec2(0.15, 0.19), 0.1, 0.3, 0.53),
        0.08,
    );
    f -= 0.06 * dent(p, vec2(0.0, 0.34), vec2(0.035, 0.20), 0.0);
    f = smax(
        f,
        lump(m, vec2(0.185, 0.215), vec2(0.17, 0.065), 0.38, 0.3, 0.585),
        0.05,
    );
    // Deep eye sockets, eyeballs and lids.
    f -= 0.20 * dent(m, vec2(0.200, 0.105), vec2(0.135, 0.080), 0.18);
    let eye = lump(m, vec2(0.195, 0.10), vec2(0.085, 0.062), 0.18, 0.28, 0.440)
        - 0.05 * dent(m, vec2(0.19, 0.10), vec2(0.026, 0.026), 0.0);
    f = smax(f, eye, 0.012);
    f = smax(
        f,
        lump(m, vec2(0.20, 0.035), vec2(0.105, 0.024), 0.26, 0.3, 0.43),
        0.03,
    );
    // Nose: a broad, flat ridge that widens to the muzzle.
    let t = ((0.30 - p.y) / 0.42).clamp(0.0, 1.0);
    let ridge_half = 0.090 + 0.060 * t;
    let ridge = 0.50 + 0.15 * t - 0.16 * (m.x / ridge_half).powi(4);
    if p.y < 0.34 && p.y > -0.17 && m.x < ridge_half * 1.5 {
        f = smax(f, ridge, 0.08);
    }
    // Muzzle pads, nose leather and nostrils.
    let pad = vec2(0.135, -0.245);
    f = smax(
        f,
        lump(m, pad, vec2(0.185, 0.140), -0.20, 0.38, 0.675),
        0.04,
    );
    f = smax(
        f,
        lump(p, vec2(0.0, -0.125), vec2(0.150, 0.065), 0.0, 0.5, 0.725),
        0.02,
    );
    f -= 0.12 * dent(m, vec2(0.078, -0.160), vec2(0.034, 0.024), 0.5);
    f -= 0.10 * dent(p, vec2(0.0, -0.27), vec2(0.020, 0.085), 0.0);
    // The closed mouth: a line that sags around the pads, and the chin.
    f = smax(
        f,
        lump(p, vec2(0.0, -0.445), vec2(0.150, 0.105), 0.0, 0.3, 0.56),
        0.03,
    );
    let lip = -0.345 - 0.10 * (m.x * 9.0).sin().max(0.0) + 0.35 * (m.x - 0.2).max(0.0);
    f -= 0.13 * (-((p.y - lip) / 0.030).powi(2)).exp() * (1.0 - (m.x / 0.30).powi(4)).max(0.0);
    // Beard: soft locks that fan out under the chin, over the mane.
    for (x, y, a) in [(0.0, -0.62, 0.0), (0.11, -0.60, 0.30), (0.21, -0.54, 0.60)] {
        let lock = lump(m, vec2(x, y), vec2(0.075, 0.16), a, 0.16, 0.37);
        f = smax(f, lock, 0.06);
    }
    smax(h, f, 0.04).max(0.0)
}

/// Closed relief over a star-shaped outline, with rings of vertices at the
/// given fractions of the way out.
fn relief(
    sectors: usize,
    stations: &[f32],
    outline: impl Fn(f32) -> Vec2,
    height: impl Fn(Vec2, f32) -> f32,
    back: f32,
) -> Soup {
    let rings = stations.len() - 1;
    let mut soup = Soup::default();
    let at = |i: usize, s: usize, z: Option<f32>| -> Corner {
        let t = stations[i];
        let e = outline(TAU * (s % sectors) as f32 / sectors as f32);
        let p = e * t;
        let z = z.unwrap_or_else(|| height(p, t));
        corner(vec3(p.x, p.y, z), vec2(p.x, -p.y))
    };
    for s in 0..sectors {
        soup.tri(at(0, 0, None), at(1, s, None), at(1, s + 1, None));
        for i in 1..rings {
            soup.quad(
                at(i, s, None),
                at(i + 1, s, None),
                at(i + 1, s + 1, None),
                at(i, s + 1, None),
            );
        }
        let (a, b) = (at(rings, s, None), at(rings, s + 1, None));
        let (c, d) = (at(rings, s, Some(-back)), at(rings, s + 1, Some(-back)));
        let side = |c: Corner, v: f32| corner(c.p, vec2(c.uv.length() * TAU * v, c.p.z));
        let (v0, v1) = (s as f32 / sectors as f32, (s + 1) as f32 / sectors as f32);
        soup.quad(side(a, v0), side(c, v0), side(d, v1), side(b, v1));
        soup.tri(corner(vec3(0.0, 0.0, -back), Vec2::ZERO), d, c);
    }
    soup
}

/// Outline of a heater shield, 1 wide and about 1.25 high, from the angle.
fn shield_outline(a: f32) -> Vec2 {
    let dir = vec2(a.cos(), a.sin());
    // March out to the boundary of the inside function.
    let inside = |p: Vec2| -> bool {
        let x = p.x.abs();
        if p.y > 0.0 {
            x < 0.5 && p.y < 0.52 + 0.05 * (x * TAU).cos() * 0.5
        } else {
            // Two arcs meeting in the point.
            let t = -p.y / 0.72;
            t < 1.0 && x < 0.5 * (1.0 - t * t).max(0.0).powf(0.72)
        }
    };
    let (mut lo, mut hi) = (0.0_f32, 1.2_f32);
    for _ in 0..24 {
        let mid = 0.5 * (lo + hi);
        if inside(dir * mid) {
            lo = mid;
        } else {
            hi = mid;
        }
    }
    dir * lo
}

/// Height of the shield's face at `t` of the way to its edge: a convex field
/// inside a raised rim.
fn shield_height(p: Vec2, t: f32) -> f32 {
    let bulge = 0.10 * (1.0 - p.x * p.x * 2.2 - p.y * p.y * 0.5);
    let rim = if t > 0.86 && t < 0.99 { 0.05 } else { 0.0 };
    0.04 + bulge * (1.0 - t.powi(6)) + rim
}

/// The charges of the shield, carved as pieces of their own so that their
/// edges are crisp: a chevron between three roundels.
fn charges() -> Soup {
    let mut soup = Soup::default();
    // Chevron: outline of the bent bar at the back and, inset, at the front.
    let ring = |inset: f32, z: f32| -> [Vec3; 6] {
        let (lo, hi) = (-0.10 + inset * 1.35, 0.10 - inset * 1.35);
        let end = 0.37 - inset;
        let lift = |x: f32, off: f32| 0.13 - 0.95 * x.abs() + off * 0.85;
        [
            vec3(-end, lift(end, lo), z),
            vec3(0.0, lift(0.0, lo), z),
            vec3(end, lift(end, lo), z),
            vec3(end, lift(end, hi), z),
            vec3(0.0, lift(0.0, hi), z),
            vec3(-end, lift(end, hi), z),
        ]
    };
    let c = |p: Vec3| corner(p, vec2(p.x + p.z, -p.y));
    let rings = [ring(0.0, 0.02), ring(0.0, 0.155), ring(0.018, 0.172)];
    for w in rings.windows(2) {
        for i in 0..6 {
            let j = (i + 1) % 6;
            soup.quad(c(w[0][i]), c(w[0][j]), c(w[1][j]), c(w[1][i]));
        }
    }
    let (back, front) = (rings[0], rings[2]);
    for (a, b) in [
        ([0, 1, 4, 5], false),
        ([1, 2, 3, 4], false),
        ([5, 4, 1, 0], true),
        ([4, 3, 2, 1], true),
    ] {
        let r = if b { &back } else { &front };
        soup.quad(c(r[a[0]]), c(r[a[1]]), c(r[a[2]]), c(r[a[3]]));
    }
    let mut soup = soup.box_uv();
    // Roundels: bosses with a sunk ring.
    let boss = [
        (0.0, 0.02),
        (0.085, 0.02),
        (0.085, 0.125),
        (0.070, 0.145),
        (0.052, 0.140),
        (0.045, 0.150),
        (0.025, 0.170),
        (0.0, 0.175),
    ];
    for (x, y) in [(-0.25, 0.33), (0.25, 0.33), (0.0, -0.28)] {
        soup.add(turn_to_front(lathe(&boss, 16, 0.4)).moved(vec3(x, y, 0.0)));
    }
    soup
}

/// Places the reliefs on the court side of both end walls.
pub fn build(scene: &mut Scene) {
    let radius = 0.60;
    let lion = relief(
        88,
        &(0..=26)
            .map(|i| (i as f32 / 26.0).powf(0.85))
            .collect::<Vec<_>>(),
        |a| vec2(a.cos(), a.sin()) * radius,
        |p, _| 0.74 * radius * lion_height(p / radius) + 0.01,
        0.06,
    );
    let lion = scene.solid("LionRelief", lion, 85.0, Mat::Carved);
    // A moulded ring around it: fillet inside, roll outside.
    let mut p = vec![(radius + 0.13, -0.06), (radius + 0.13, 0.02)];
    for i in 0..=5 {
        let t = PI * (-0.15 + i as f32 / 5.0 * 0.95);
        p.push((radius + 0.075 + 0.05 * t.cos(), 0.065 + 0.05 * t.sin()));
    }
    p.push((radius + 0.02, 0.055));
    p.push((radius, 0.075));
    p.push((radius - 0.03, 0.05));
    p.push((radius - 0.03, -0.06));
    p.push(p[0]);
    let ring = lathe(&p, 36, 3.2);
    let ring = turn_to_front(ring);
    let frame = scene.solid("LionFrame", ring, 40.0, Mat::Carved);

    let size = 0.95;
    let mut shield = relief(
        56,
        &[0.0, 0.3, 0.6, 0.8, 0.859, 0.875, 0.925, 0.975, 1.0],
        |a| shield_outline(a) * size,
        |p, t| size * shield_height(p / size, t),
        0.06,
    );
    shield.add(charges().transformed(Affine3A::from_scale(Vec3::splat(size))));
    let shield = scene.solid("Shield", shield, 50.0, Mat::Carved);

    for side in [1.0_f32, -1.0] {
        let x = side * COURT_X;
        let yaw = -side * 0.5 * PI;
        for s in [-1.0, 1.0] {
            let at = vec3(x, 3.05, s * 2.12);
            scene.place("Lion", lion, at, yaw);
            scene.place("LionFrame", frame, at, yaw);
        }
        scene.place("Shield", shield, vec3(x, 4.98, 0.0), yaw);
    }
}

/// Turns a lathe's axis from +y to +z, the way reliefs face.
fn turn_to_front(soup: Soup) -> Soup {
    let mut soup = soup;
    for c in soup.tris.iter_mut().flatten() {
        let p: Vec3 = c.p;
        c.p = vec3(p.x, -p.z, p.y);
    }
    soup
}
