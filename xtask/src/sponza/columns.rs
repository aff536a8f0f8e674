//! Columns, piers, pilasters and balusters.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Quat, Vec3, vec2, vec3};

use super::mesh::{Corner, Soup, corner};
use super::shapes::{chamfered, cyma, lathe, rect_solid, scotia, torus};

/// Proportions of a round column standing on y = 0.
pub struct Order {
    /// Overall height to the top of the abacus.
    pub height: f32,
    /// Radius of the shaft at its foot.
    pub radius: f32,
    /// Half width of the plinth.
    pub plinth: f32,
    /// Half width of the abacus.
    pub abacus: f32,
    /// Height of the capital with its abacus.
    pub capital: f32,
    /// Facets around.
    pub segments: usize,
    /// Leaves in each of the two tiers of the capital; none for a plain bell.
    pub leaves: usize,
}

/// A column: plinth, Attic base, tapered shaft, leafy bell and abacus.
pub fn column(o: &Order) -> Soup {
    let r = o.radius;
    let plinth_h = 0.45 * r;
    let mut soup = chamfered(
        vec3(-o.plinth, -0.02, -o.plinth),
        vec3(o.plinth, plinth_h, o.plinth),
        0.012,
    );

    let bell_y = o.height - o.capital;
    let abacus_h = 0.26 * o.capital;
    let bell_top = o.height - abacus_h;
    let neck = r * 0.86;

    // Slim columns are seen from afar and get fewer steps per moulding.
    let fine = usize::from(o.leaves > 0);
    let mut p = vec![(0.0, plinth_h - 0.01), (r * 1.20, plinth_h - 0.01)];
    torus(&mut p, r * 1.16, 0.34 * r, 3 + fine);
    let y = p[p.len() - 1].1;
    p.push((r * 1.20, y + 0.03 * r));
    scotia(&mut p, r * 1.08, y + 0.26 * r, 0.09 * r, 2 + fine);
    let y = p[p.len() - 1].1;
    p.push((r * 1.10, y + 0.03 * r));
    torus(&mut p, r * 1.06, 0.20 * r, 2 + fine);
    let y = p[p.len() - 1].1;
    // Apophyge into the shaft, then entasis up to the neck.
    p.push((r * 1.05, y + 0.04 * r));
    p.push((r * 1.01, y + 0.12 * r));
    let y0 = y + 0.2 * r;
    let parts = 2 + fine;
    for i in 0..=parts {
        let t = i as f32 / parts as f32;
        let swell = 1.0 - (1.0 - neck / r) * t.powf(1.7);
        p.push((r * swell, y0 + (bell_y - 0.10 * r - y0) * t));
    }
    // Astragal under the capital.
    p.push((neck * 1.02, bell_y - 0.09 * r));
    torus(&mut p, neck * 1.02, 0.16 * r, 2 + fine);
    let y = p[p.len() - 1].1;
    p.push((neck * 0.98, y + 0.01));
    // The bell flares like a trumpet under the abacus.
    for i in 1..=4 {
        let t = i as f32 / 4.0;
        p.push((bell_radius(o, t), y + 0.01 + (bell_top - y - 0.01) * t));
    }
    p.push((0.0, bell_top));
    // The texture goes round a whole number of times so that it has no seam.
    let around = if TAU * r > 1.2 { 1.6 } else { 0.8 };
    soup.add(lathe(&p, o.segments, around));

    if o.leaves > 0 {
        for tier in 0..2 {
            for k in 0..o.leaves {
                let a = TAU * (k as f32 + 0.5 * tier as f32) / o.leaves as f32;
                soup.add(leaf(o, bell_y, bell_top, tier).transformed(Affine3A::from_rotation_y(a)));
            }
        }
        for k in 0..4 {
            let a = PI * (0.25 + 0.5 * k as f32);
            soup.add(volute(o, bell_top).transformed(Affine3A::from_rotation_y(a)));
        }
    }
    soup.add(abacus(o.abacus, o.height - abacus_h, o.height));
    soup
}

