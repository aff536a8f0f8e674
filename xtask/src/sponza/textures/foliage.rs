//! The alpha-masked twigs of the plants.

use std::f32::consts::PI;

use glam::{Vec2, vec2};

use super::super::rng::unit;
use super::canvas::{Texel, encode_srgb};
use super::noise::{fbm, mix, scale, smooth};

/// One leaf of a twig, in twig coordinates: x across, y from foot to tip,
/// both in widths of the twig's strip.
struct Leaf {
    foot: Vec2,
    dir: Vec2,
    length: f32,
    half: f32,
    tone: f32,
}

/// Height of a twig's strip in its widths.
const ASPECT: f32 = 4.0;

/// The leaves of twig `k`, back to front.
fn leaves(k: i32) -> Vec<Leaf> {
    let n = 15;
    let mut out: Vec<Leaf> = (0..n)
        .map(|i| {
            let t = i as f32 / (n - 1) as f32;
            let side = if (i + k) % 2 == 0 { 1.0 } else { -1.0 };
            let y = 0.55 + t * 2.75;
            let spread = 1.05 - 0.55 * t + 0.25 * (unit(i, k, 401) - 0.5);
            let length = (0.52 - 0.12 * t) * (0.85 + 0.3 * unit(i, k, 402));
            Leaf {
                foot: vec2(0.5 + stem(y, k), y),
                dir: vec2(side * spread.sin(), spread.cos()),
                length,
                half: length * (0.20 + 0.06 * unit(i, k, 403)),
                tone: unit(i, k, 404),
            }
        })
        .collect();
    out.push(Leaf {
        foot: vec2(0.5 + stem(3.3, k), 3.3),
        dir: vec2(0.0, 1.0),
        length: 0.6,
        half: 0.13,
        tone: 0.8,
    });
    out
}

/// Sideways bend of twig `k`'s stem at height `y`.
fn stem(y: f32, k: i32) -> f32 {
    0.05 * (y * 1.1 + 1.7 * k as f32).sin()
}

/// Colour and coverage of the atlas at `uv`.
fn sample(uv: Vec2, twigs: &[Vec<Leaf>]) -> ([f32; 3], f32, f32) {
    let k = ((uv.x * 4.0) as usize).min(3);
    let p = vec2(uv.x * 4.0 - k as f32, (1.0 - uv.y) * ASPECT);
    let mottle = 1.0 + 0.18 * fbm(uv, 32, 32, 3, 405);
    // The green behind everything keeps filtered edges from going dark.
    let mut colour = [0.075, 0.135, 0.030];
    let (mut cover, mut height) = (0.0, 0.0);
    let d = (p.x - 0.5 - stem(p.y, k as i32)).abs();
    let thick = 0.028 * (1.0 - p.y / ASPECT * 0.7);
    if p.y < 3.4 && d < thick {
        colour = scale([0.12, 0.085, 0.04], mottle);
        cover = 1.0;
        height = 0.002;
    }
    for leaf in &twigs[k] {
        let q = p - leaf.foot;
        let along = q.dot(leaf.dir) / leaf.length;
        let across = q.perp_dot(leaf.dir);
        if !(0.0..=1.0).contains(&along) {
            continue;
        }
        let half = leaf.half * (PI * along.powf(0.72)).sin().max(0.0).powf(0.8);
        let a = across.abs();
        if a < half {
            let young = mix([0.055, 0.125, 0.026], [0.16, 0.235, 0.050], leaf.tone);
            let vein = (along * 9.0 - a / leaf.half * 2.2).fract();
            let vein = smooth(0.12, 0.0, (vein - 0.5).abs());
            let rib = smooth(0.022, 0.006, a);
            colour = scale(young, mottle * (0.86 + 0.28 * (a / half)));
            colour = mix(colour, [0.25, 0.31, 0.10], 0.55 * rib.max(0.35 * vein));
            // A browned tip here and there.
            colour = mix(
                colour,
                [0.24, 0.155, 0.05],
                smooth(0.80, 1.0, along) * smooth(0.5, 0.9, 1.0 - leaf.tone),
            );
            // Shaded edge where it lies on the leaves behind.
            cover = 1.0;
            height = 0.004 * (1.0 - (a / half).powi(2)) - 0.002 * rib;
        }
    }
    (colour, cover, height)
}

/// The atlas as RGBA bytes; four samples decide each pixel's alpha.
pub fn rgba(size: u32) -> Vec<u8> {
    let twigs: Vec<Vec<Leaf>> = (0..4).map(leaves).collect();
    let mut out = Vec::with_capacity((size * size * 4) as usize);
    for y in 0..size {
        for x in 0..size {
            let (mut sum, mut weight, mut cover) = ([0.0; 3], 0.0, 0.0);
            let mut behind = [0.0; 3];
            for s in 0..4 {
                let o = vec2((s % 2) as f32, (s / 2) as f32) * 0.5 + 0.25;
                let uv = (vec2(x as f32, y as f32) + o) / size as f32;
                let (c, a, _) = sample(uv, &twigs);
                for i in 0..3 {
                    sum[i] += c[i] * a;
                }
                weight += a;
                cover += 0.25 * a;
                behind = c;
            }
            let c = if weight > 0.0 {
                sum.map(|v| v / weight)
            } else {
                behind
            };
            out.extend(c.map(encode_srgb));
            out.push((cover * 255.0 + 0.5) as u8);
        }
    }
    out
}

/// Relief and gloss of the leaves, for the normal and roughness maps.
pub fn texel(twigs: &Twigs, uv: Vec2) -> Texel {
    let (colour, _, height) = sample(uv, &twigs.0);
    Texel {
        colour,
        height,
        rough: 0.48 + 0.12 * fbm(uv, 24, 24, 2, 406),
    }
}

/// The atlas's leaves, laid out once.
pub struct Twigs(Vec<Vec<Leaf>>);

impl Twigs {
    /// Lays out all four twigs.
    pub fn new() -> Self {
        Self((0..4).map(leaves).collect())
    }
}
