//! Curtains and banners.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, vec2};

use super::canvas::Texel;
use super::noise::{fbm, mix, perlin, scale, smooth};

/// Gilt thread.
const GOLD: [f32; 3] = [0.52, 0.34, 0.085];

/// The weave common to all cloth: thread height, and mottling of the dye.
fn weave(uv: Vec2, nx: f32, ny: f32) -> (f32, f32) {
    let (x, y) = (uv.x * nx, uv.y * ny);
    let over = (x.floor() as i32 + y.floor() as i32).rem_euclid(2) == 0;
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let warp = (PI * fx).sin();
    let weft = (PI * fy).sin();
    let thread = if over {
        warp * (0.6 + 0.4 * weft)
    } else {
        weft * (0.6 + 0.4 * warp)
    };
    let slub = fbm(uv, 90, 8, 2, 301) + fbm(uv, 8, 120, 2, 302);
    (thread, slub)
}

/// Stylised palmette of a damask at `p` (centred, about +-0.5): coverage.
fn palmette(p: Vec2) -> f32 {
    let r = p.length();
    let a = p.x.atan2(p.y);
    // A seven-lobed fan over a calyx and a stem.
    let fan = 0.30 + 0.09 * (a * 3.5).cos().abs() - 0.05 * smooth(1.9, 2.6, a.abs());
    let lobes = smooth(0.012, -0.012, r - fan * smooth(2.9, 1.6, a.abs()).max(0.35));
    let core = smooth(0.012, -0.012, r - 0.10);
    let gap = smooth(0.03, 0.05, (r - 0.15).abs());
    let stem = smooth(0.012, -0.004, p.x.abs() - 0.022) * smooth(0.0, -0.05, p.y);
    (lobes * gap).max(core).max(stem)
}

/// Ogee lattice lines and palmettes, `n` x `m` repeats: coverage.
fn damask(uv: Vec2, n: f32, m: f32) -> f32 {
    let x = uv.x * n;
    let y = uv.y * m;
    let ogee = |shift: f32| -> f32 {
        let d =
            (x + shift - (x + shift).floor() - 0.5).abs() - 0.25 + 0.22 * (TAU * (y + shift)).cos();
        smooth(0.045, 0.02, d.abs())
    };
    let lines = ogee(0.0).max(ogee(0.5));
    let motif = |sx: f32, sy: f32| -> f32 {
        let (fx, fy) = (x + sx, y + sy);
        let p = vec2(
            fx - fx.floor() - 0.5,
            -(fy - fy.floor() - 0.5) * (n / m) * 2.0,
        );
        palmette(p * 1.25)
    };
    (0.7 * lines).max(motif(0.0, 0.0)).max(motif(0.5, 0.5))
}

/// Curtain cloth of the given dye: damask tone on tone, a gilt border along
/// the hem (bottom of the image) and a plain heading at the top.
pub fn curtain(uv: Vec2, dye: [f32; 3]) -> Texel {
    let (thread, slub) = weave(uv, 128.0, 256.0);
    let fade = fbm(uv, 2, 3, 4, 303);
    let mut c = scale(dye, 0.92 + 0.16 * thread + 0.12 * slub + 0.22 * fade);
    let field = smooth(0.06, 0.07, uv.y) * smooth(0.865, 0.855, uv.y);
    let motif = damask(vec2(uv.x, uv.y), 3.0, 5.0) * field;
    // The pattern is woven in satin: same dye, paler and glossier.
    let satin = mix(scale(dye, 1.45), GOLD, 0.12);
    c = mix(c, scale(satin, 0.95 + 0.1 * thread), 0.62 * motif);
    // Hem: two gilt lines around a row of lozenges and dots, then a fringe.
    let line = |at: f32, half: f32| smooth(0.0018, 0.0, (uv.y - at).abs() - half);
    let x = uv.x * 9.0;
    let fx = x - x.floor() - 0.5;
    let ly = (uv.y - 0.905) * 18.0;
    let lozenge = smooth(0.05, 0.0, (fx.abs() + ly.abs()) - 0.40)
        - smooth(0.05, 0.0, (fx.abs() + ly.abs()) - 0.24)
        + smooth(0.04, 0.0, vec2(fx, ly).length() - 0.12);
    let fringe = smooth(0.962, 0.966, uv.y) * (0.65 + 0.35 * (uv.x * TAU * 64.0).sin());
    let gilt = line(0.872, 0.005)
        .max(line(0.938, 0.005))
        .max(lozenge.clamp(0.0, 1.0) * line(0.905, 0.028))
        .max(line(0.030, 0.004))
        .max(fringe);
    c = mix(c, scale(GOLD, 0.85 + 0.25 * thread), gilt.clamp(0.0, 1.0));
    // Dust towards the hem.
    c = mix(
        c,
        scale(c, 0.72),
        smooth(0.75, 1.0, uv.y) * (0.5 + fbm(uv, 5, 9, 3, 304)).clamp(0.0, 1.0),
    );
    Texel {
        colour: c,
        height: 0.0011 * thread + 0.0006 * slub + 0.0012 * motif.max(gilt),
        rough: 0.92 - 0.16 * motif - 0.30 * gilt + 0.04 * slub,
    }
}

