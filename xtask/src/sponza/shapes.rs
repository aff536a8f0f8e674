//! Building blocks shared by all parts: boxes, lathes, lofts, sweeps, grids.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, vec2, vec3};

use super::mesh::{Corner, Soup, corner};

/// An axis-aligned box.
pub fn cuboid(min: Vec3, max: Vec3) -> Soup {
    let (c, h) = ((min + max) * 0.5, (max - min) * 0.5);
    rect_solid(&[(h.x, h.z, min.y), (h.x, h.z, max.y)])
        .moved(vec3(c.x, 0.0, c.z))
        .box_uv()
}

/// An axis-aligned box with chamfered edges, for timber and dressed stone.
pub fn chamfered(min: Vec3, max: Vec3, e: f32) -> Soup {
    let (c, h) = ((min + max) * 0.5, (max - min) * 0.5);
    rect_solid(&[
        (h.x - e, h.z - e, min.y),
        (h.x, h.z, min.y + e),
        (h.x, h.z, max.y - e),
        (h.x - e, h.z - e, max.y),
    ])
    .moved(vec3(c.x, 0.0, c.z))
    .box_uv()
}

/// Surface of revolution about Y of a profile of `(radius, height)` points
/// running so that its outside is on the right when heights increase.
/// `u_total` is the texture width wrapped once around.
pub fn lathe(profile: &[(f32, f32)], segments: usize, u_total: f32) -> Soup {
    let mut soup = Soup::default();
    let lengths = arc_lengths(profile);
    let at = |i: usize, s: usize| -> Corner {
        let (r, y) = profile[i];
        // The last meridian uses the first one's position exactly.
        let a = TAU * (s % segments) as f32 / segments as f32;
        let u = u_total * s as f32 / segments as f32;
        corner(vec3(r * a.cos(), y, r * a.sin()), vec2(-u, -lengths[i]))
    };
    for i in 0..profile.len() - 1 {
        for s in 0..segments {
            soup.quad(at(i, s), at(i + 1, s), at(i + 1, s + 1), at(i, s + 1));
        }
    }
    soup
}

/// A stack of rectangles `(half x, half z, y)` with both ends capped.
pub fn rect_solid(rings: &[(f32, f32, f32)]) -> Soup {
    let mut soup = rect_bands(rings);
    for (top, &(hx, hz, y)) in [(false, &rings[0]), (true, &rings[rings.len() - 1])] {
        let q = [(-hx, -hz), (-hx, hz), (hx, hz), (hx, -hz)]
            .map(|(x, z)| corner(vec3(x, y, z), vec2(x, z)));
        if top {
            soup.quad(q[0], q[1], q[2], q[3]);
        } else {
            soup.quad(q[3], q[2], q[1], q[0]);
        }
    }
    soup
}

/// A rectangular ring (a cornice around the court, a slab with a hole): the
/// closed loop of `(half x, half z, y)` stations runs up on the outside.
pub fn rect_ring(stations: &[(f32, f32, f32)]) -> Soup {
    let mut closed = stations.to_vec();
    closed.push(stations[0]);
    rect_bands(&closed)
}