/// Radius of the bell at fraction `t` of its height.
fn bell_radius(o: &Order, t: f32) -> f32 {
    let neck = o.radius * 0.86;
    neck * 0.98 + (o.abacus * 0.93 - neck) * t.powf(2.6)
}

/// Half width, in units of the abacus: fillet, cavetto, fascia.
fn abacus(half: f32, y0: f32, y1: f32) -> Soup {
    let h = y1 - y0;
    let mut p = vec![(half * 0.86, y0), (half * 0.86, y0 + 0.16 * h)];
    cyma(&mut p, half * 0.97, y0 + 0.55 * h, 4);
    p.push((half, y0 + 0.58 * h));
    p.push((half, y1));
    rect_solid(&p.iter().map(|&(d, y)| (d, d, y)).collect::<Vec<_>>())
}

/// Half widths of a leaf from foot to tip: lobes and a rounded end.
const LEAF_OUTLINE: [f32; 7] = [0.62, 0.92, 0.66, 1.0, 0.64, 0.80, 0.30];

/// One acanthus-like leaf along +x: a closed, bent, lobed blade hugging the
/// bell and curling over at its tip.
fn leaf(o: &Order, y0: f32, y1: f32, tier: usize) -> Soup {
    let (nu, nv) = (4_usize, LEAF_OUTLINE.len() - 1);
    let bell_h = y1 - y0;
    let reach = if tier == 0 { 0.50 } else { 0.84 };
    let width = PI * o.radius * 0.80 / o.leaves as f32;
    let thick = 0.22 * o.radius;
    let point = |i: usize, j: usize, front: bool| -> Vec3 {
        let u = i as f32 / nu as f32 * 2.0 - 1.0;
        let v = j as f32 / nv as f32;
        let half = width * LEAF_OUTLINE[j];
        let rise = reach * bell_h * (v * 1.12 - 0.12 * v.powi(4));
        let bend = ((v - 0.45) / 0.55).max(0.0).powi(2);
        let curl = (0.20 + 0.04 * tier as f32) * bell_h * bend.powf(0.8);
        let drop = 0.24 * bell_h * ((v - 0.62) / 0.38).max(0.0).powi(2);
        let t = ((rise + 0.02) / bell_h).clamp(0.0, 1.0);
        // A raised midrib between two hollows; the back stays in the bell
        // until the leaf bends away from it.
        let rib = 0.55 + 0.45 * (u * PI * 2.0).cos();
        let skin = if front {
            thick * (0.40 + 0.60 * rib)
        } else {
            thick * (0.25 * bend - 0.45)
        };
        // The tier behind stands a little deeper so the two never coincide.
        let r = bell_radius(o, t) + 0.30 * thick + curl + skin - 0.010 * tier as f32;
        let a = u * half / (r + 0.02);
        vec3(r * a.cos(), y0 + 0.012 + rise - drop, r * a.sin())
    };
    let mut soup = Soup::default();
    let at = |i: usize, j: usize, front: bool| -> Corner {
        // Rim points are shared by both skins, half way between them.
        let rim = i == 0 || i == nu || j == 0 || j == nv;
        let p = if rim {
            (point(i, j, true) + point(i, j, false)) * 0.5
        } else {
            point(i, j, front)
        };
        let (u, v) = (i as f32 / nu as f32 * 2.0 - 1.0, j as f32 / nv as f32);
        corner(p, vec2(u * width, -v * bell_h * reach))
    };
    for i in 0..nu {
        for j in 0..nv {
            let q = |f: bool| {
                [
                    at(i, j, f),
                    at(i + 1, j, f),
                    at(i + 1, j + 1, f),
                    at(i, j + 1, f),
                ]
            };
            let (f, b) = (q(true), q(false));
            soup.quad(f[3], f[2], f[1], f[0]);
            soup.quad(b[0], b[1], b[2], b[3]);
        }
    }
    soup
}

