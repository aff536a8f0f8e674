//! Surfaces without joints: carved stone, plaster, clay, timber, iron.

use glam::{Vec2, vec2};

use super::canvas::Texel;
use super::noise::{cells, fbm, mix, perlin, scale, smooth};

/// Fine pale limestone, tooled and weathered, on a 1.6 m tile.
pub fn carved(uv: Vec2) -> Texel {
    let grain = fbm(uv, 32, 32, 4, 201);
    let fine = fbm(uv, 150, 150, 2, 202);
    let big = fbm(uv, 2, 2, 5, 203);
    let bedding = fbm(uv, 3, 26, 3, 204);
    // Shell-shaped voids of travertine: squeezed, ragged, and only in bands.
    let pit_zone = smooth(0.12, 0.55, fbm(uv, 5, 11, 4, 205));
    let ragged = uv + vec2(perlin(uv, 70, 70, 209), perlin(uv, 70, 70, 210)) * 0.006;
    let (pit, pit_size) = cells(ragged, 58, 206);
    let pits = 0.8 * smooth(0.36 * pit_size, 0.20 * pit_size, pit) * pit_zone;
    let mut c = mix([0.590, 0.500, 0.370], [0.550, 0.485, 0.385], 0.5 + big);
    c = scale(c, 1.0 + 0.08 * grain + 0.07 * fine + 0.07 * bedding);
    let stain = smooth(0.05, 0.55, fbm(uv, 4, 3, 5, 207));
    c = mix(c, [0.405, 0.335, 0.245], 0.42 * stain);
    let streak = smooth(0.15, 0.6, fbm(uv, 18, 2, 4, 208));
    c = mix(c, scale(c, 0.72), 0.45 * streak);
    c = mix(c, scale(c, 0.60), pits);
    Texel {
        colour: c,
        height: 0.0010 * grain + 0.0004 * fine + 0.0006 * bedding - 0.0022 * pits,
        rough: 0.76 + 0.10 * grain + 0.08 * stain,
    }
}

/// Lime plaster with trowel marks, stains, hair cracks and a few patches
/// where the finish coat has come off, on a 3.2 m tile.
pub fn plaster(uv: Vec2) -> Texel {
    let trowel = fbm(uv + vec2(0.0, 0.02 * perlin(uv, 6, 6, 221)), 14, 22, 4, 222);
    let fine = fbm(uv, 170, 170, 2, 223);
    let big = fbm(uv, 2, 2, 5, 224);
    let lost = smooth(0.52, 0.56, fbm(uv, 4, 4, 5, 225) + 0.06 * fine);
    let crack_line = fbm(uv, 5, 5, 5, 226).abs();
    let crack = smooth(0.012, 0.003, crack_line) * smooth(0.05, 0.3, fbm(uv, 3, 3, 3, 227));
    let mut c = mix(
        [0.655, 0.575, 0.450],
        [0.610, 0.560, 0.470],
        0.5 + 0.9 * big,
    );
    c = scale(c, 1.0 + 0.05 * trowel + 0.04 * fine + 0.07 * big);
    let stain = smooth(0.05, 0.6, fbm(uv, 3, 4, 5, 228));
    c = mix(c, [0.475, 0.375, 0.255], 0.40 * stain);
    let rough_coat = scale([0.46, 0.385, 0.285], 1.0 + 0.25 * fbm(uv, 80, 80, 3, 229));
    c = mix(c, rough_coat, lost);
    c = mix(c, scale(c, 0.5), 0.8 * crack);
    Texel {
        colour: c,
        height: 0.0016 * trowel + 0.0003 * fine - 0.004 * lost - 0.002 * crack
            + 0.0012 * lost * fbm(uv, 80, 80, 3, 229),
        rough: 0.86 + 0.05 * trowel + 0.06 * lost,
    }
}

/// Fired clay with lichen and soot, on a 1.2 m tile.
pub fn clay(uv: Vec2) -> Texel {
    let grain = fbm(uv, 40, 40, 4, 241);
    let fine = fbm(uv, 130, 130, 2, 242);
    let big = fbm(uv, 3, 3, 4, 243);
    let mut c = mix([0.46, 0.205, 0.105], [0.50, 0.285, 0.165], 0.5 + 0.9 * big);
    c = scale(c, 1.0 + 0.15 * grain + 0.10 * fine);
    let soot = smooth(0.0, 0.6, fbm(uv, 5, 7, 5, 244));
    c = mix(c, [0.20, 0.13, 0.09], 0.55 * soot);
    let lichen =
        smooth(0.34, 0.20, cells(uv, 22, 245).0) * smooth(0.1, 0.45, fbm(uv, 5, 5, 3, 246));
    c = mix(c, [0.46, 0.42, 0.28], 0.7 * lichen);
    Texel {
        colour: c,
        height: 0.0010 * grain + 0.0005 * fine + 0.0008 * lichen,
        rough: 0.78 + 0.12 * grain + 0.08 * lichen,
    }
}

/// Dark oiled oak, grain along u, on a 1.6 m tile.
pub fn wood(uv: Vec2) -> Texel {
    let bend = 0.02 * perlin(uv, 2, 3, 261) + 0.006 * perlin(uv, 6, 12, 262);
    let q = uv + vec2(0.0, bend);
    let rings = fbm(q, 1, 36, 3, 263);
    let fibre = fbm(q, 7, 210, 2, 264);
    let pores = smooth(0.30, 0.55, fbm(q, 16, 240, 2, 265));
    let big = fbm(uv, 2, 5, 3, 266);
    let mut c = mix(
        [0.115, 0.062, 0.032],
        [0.205, 0.120, 0.064],
        0.5 + 0.9 * rings,
    );
    c = scale(c, 1.0 + 0.22 * fibre + 0.22 * big);
    c = mix(c, [0.05, 0.030, 0.018], 0.7 * pores);
    // Dry cracks along the grain.
    let crack = smooth(0.020, 0.006, perlin(q, 3, 18, 267).abs())
        * smooth(0.15, 0.45, perlin(uv, 5, 9, 268));
    c = mix(c, [0.03, 0.018, 0.011], crack);
    Texel {
        colour: c,
        height: 0.0009 * rings + 0.0006 * fibre - 0.0007 * pores - 0.004 * crack,
        rough: 0.60 + 0.12 * fibre + 0.12 * big,
    }
}

/// Hammered metal; the material's factor gives its colour. On a 0.5 m tile.
pub fn iron(uv: Vec2) -> Texel {
    let (d, _) = cells(uv, 18, 281);
    let dents = (d * d).min(0.6);
    let grain = fbm(uv, 60, 60, 3, 282);
    let rust = smooth(0.10, 0.55, fbm(uv, 6, 6, 5, 283));
    let c = mix([0.85, 0.85, 0.85], [0.60, 0.40, 0.27], 0.6 * rust);
    Texel {
        colour: scale(c, 1.0 + 0.15 * grain),
        height: 0.0012 * dents + 0.0003 * grain + 0.0005 * rust,
        rough: 0.48 + 0.12 * grain + 0.30 * rust,
    }
}