fn rect_bands(rings: &[(f32, f32, f32)]) -> Soup {
    let flat: Vec<(f32, f32)> = rings.iter().map(|r| (r.1, r.2)).collect();
    let lengths = arc_lengths(&flat);
    let mut soup = Soup::default();
    // Corner signs in the order of the lathe's increasing angle.
    let signs = [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
    for side in 0..4 {
        let at = |i: usize, k: usize| -> Corner {
            let (sx, sz): (f32, f32) = signs[(side + k) % 4];
            let (hx, hz, y) = rings[i];
            let p = vec3(sx * hx, y, sz * hz);
            let u = match side {
                0 => -p.z,
                1 => p.x,
                2 => p.z,
                _ => -p.x,
            };
            corner(p, vec2(u, -lengths[i]))
        };
        for i in 0..rings.len() - 1 {
            soup.quad(at(i, 0), at(i + 1, 0), at(i + 1, 1), at(i, 1));
        }
    }
    soup
}

/// A closed profile of `(radial, z)` points swept along the upper half of an
/// ellipse with half axes `a`, `b`, both ends capped. The profile runs
/// counter-clockwise with the radial axis to the right and z up.
pub fn arch_sweep(profile: &[(f32, f32)], a: f32, b: f32, segments: usize) -> Soup {
    let mut loop_pts = profile.to_vec();
    loop_pts.push(profile[0]);
    let lengths = arc_lengths(&loop_pts);
    let at = |s: usize, i: usize| -> Corner {
        let t = PI * s as f32 / segments as f32;
        let (rho, z) = loop_pts[i];
        // Exact ends, so the feet lie on the springing line.
        let (c, d) = if s == segments {
            (-1.0, 0.0)
        } else {
            (t.cos(), t.sin())
        };
        corner(
            vec3((a + rho) * c, (b + rho) * d, z),
            vec2(a.max(b) * t, lengths[i]),
        )
    };
    let mut soup = Soup::default();
    for s in 0..segments {
        for i in 0..loop_pts.len() - 1 {
            soup.quad(at(s, i), at(s, i + 1), at(s + 1, i + 1), at(s + 1, i));
        }
    }
    let mut soup = soup.flipped();
    // The caps stand on the imposts; their texture lies flat.
    let n = profile.len();
    let cap = |s: usize, i: usize| -> Corner {
        let c = at(s, i);
        corner(c.p, vec2(profile[i].0, profile[i].1))
    };
    for i in 1..n - 1 {
        soup.tri(cap(0, 0), cap(0, i), cap(0, i + 1));
        soup.tri(cap(segments, 0), cap(segments, i + 1), cap(segments, i));
    }
    soup
}

/// A round bar along a polyline, ends capped unless the polyline is closed.
pub fn tube(path: &[Vec3], radius: f32, segments: usize, closed: bool) -> Soup {
    let n = path.len();
    let tangent = |i: usize| -> Vec3 {
        let (a, b) = if closed {
            (path[(i + n - 1) % n], path[(i + 1) % n])
        } else {
            (path[i.saturating_sub(1)], path[(i + 1).min(n - 1)])
        };
        (b - a).normalize()
    };
    // Paths here are planar, so one fixed reference direction off the plane
    // keeps the section from twisting.
    let mut plane = Vec3::ZERO;
    for i in 0..n {
        plane += tangent(i).cross(tangent((i + 1) % n));
    }
    let reference = if plane.length() > 1.0e-3 {
        plane.normalize()
    } else {
        tangent(0).any_orthonormal_vector()
    };
    let mut along = 0.0;
    let mut rings: Vec<Vec<Corner>> = Vec::new();
    let count = if closed { n + 1 } else { n };
    for k in 0..count {
        let i = k % n;
        if k > 0 {
            along += path[i].distance(path[(k - 1) % n]);
        }
        let t = tangent(i);
        let side = reference.cross(t).normalize();
        let up = t.cross(side);
        rings.push(
            (0..=segments)
                .map(|s| {
                    let a = TAU * (s % segments) as f32 / segments as f32;
                    let u = TAU * radius * s as f32 / segments as f32;
                    corner(
                        path[i] + (side * a.cos() + up * a.sin()) * radius,
                        vec2(u, along),
                    )
                })
                .collect(),
        );
    }
    let mut soup = Soup::default();
    for k in 0..count - 1 {
        for s in 0..segments {
            soup.quad(
                rings[k][s],
                rings[k][s + 1],
                rings[k + 1][s + 1],
                rings[k + 1][s],
            );
        }
    }
    if !closed {
        for (ring, c, flip) in [
            (&rings[0], path[0], true),
            (&rings[count - 1], path[n - 1], false),
        ] {
            for s in 0..segments {
                let mid = corner(c, vec2(0.0, 0.0));
                let (mut a, mut b) = (ring[s], ring[s + 1]);
                let (da, db) = (a.p - c, b.p - c);
                a.uv = vec2(da.dot(Vec3::ONE), da.x - da.z);
                b.uv = vec2(db.dot(Vec3::ONE), db.x - db.z);
                if flip {
                    soup.tri(mid, b, a);
                } else {
                    soup.tri(mid, a, b);
                }
            }
        }
    }
    soup
}

/// An open grid of `nu` x `nv` cells over the unit square; the front is where
/// du x dv points.
pub fn grid(nu: usize, nv: usize, f: impl Fn(f32, f32) -> (Vec3, Vec2)) -> Soup {
    let at = |i: usize, j: usize| -> Corner {
        let (p, uv) = f(i as f32 / nu as f32, j as f32 / nv as f32);
        corner(p, uv)
    };
    let points: Vec<Vec<Corner>> = (0..=nu)
        .map(|i| (0..=nv).map(|j| at(i, j)).collect())
        .collect();
    let mut soup = Soup::default();
    for i in 0..nu {
        for j in 0..nv {
            soup.quad(
                points[i][j],
                points[i + 1][j],
                points[i + 1][j + 1],
                points[i][j + 1],
            );
        }
    }
    soup
}

/// Cumulative lengths along a 2D polyline.
pub fn arc_lengths(points: &[(f32, f32)]) -> Vec<f32> {
    let mut sum = 0.0;
    let mut out = vec![0.0];
    for w in points.windows(2) {
        sum += vec2(w[1].0 - w[0].0, w[1].1 - w[0].1).length();
        out.push(sum);
    }
    out
}

/// Appends a convex half-round (torus) from the last height up by `h`,
/// standing on radius `r`.
pub fn torus(profile: &mut Vec<(f32, f32)>, r: f32, h: f32, steps: usize) {
    let y0 = profile.last().map_or(0.0, |p| p.1);
    for i in 0..=steps {
        let t = PI * i as f32 / steps as f32;
        profile.push((r + 0.5 * h * t.sin(), y0 + 0.5 * h * (1.0 - t.cos())));
    }
}

/// Appends a concave curve (scotia) from the last point to `(r1, y1)`.
pub fn scotia(profile: &mut Vec<(f32, f32)>, r1: f32, y1: f32, depth: f32, steps: usize) {
    let (r0, y0) = profile.last().copied().unwrap_or((r1, y1));
    for i in 1..=steps {
        let t = i as f32 / steps as f32;
        let r = r0 + (r1 - r0) * t - depth * (PI * t).sin();
        profile.push((r, y0 + (y1 - y0) * t));
    }
}

/// Appends a double curve (cyma) from the last point to `(r1, y1)`, starting
/// and ending upright.
pub fn cyma(profile: &mut Vec<(f32, f32)>, r1: f32, y1: f32, steps: usize) {
    let (r0, y0) = profile.last().copied().unwrap_or((r1, y1));
    for i in 1..=steps {
        let t = i as f32 / steps as f32;
        let e = t * t * (3.0 - 2.0 * t);
        profile.push((r0 + (r1 - r0) * e, y0 + (y1 - y0) * t));
    }
}
