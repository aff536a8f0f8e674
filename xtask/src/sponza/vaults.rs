//! Groin and barrel vaults and their transverse ribs, as closed solids.

use std::f32::consts::PI;

use glam::{Vec3, vec2, vec3};

use super::arches::{Opening, Slab, pierced_wall};
use super::mesh::{Corner, Soup, corner};

/// How far the vaults are let into the walls and ribs around them.
const SOCKET: f32 = 0.04;

/// A vault over the rectangle `half_x` x `half_z`, springing at y = 0, flat on
/// top at `top`.
pub struct Vault {
    /// Half span along x.
    pub half_x: f32,
    /// Half span along z.
    pub half_z: f32,
    /// Height of the crown.
    pub rise: f32,
    /// Top of the fill over the vault.
    pub top: f32,
}

const ARC: usize = 14;

/// Two crossing barrels: each of the four webs is a fan of straight courses
/// between an arch at the edge of the bay and the groins.
pub fn groin(v: &Vault) -> Soup {
    let (a, b) = (v.half_x, v.half_z);
    let mut soup = Soup::default();
    // Station k of the section: position across in -1..1, and height.
    let station = |k: usize| -> (f32, f32) {
        match k {
            0 => (-1.0, 0.0),
            ARC => (1.0, 0.0),
            _ => {
                let t = PI * (k as f32 / ARC as f32 - 0.5);
                (t.sin(), v.rise * t.cos())
            }
        }
    };
    let arc_len = |half: f32, k: usize| -> f32 {
        (0..k)
            .map(|i| {
                let ((s0, h0), (s1, h1)) = (station(i), station(i + 1));
                vec2((s1 - s0) * half, h1 - h0).length()
            })
            .sum()
    };
    // `along` is the axis of the barrel: sign and whether it is z.
    for (sign, z_axis) in [(1.0, true), (-1.0, true), (1.0, false), (-1.0, false)] {
        let (half_across, half_along) = if z_axis { (a, b) } else { (b, a) };
        let make = |k: usize, along: f32| -> Corner {
            let (s, h) = station(k);
            let (across, along) = (s * half_across, sign * along);
            let p = if z_axis {
                vec3(across, h, along)
            } else {
                vec3(along, h, across)
            };
            corner(p, vec2(along, arc_len(half_across, k)))
        };
        // Seen from below.
        let front = (sign > 0.0) != z_axis;
        for k in 0..ARC {
            let groin = [
                station(k).0.abs() * half_along,
                station(k + 1).0.abs() * half_along,
            ];
            let mid = groin.map(|g| 0.5 * (g + half_along));
            let rows = [groin, mid, [half_along; 2], [half_along + SOCKET; 2]];
            for w in rows.windows(2) {
                let q = [
                    make(k, w[0][0]),
                    make(k, w[1][0]),
                    make(k + 1, w[1][1]),
                    make(k + 1, w[0][1]),
                ];
                if front {
                    soup.quad(q[0], q[1], q[2], q[3]);
                } else {
                    soup.quad(q[3], q[2], q[1], q[0]);
                }
            }
        }
    }
    let (ea, eb) = (a + SOCKET, b + SOCKET);
    // Feet at the four corners, where both sections have come down to 0.
    for (sx, sz) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let q = [(a, b), (ea, b), (ea, eb), (a, eb)]
            .map(|(x, z)| corner(vec3(sx * x, 0.0, sz * z), vec2(x, z)));
        if sx * sz > 0.0 {
            soup.quad(q[0], q[1], q[2], q[3]);
        } else {
            soup.quad(q[3], q[2], q[1], q[0]);
        }
    }
    // Outer sides and top of the fill.
    for (sign, z_axis) in [(1.0, true), (-1.0, true), (1.0, false), (-1.0, false)] {
        let (half_across, edge, end) = if z_axis { (a, eb, ea) } else { (b, ea, eb) };
        let make = |s: f32, y: f32| -> Corner {
            let p = if z_axis {
                vec3(s, y, sign * edge)
            } else {
                vec3(sign * edge, y, s)
            };
            corner(p, vec2(s, -y))
        };
        let mut low = vec![make(-end, 0.0)];
        for k in 0..=ARC {
            let (s, h) = station(k);
            low.push(make(s * half_across, h));
        }
        low.push(make(end, 0.0));
        let high = [make(-end, v.top), make(end, v.top)];
        if (sign > 0.0) == z_axis {
            soup.zip(&high, &low);
        } else {
            soup.zip(&low, &high);
        }
    }
    let q = [(-ea, -eb), (-ea, eb), (ea, eb), (ea, -eb)]
        .map(|(x, z)| corner(vec3(x, v.top, z), vec2(x, z)));
    soup.quad(q[0], q[1], q[2], q[3]);
    soup
}

/// A barrel running along z, as one opening through a thick wall.
pub fn barrel(v: &Vault) -> Soup {
    let slab = Slab {
        min: vec3(-v.half_x - SOCKET, 0.0, -v.half_z - SOCKET),
        max: vec3(v.half_x + SOCKET, v.top, v.half_z + SOCKET),
    };
    let opening = Opening {
        x: 0.0,
        half: v.half_x,
        rise: v.rise,
        sill: 0.0,
        spring: 0.0,
    };
    pierced_wall(slab, &[opening], 24)
}

/// A transverse rib across a span of 2 * `half`, along x, springing at y = 0.
pub fn rib(half: f32, rise: f32, half_thick: f32, top: f32) -> Soup {
    let end = half + 0.16;
    let slab = Slab {
        min: Vec3::new(-end, 0.0, -half_thick),
        max: Vec3::new(end, top, half_thick),
    };
    let opening = Opening {
        x: 0.0,
        half,
        rise,
        sill: 0.0,
        spring: 0.0,
    };
    pierced_wall(slab, &[opening], 24)
}
