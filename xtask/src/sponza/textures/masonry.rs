//! Jointed surfaces: ashlar, brick and floor slabs.

use glam::{Vec2, vec2};

use super::super::rng::unit;
use super::canvas::Texel;
use super::noise::{cells, fbm, mix, perlin, scale, smooth};

/// Where a point lies in its stone.
struct Stone {
    /// Distance to the nearest edge, metres.
    edge: f32,
    /// Identity for per-stone variation.
    id: (i32, i32),
}

/// Stones in courses: `rows` of them on a tile of `size` metres, with
/// `counts(row)` stones each, their ends jittered by `jitter` of a length.
fn courses(uv: Vec2, size: f32, rows: i32, count: impl Fn(i32) -> i32, jitter: f32) -> Stone {
    let y = uv.y * rows as f32;
    let row = (y.floor() as i32).rem_euclid(rows);
    let fy = y - y.floor();
    let n = count(row);
    // Alternate rows break joint.
    let shift = if row % 2 == 0 { 0.0 } else { 0.5 };
    let x = uv.x * n as f32 + shift;
    let joint = |k: i32| -> f32 { k as f32 + jitter * (unit(k.rem_euclid(n), row, 17) - 0.5) };
    let mut k = x.floor() as i32;
    if x < joint(k) {
        k -= 1;
    } else if x >= joint(k + 1) {
        k += 1;
    }
    let len = size / n as f32;
    let dx = (x - joint(k)).min(joint(k + 1) - x) * len;
    let dy = fy.min(1.0 - fy) * size / rows as f32;
    // Rounded corners.
    let r = 0.02;
    let edge = if dx < r && dy < r {
        r - vec2(r - dx, r - dy).length()
    } else {
        dx.min(dy)
    };
    Stone {
        edge,
        id: (k.rem_euclid(n), row),
    }
}

/// Warm limestone blocks in 0.4 m courses on a 3.2 m tile.
pub fn ashlar(uv: Vec2) -> Texel {
    let warp = vec2(
        perlin(uv, 40, 40, 1) + 0.5 * perlin(uv, 97, 97, 2),
        perlin(uv, 40, 40, 3) + 0.5 * perlin(uv, 97, 97, 4),
    ) * 0.0009;
    let s = courses(uv + warp, 3.2, 8, |r| 4 + (r * 5 % 3 == 1) as i32, 0.35);
    let (i, j) = s.id;
    let chip = (0.30 - cells(uv, 28, 5).0).max(0.0) * 0.05;
    let d = s.edge - chip * smooth(0.05, 0.0, s.edge) - 0.002 * fbm(uv, 60, 60, 2, 6).abs();
    let stone = smooth(0.003, 0.0065, d);
    let round = smooth(0.003, 0.020, d);

    let grain = fbm(uv, 48, 48, 4, 7);
    let fine = fbm(uv, 180, 180, 2, 8);
    let big = fbm(uv, 2, 2, 4, 9);
    let bedding = fbm(uv + vec2(0.0, unit(i, j, 3)), 5, 44, 3, 10);
    let ragged = uv + vec2(perlin(uv, 90, 90, 16), perlin(uv, 90, 90, 18)) * 0.005;
    let (pit, pit_size) = cells(ragged, 76, 11);
    let pits = 0.7
        * smooth(0.34 * pit_size, 0.18 * pit_size, pit)
        * smooth(0.15, 0.5, fbm(uv, 9, 13, 3, 12));
    // Each block leans a little and was tooled differently.
    let lean = (unit(i, j, 21) - 0.5) * 0.004;

    let tint = unit(i, j, 31);
    let tone = 0.88 + 0.22 * unit(i, j, 32);
    let mut c = mix([0.575, 0.465, 0.325], [0.530, 0.455, 0.350], tint);
    if unit(i, j, 33) > 0.86 {
        c = mix(c, [0.50, 0.375, 0.25], 0.55);
    }
    c = scale(
        c,
        tone * (1.0 + 0.10 * grain + 0.08 * fine + 0.10 * bedding + 0.08 * big),
    );
    // Rain streaks and soot.
    let streak = smooth(0.10, 0.55, fbm(uv, 22, 2, 4, 13) + 0.5 * big);
    c = mix(c, scale(c, 0.70), 0.55 * streak);
    let stain = smooth(0.15, 0.6, fbm(uv, 4, 4, 5, 14));
    c = mix(c, [0.40, 0.33, 0.235], 0.35 * stain);
    c = mix(c, scale(c, 0.62), pits);
    c = scale(c, 0.90 + 0.10 * round);
    let mortar = scale([0.46, 0.42, 0.345], 0.92 + 0.25 * fbm(uv, 120, 120, 2, 15));
    Texel {
        colour: mix(mortar, c, stone),
        height: stone * (0.004 + lean + 0.0035 * round)
            + 0.0011 * grain
            + 0.0005 * fine
            + 0.0008 * bedding
            - 0.003 * pits,
        rough: 0.82 + 0.08 * grain + 0.06 * (1.0 - stone),
    }
}