/// A scroll under each corner of the abacus: a short horizontal drum.
fn volute(o: &Order, y: f32) -> Soup {
    let r = 0.115 * o.capital;
    let p = [
        (0.0, -0.80 * r),
        (0.50 * r, -0.72 * r),
        (r, -0.62 * r),
        (r, 0.62 * r),
        (0.50 * r, 0.72 * r),
        (0.0, 0.80 * r),
    ];
    let turn = Quat::from_rotation_x(0.5 * PI);
    lathe(&p, 10, 0.4).transformed(Affine3A::from_rotation_translation(
        turn,
        vec3(o.abacus * 1.17, y - r * 0.80, 0.0),
    ))
}

/// A square pier (or, let into a wall, a pilaster) with base and impost. Its
/// mouldings grow with `scale`; below one half they are simplified.
pub fn pier(half_x: f32, half_z: f32, height: f32, scale: f32) -> Soup {
    let s = scale;
    let top = height;
    // (offset from the shaft face, height)
    let mut p = vec![(0.10 * s, -0.02), (0.10 * s, 0.20 * s)];
    if s >= 0.5 {
        torus(&mut p, 0.07 * s, 0.09 * s, 4);
        let y = p[p.len() - 1].1;
        p.push((0.06 * s, y + 0.01 * s));
        scotia(&mut p, 0.025 * s, y + 0.10 * s, 0.012 * s, 3);
        let y = p[p.len() - 1].1;
        torus(&mut p, 0.02 * s, 0.05 * s, 3);
        p.push((0.0, y + 0.055 * s));
        p.push((0.0, top - 0.62 * s));
        torus(&mut p, 0.005 * s, 0.05 * s, 3);
        p.push((0.0, top - 0.565 * s));
    } else {
        p.push((0.05 * s, 0.27 * s));
        p.push((0.0, 0.36 * s));
    }
    p.push((0.0, top - 0.36 * s));
    p.push((0.03 * s, top - 0.34 * s));
    p.push((0.03 * s, top - 0.30 * s));
    cyma(
        &mut p,
        0.10 * s,
        top - 0.15 * s,
        if s >= 0.5 { 4 } else { 2 },
    );
    p.push((0.12 * s, top - 0.14 * s));
    p.push((0.12 * s, top));
    rect_solid(
        &p.iter()
            .map(|&(d, y)| (half_x + d, half_z + d, y))
            .collect::<Vec<_>>(),
    )
}

/// A corbel: a moulded bracket that carries a rib where no pilaster stands.
pub fn corbel(half: f32, depth: f32, top: f32) -> Soup {
    let mut rings = Vec::new();
    for i in 0..=6 {
        let t = i as f32 / 6.0;
        let e = (t * PI * 0.5).sin();
        rings.push((
            half * (0.45 + 0.5 * e),
            depth * (0.25 + 0.7 * e),
            top - 0.55 + 0.42 * t,
        ));
    }
    rings.push((half * 1.08, depth * 1.04, top - 0.12));
    rings.push((half * 1.08, depth * 1.04, top));
    rect_solid(&rings)
}

/// A turned baluster between y = 0 and `height`.
pub fn baluster(height: f32) -> Soup {
    let h = height;
    let p = [
        (0.0, -0.01),
        (0.070, -0.01),
        (0.040, 0.13 * h),
        // Vase-shaped belly.
        (0.068, 0.26 * h),
        (0.074, 0.36 * h),
        (0.046, 0.58 * h),
        (0.031, 0.77 * h),
        // Ring and cap.
        (0.058, 0.83 * h),
        (0.042, 0.89 * h),
        (0.070, h + 0.01),
        (0.0, h + 0.01),
    ];
    lathe(&p, 7, 0.4)
}