/// Coverage of a fleur-de-lis around the origin, y up, about 1 high.
fn lily(p: Vec2) -> f32 {
    let m = vec2(p.x.abs(), p.y);
    let soft = |d: f32| smooth(0.015, -0.015, d);
    // Middle petal: pointed oval.
    let t = ((p.y + 0.12) / 0.60).clamp(0.0, 1.0);
    let petal = soft(m.x - 0.13 * (PI * t.powf(0.8)).sin()) * f32::from(p.y > -0.12 && p.y < 0.48);
    // Side petals: arcs that curl outwards and down.
    let c = vec2(0.26, 0.03);
    let d = m - c;
    let a = d.y.atan2(d.x);
    let width = 0.075 * smooth(-0.9, 0.6, a).max(0.25) * smooth(3.4, 2.2, a.abs() + 0.3);
    let side = soft((d.length() - 0.165).abs() - width)
        * f32::from(d.y > -0.08 || (d.x < 0.0 && p.y > -0.16));
    let tip = soft((m - vec2(0.40, -0.02)).length() - 0.062);
    // Band and foot.
    let band = soft((p.y + 0.14).abs() - 0.035) * soft(m.x - 0.24);
    let foot_half = 0.05 + 0.55 * (-0.16 - p.y).max(0.0);
    let foot = soft(m.x - foot_half) * f32::from(p.y < -0.16 && p.y > -0.36);
    petal.max(side).max(tip).max(band).max(foot)
}

/// Coverage of a cross with flared arms and a ring, about 1 high.
fn cross(p: Vec2) -> f32 {
    let soft = |d: f32| smooth(0.012, -0.012, d);
    let m = p.abs();
    let (l, s) = (m.max_element(), m.min_element());
    // Arms widen to their ends, which are cut in a curve.
    let arm = soft(s - (0.055 + 0.28 * l * l)) * soft(l - 0.46 + 0.5 * s * s);
    let ring = soft((p.length() - 0.26).abs() - 0.022);
    arm.max(ring)
}

/// A banner: two dyes, border, charges. `parted` halves the field.
fn banner(uv: Vec2, field: [f32; 3], other: [f32; 3], parted: bool) -> Texel {
    let (thread, slub) = weave(uv, 128.0, 384.0);
    // The cloth is 0.86 x 3.3 m: y in units of its width.
    let y = uv.y * 3.84;
    let x = uv.x - 0.5;
    let shade = 0.92 + 0.14 * thread + 0.10 * slub + 0.2 * fbm(uv, 2, 6, 4, 311);
    let soft = |d: f32| smooth(0.006, -0.006, d);
    let mut c = field;
    if parted {
        c = mix(field, other, soft(-x));
    } else {
        // A pale (vertical band) in the second dye between gilt lines.
        c = mix(c, other, soft(x.abs() - 0.17));
        c = mix(c, GOLD, soft((x.abs() - 0.185).abs() - 0.012));
    }
    for k in 0..4 {
        let cy = 0.55 + 0.86 * k as f32;
        let p = vec2(x, cy - y) / 0.62;
        if p.length() < 1.0 {
            let charge = if (k % 2 == 0) == parted {
                cross(p)
            } else {
                lily(p)
            };
            // Gold does not read on the pale band, the field's own dye does.
            let ink = if parted { GOLD } else { scale(field, 0.9) };
            c = mix(c, ink, charge);
        }
    }
    // Border with a gilt line, following the edges.
    let edge = (0.5 - x.abs()).min(y).min(3.84 - y);
    c = mix(c, scale(field, 0.72), soft(edge - 0.055));
    c = mix(c, GOLD, soft((edge - 0.062).abs() - 0.011));
    c = mix(c, GOLD, soft((edge - 0.012).abs() - 0.010));
    let gilt = c[1] > 0.25 && c[2] < 0.15;
    c = scale(c, shade);
    c = mix(
        c,
        scale(c, 0.7),
        smooth(0.1, 0.6, perlin(uv, 5, 9, 312) + 0.4 * uv.y - 0.2),
    );
    Texel {
        colour: c,
        height: 0.0010 * thread + 0.0005 * slub + if gilt { 0.0006 } else { 0.0 },
        rough: if gilt { 0.66 } else { 0.9 },
    }
}

/// Red banner with a cream pale, gilt crosses and lilies.
pub fn banner_red(uv: Vec2) -> Texel {
    banner(uv, [0.42, 0.028, 0.026], [0.56, 0.49, 0.36], false)
}

/// Banner parted blue and crimson.
pub fn banner_blue(uv: Vec2) -> Texel {
    banner(uv, [0.030, 0.070, 0.30], [0.40, 0.045, 0.035], true)
}
