//! Tileable noise over the unit square.

use glam::{Vec2, vec2};

use super::super::rng::{hash, unit};

/// Smoothstep between two edges; the edges may be in either order.
pub fn smooth(e0: f32, e1: f32, x: f32) -> f32 {
    let t = ((x - e0) / (e1 - e0)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Linear blend of colours.
pub fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    let t = t.clamp(0.0, 1.0);
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}

/// A colour scaled by `s`.
pub fn scale(a: [f32; 3], s: f32) -> [f32; 3] {
    a.map(|v| v * s)
}

/// Gradient noise in about -0.7..0.7 with `fx` x `fy` lattice cells per tile.
pub fn perlin(uv: Vec2, fx: i32, fy: i32, seed: u32) -> f32 {
    let p = uv * vec2(fx as f32, fy as f32);
    let cell = p.floor();
    let f = p - cell;
    let (ix, iy) = (cell.x as i32, cell.y as i32);
    let grad = |dx: i32, dy: i32| -> f32 {
        let h = hash((ix + dx).rem_euclid(fx), (iy + dy).rem_euclid(fy), seed);
        // Eight directions are enough under several octaves.
        let d = f - vec2(dx as f32, dy as f32);
        let (a, b) = match h >> 29 {
            0 => (d.x, d.y),
            1 => (d.x, -d.y),
            2 => (-d.x, d.y),
            3 => (-d.x, -d.y),
            4 => (1.414 * d.x, 0.0),
            5 => (-1.414 * d.x, 0.0),
            6 => (1.414 * d.y, 0.0),
            _ => (-1.414 * d.y, 0.0),
        };
        a + b
    };
    let e = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let top = grad(0, 0) + (grad(1, 0) - grad(0, 0)) * e.x;
    let bottom = grad(0, 1) + (grad(1, 1) - grad(0, 1)) * e.x;
    top + (bottom - top) * e.y
}

/// Sum of `octaves` of [`perlin`], each twice as fine and half as strong.
pub fn fbm(uv: Vec2, fx: i32, fy: i32, octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut amp, mut f) = (0.0, 1.0, 1);
    for o in 0..octaves {
        sum += amp * perlin(uv, fx * f, fy * f, seed.wrapping_add(o * 101));
        amp *= 0.5;
        f *= 2;
    }
    sum
}

/// Distance to the nearest jittered point (in cells), and that point's hash
/// in 0..1.
pub fn cells(uv: Vec2, f: i32, seed: u32) -> (f32, f32) {
    let p = uv * f as f32;
    let (ix, iy) = (p.x.floor() as i32, p.y.floor() as i32);
    let mut best = (9.0_f32, 0.0);
    for dy in -1..=1 {
        for dx in -1..=1 {
            let (cx, cy) = (ix + dx, iy + dy);
            let (wx, wy) = (cx.rem_euclid(f), cy.rem_euclid(f));
            let q = vec2(
                cx as f32 + unit(wx, wy, seed),
                cy as f32 + unit(wx, wy, seed + 1),
            );
            let d = q.distance(p);
            if d < best.0 {
                best = (d, unit(wx, wy, seed + 2));
            }
        }
    }
    best
}
