//! Walls with arched openings, and the mouldings around them.

use std::f32::consts::PI;

use glam::{Vec3, vec2, vec3};

use super::mesh::{Corner, Soup, corner};
use super::shapes::arch_sweep;

/// A round- or elliptic-headed opening through a wall.
#[derive(Clone, Copy)]
pub struct Opening {
    /// Centre along the wall.
    pub x: f32,
    /// Half of the clear width.
    pub half: f32,
    /// Height of the head above the springing line.
    pub rise: f32,
    /// Bottom of the opening; the wall's own foot makes it a gap down to it.
    pub sill: f32,
    /// Springing line.
    pub spring: f32,
}

/// Extents of a straight wall: x along it, z through it.
#[derive(Clone, Copy)]
pub struct Slab {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

/// A closed wall with openings (sorted by x) cut through it. `segments` is
/// the number of chords of each arch.
pub fn pierced_wall(slab: Slab, openings: &[Opening], segments: usize) -> Soup {
    let (lo, hi) = (slab.min, slab.max);
    // The wall face as a row of vertical bands between pairs of polylines
    // (x, heights); bands next to each other share all their points.
    let mut bands: Vec<[(f32, Vec<f32>); 2]> = Vec::new();
    let mut soup = Soup::default();
    let mut left = (lo.x, vec![lo.y, hi.y]);
    let mut top_x = vec![lo.x];
    let mut bottom: Vec<f32> = vec![lo.x];
    for o in openings {
        let raised = o.sill > lo.y + 1.0e-4;
        let mut jamb = vec![lo.y];
        if raised {
            jamb.push(o.sill);
        }
        if o.spring > o.sill + 1.0e-4 {
            jamb.push(o.spring);
        }
        jamb.push(hi.y);
        let (x0, x1) = (o.x - o.half, o.x + o.half);
        bands.push([left, (x0, jamb.clone())]);
        let head = |k: usize| -> (f32, f32) {
            let t = PI * (1.0 - k as f32 / segments as f32);
            if k == 0 {
                (x0, o.spring)
            } else if k == segments {
                (x1, o.spring)
            } else {
                (o.x + o.half * t.cos(), o.spring + o.rise * t.sin())
            }
        };
        for k in 0..segments {
            let ((xa, ya), (xb, yb)) = (head(k), head(k + 1));
            bands.push([(xa, vec![ya, hi.y]), (xb, vec![yb, hi.y])]);
        }
        for k in 0..=segments {
            top_x.push(head(k).0);
        }
        soup.add(reveal(lo, hi, o, segments, head));
        bottom.push(x0);
        if raised {
            bands.push([(x0, vec![lo.y, o.sill]), (x1, vec![lo.y, o.sill])]);
        } else {
            // The gap: close this run of the foot and start the next.
            foot(&mut soup, &bottom, lo, hi);
            bottom.clear();
        }
        bottom.push(x1);
        left = (x1, jamb);
    }
    bands.push([left, (hi.x, vec![lo.y, hi.y])]);
    bottom.push(hi.x);
    foot(&mut soup, &bottom, lo, hi);
    top_x.push(hi.x);

    for [a, b] in &bands {
        let line = |(x, ys): &(f32, Vec<f32>), z: f32, s: f32| -> Vec<Corner> {
            ys.iter()
                .map(|&y| corner(vec3(*x, y, z), vec2(s * x, -y)))
                .collect()
        };
        soup.zip(&line(a, hi.z, 1.0), &line(b, hi.z, 1.0));
        soup.zip(&line(b, lo.z, -1.0), &line(a, lo.z, -1.0));
    }
    for w in top_x.windows(2) {
        let q = [(w[0], hi.z), (w[1], hi.z), (w[1], lo.z), (w[0], lo.z)]
            .map(|(x, z)| corner(vec3(x, hi.y, z), vec2(x, z)));
        soup.quad(q[0], q[1], q[2], q[3]);
    }
    for (x, flip) in [(lo.x, false), (hi.x, true)] {
        let q = [(lo.y, lo.z), (lo.y, hi.z), (hi.y, hi.z), (hi.y, lo.z)]
            .map(|(y, z)| corner(vec3(x, y, z), vec2(z, -y)));
        if flip {
            soup.quad(q[3], q[2], q[1], q[0]);
        } else {
            soup.quad(q[0], q[1], q[2], q[3]);
        }
    }
    soup
}

/// Underside of the wall over a run of x stations.
fn foot(soup: &mut Soup, xs: &[f32], lo: Vec3, hi: Vec3) {
    for w in xs.windows(2) {
        let q = [(w[0], lo.z), (w[1], lo.z), (w[1], hi.z), (w[0], hi.z)]
            .map(|(x, z)| corner(vec3(x, lo.y, z), vec2(x, z)));
        soup.quad(q[0], q[1], q[2], q[3]);
    }
}

/// Jambs, arch soffit and sill of an opening.
fn reveal(
    lo: Vec3,
    hi: Vec3,
    o: &Opening,
    segments: usize,
    head: impl Fn(usize) -> (f32, f32),
) -> Soup {
    // The outline from the left foot over the head to the right foot.
    let mut outline: Vec<(f32, f32)> = Vec::new();
    let has_jamb = o.spring > o.sill + 1.0e-4;
    if has_jamb {
        outline.push((o.x - o.half, o.sill));
    }
    for k in 0..=segments {
        outline.push(head(k));
    }
    if has_jamb {
        outline.push((o.x + o.half, o.sill));
    }
    if o.sill > lo.y + 1.0e-4 {
        outline.push(outline[0]);
    }
    let mut soup = Soup::default();
    let mut along = -o.sill;
    for w in outline.windows(2) {
        let (a, b) = (w[0], w[1]);
        let next = along - vec2(b.0 - a.0, b.1 - a.1).length();
        let q = [
            corner(vec3(a.0, a.1, lo.z), vec2(lo.z, along)),
            corner(vec3(b.0, b.1, lo.z), vec2(lo.z, next)),
            corner(vec3(b.0, b.1, hi.z), vec2(hi.z, next)),
            corner(vec3(a.0, a.1, hi.z), vec2(hi.z, along)),
        ];
        soup.quad(q[0], q[1], q[2], q[3]);
        along = next;
    }
    soup
}

/// A stepped and rounded band around an arch, standing `depth` proud of a
/// wall face at z = 0 and `width` wide from the arch outwards.
pub fn archivolt(half: f32, rise: f32, width: f32, depth: f32, segments: usize) -> Soup {
    let (w, d) = (width, depth);
    // Two fasciae and a roll at the extrados; 2 cm are let into the wall. The
    // inner edge lies 5 mm off the soffit, where faces would coincide.
    let large = [
        (0.005, -0.02),
        (w, -0.02),
        (w, 0.75 * d),
        (w * 0.96, 0.95 * d),
        (w * 0.88, d),
        (w * 0.78, 0.86 * d),
        (w * 0.76, 0.58 * d),
        (w * 0.40, 0.58 * d),
        (w * 0.40, 0.34 * d),
        (0.005, 0.34 * d),
    ];
    // Small arches make do with one fascia.
    let small = [
        (0.005, -0.02),
        (w, -0.02),
        (w, 0.80 * d),
        (w * 0.86, d),
        (w * 0.66, 0.9 * d),
        (w * 0.62, 0.5 * d),
        (0.005, 0.5 * d),
    ];
    let profile: &[(f32, f32)] = if w > 0.18 { &large } else { &small };
    arch_sweep(profile, half, rise, segments)
}

/// A wedge-shaped keystone with a sunk face, over an arch of radius `r`
/// springing at the origin; the wall face is z = 0.
pub fn keystone(r: f32, height: f32, depth: f32) -> Soup {
    let (b, t) = (height * 0.30, height * 0.44);
    let (y0, y1) = (r - 0.03, r + height);
    let mut soup = Soup::default();
    // Front outline, then the same outline bevelled.
    let outline = |inset: f32, z: f32| -> [Vec3; 4] {
        [
            vec3(-b + inset, y0 + inset, z),
            vec3(b - inset, y0 + inset, z),
            vec3(t - inset, y1 - inset, z),
            vec3(-t + inset, y1 - inset, z),
        ]
    };
    let rings = [
        outline(0.0, -0.03),
        outline(0.0, depth - 0.02),
        outline(0.02, depth),
        outline(0.05, depth),
        outline(0.06, depth - 0.015),
    ];
    let c = |p: Vec3| corner(p, vec2(p.x + p.z, -p.y));
    for w in rings.windows(2) {
        for i in 0..4 {
            let j = (i + 1) % 4;
            soup.quad(c(w[0][i]), c(w[0][j]), c(w[1][j]), c(w[1][i]));
        }
    }
    let (f, k) = (rings[4], rings[0]);
    soup.quad(c(f[0]), c(f[1]), c(f[2]), c(f[3]));
    soup.quad(c(k[3]), c(k[2]), c(k[1]), c(k[0]));
    soup.box_uv()
}