/// Old bricks, 25 x 7.7 cm with thick joints, on a 2 m tile.
pub fn brick(uv: Vec2) -> Texel {
    let warp = vec2(perlin(uv, 50, 50, 41), perlin(uv, 50, 50, 42)) * 0.0012;
    let s = courses(uv + warp, 2.0, 26, |_| 8, 0.10);
    let (i, j) = s.id;
    let d = s.edge - 0.003 * fbm(uv, 70, 70, 2, 43).abs();
    let face = smooth(0.0045, 0.0085, d);
    let grain = fbm(uv, 90, 90, 3, 44);
    let big = fbm(uv, 3, 3, 4, 45);
    let t = unit(i, j, 46);
    let mut c = mix([0.345, 0.165, 0.100], [0.42, 0.235, 0.140], t);
    if t > 0.85 {
        c = [0.24, 0.125, 0.095];
    } else if t < 0.12 {
        c = [0.46, 0.32, 0.205];
    }
    c = scale(c, 0.85 + 0.3 * unit(i, j, 47) + 0.18 * grain);
    // Lime bloom and dirt.
    c = mix(
        c,
        [0.52, 0.46, 0.38],
        0.40 * smooth(0.1, 0.7, big + 0.3 * grain),
    );
    c = mix(
        c,
        scale(c, 0.65),
        smooth(0.15, 0.6, fbm(uv, 14, 2, 4, 48)) * 0.5,
    );
    let mortar = scale([0.44, 0.40, 0.33], 0.9 + 0.3 * fbm(uv, 120, 120, 2, 49));
    Texel {
        colour: mix(mortar, c, face),
        height: face * (0.006 + 0.004 * (unit(i, j, 50) - 0.5)) + 0.0015 * grain,
        rough: 0.88 + 0.06 * grain,
    }
}

/// Worn slabs, 0.8 m square with small dark insets at every other crossing,
/// on a 3.2 m tile.
pub fn floor(uv: Vec2) -> Texel {
    let warp = vec2(perlin(uv, 30, 30, 61), perlin(uv, 30, 30, 62)) * 0.0006;
    let q = uv + warp;
    let p = q * 4.0;
    let (i, j) = (
        (p.x.floor() as i32).rem_euclid(4),
        (p.y.floor() as i32).rem_euclid(4),
    );
    let f = p - p.floor();
    let mut edge = f.min(1.0 - f).min_element() * 0.8;
    // Diamond insets: distance in the taxicab metric to the crossing.
    let near = (p + 0.5).floor();
    let inset_here = (near.x as i32 + near.y as i32).rem_euclid(2) == 0;
    let taxi = ((p - near).abs().x + (p - near).abs().y) * 0.8;
    let half = 0.15;
    let mut inset = 0.0;
    if inset_here {
        let d = (taxi - half) * std::f32::consts::FRAC_1_SQRT_2;
        if d < 0.0 {
            inset = 1.0;
            edge = -d;
        } else {
            edge = edge.min(d);
        }
    }
    let chip = (0.28 - cells(uv, 24, 63).0).max(0.0) * 0.04;
    let d = edge - chip * smooth(0.04, 0.0, edge) - 0.0012 * fbm(uv, 60, 60, 2, 64).abs();
    let slab = smooth(0.0020, 0.0045, d);
    let round = smooth(0.002, 0.016, d);
    let grain = fbm(uv, 40, 40, 4, 65);
    let fine = fbm(uv, 200, 200, 2, 66);
    let big = fbm(uv, 2, 2, 4, 67);
    // Veins, different in every slab.
    let off = vec2(unit(i, j, 68), unit(i, j, 69));
    let vein = smooth(0.06, 0.0, fbm(uv + off, 5, 5, 4, 70).abs());
    let tone = 0.86 + 0.24 * unit(i, j, 71);
    let mut c = mix([0.50, 0.435, 0.345], [0.455, 0.415, 0.36], unit(i, j, 72));
    c = scale(c, tone * (1.0 + 0.09 * grain + 0.05 * fine + 0.08 * big));
    c = mix(c, [0.56, 0.52, 0.45], 0.35 * vein);
    let dark = scale([0.215, 0.13, 0.095], 1.0 + 0.3 * grain + 0.1 * fine);
    c = mix(c, mix(dark, [0.42, 0.36, 0.30], 0.4 * vein), inset);
    let dirt = smooth(0.05, 0.6, fbm(uv, 6, 6, 5, 73));
    c = mix(c, scale(c, 0.66), 0.5 * dirt);
    c = scale(c, 0.82 + 0.18 * round);
    let joint = scale([0.20, 0.175, 0.14], 1.0 + 0.4 * fbm(uv, 120, 120, 2, 74));
    let pits = smooth(0.20, 0.08, cells(uv, 90, 75).0) * smooth(0.0, 0.5, big + grain);
    Texel {
        colour: mix(joint, c, slab),
        height: slab * (0.003 + 0.0025 * round + 0.0016 * (unit(i, j, 76) - 0.5))
            + 0.0005 * grain
            + 0.00025 * fine
            - 0.0015 * pits,
        // Feet have polished the slabs, dirt and joints stay dull.
        rough: (0.46 + 0.14 * grain + 0.22 * dirt).clamp(0.3, 0.9) * slab + 0.92 * (1.0 - slab),
    }
}
