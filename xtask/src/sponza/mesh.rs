//! Triangle soups, and their conversion to indexed meshes with normals.
//!
//! Builders only emit positioned, textured triangles. Normals come afterwards
//! from one crease-angle rule, so a moulding's torus is smooth while its fillets
//! stay sharp without each builder having to think about it.

use glam::{Affine3A, Vec2, Vec3, vec2};

/// One corner of a triangle. Texture coordinates are in metres until the
/// scene divides them by the material's tile size.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Position in metres.
    pub p: Vec3,
    /// Texture coordinate.
    pub uv: Vec2,
}

/// Shorthand for a [`Corner`].
pub fn corner(p: Vec3, uv: Vec2) -> Corner {
    Corner { p, uv }
}

/// Loose triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default)]
pub struct Soup {
    /// The triangles.
    pub tris: Vec<[Corner; 3]>,
}

impl Soup {
    /// Adds a triangle.
    pub fn tri(&mut self, a: Corner, b: Corner, c: Corner) {
        self.tris.push([a, b, c]);
    }

    /// Adds a quad as two triangles, split along its shorter diagonal.
    pub fn quad(&mut self, a: Corner, b: Corner, c: Corner, d: Corner) {
        if a.p.distance_squared(c.p) <= b.p.distance_squared(d.p) {
            self.tri(a, b, c);
            self.tri(a, c, d);
        } else {
            self.tri(a, b, d);
            self.tri(b, c, d);
        }
    }

    /// Triangulates the band between two polylines that run the same way;
    /// their ends coincide in direction but they may have different counts.
    /// The front is to the side where `left` lies left of `right`, seen with
    /// the polylines running up.
    pub fn zip(&mut self, left: &[Corner], right: &[Corner]) {
        let (mut i, mut j) = (0, 0);
        while i + 1 < left.len() || j + 1 < right.len() {
            let step_left = if i + 1 >= left.len() {
                false
            } else if j + 1 >= right.len() {
                true
            } else {
                left[i + 1].p.distance_squared(right[j].p)
                    <= right[j + 1].p.distance_squared(left[i].p)
            };
            if step_left {
                self.tri(left[i], right[j], left[i + 1]);
                i += 1;
            } else {
                self.tri(left[i], right[j], right[j + 1]);
                j += 1;
            }
        }
    }

    /// Adds another soup's triangles.
    pub fn add(&mut self, other: Soup) {
        self.tris.extend(other.tris);
    }

    /// The soup under a proper (not mirroring) transform.
    pub fn transformed(mut self, m: Affine3A) -> Self {
        for c in self.tris.iter_mut().flatten() {
            c.p = m.transform_point3(c.p);
        }
        self
    }

    /// The soup moved by `t`.
    pub fn moved(self, t: Vec3) -> Self {
        self.transformed(Affine3A::from_translation(t))
    }

    /// Mirrored in x, winding kept outward.
    pub fn mirrored_x(mut self) -> Self {
        for t in &mut self.tris {
            for c in t.iter_mut() {
                c.p.x = -c.p.x;
            }
            t.swap(1, 2);
        }
        self
    }

    /// The same triangles facing the other way.
    pub fn flipped(mut self) -> Self {
        for t in &mut self.tris {
            t.swap(1, 2);
        }
        self
    }

    /// Replaces the texture coordinates by a projection along each triangle's
    /// dominant axis, so that masonry courses run level and in step around
    /// corners.
    pub fn box_uv(mut self) -> Self {
        for t in &mut self.tris {
            let n = (t[1].p - t[0].p).cross(t[2].p - t[0].p);
            let a = n.abs();
            for c in t.iter_mut() {
                let p = c.p;
                c.uv = if a.y >= a.x && a.y >= a.z {
                    vec2(p.x, p.z * n.y.signum())
                } else if a.x >= a.z {
                    vec2(-p.z * n.x.signum(), -p.y)
                } else {
                    vec2(p.x * n.z.signum(), -p.y)
                };
            }
        }
        self
    }

    /// Replaces the texture coordinates so that u runs along `axis` on every
    /// face: the grain of a timber follows its length.
    pub fn grain_uv(mut self, axis: Vec3) -> Self {
        let side = axis.any_orthonormal_vector();
        let other = axis.cross(side);
        for t in &mut self.tris {
            let n = (t[1].p - t[0].p).cross(t[2].p - t[0].p);
            let (ns, no) = (n.dot(side).abs(), n.dot(other).abs());
            let end_grain = n.dot(axis).abs() > ns.max(no);
            for c in t.iter_mut() {
                let across = if no >= ns {
                    c.p.dot(side)
                } else {
                    c.p.dot(other)
                };
                let along = if end_grain {
                    c.p.dot(side + other)
                } else {
                    c.p.dot(axis)
                };
                c.uv = vec2(along, across);
            }
        }
        self
    }

    /// Shifts all texture coordinates.
    pub fn uv_moved(mut self, d: Vec2) -> Self {
        for c in self.tris.iter_mut().flatten() {
            c.uv += d;
        }
        self
    }

    /// Welds the soup into an indexed mesh. Faces meeting at less than
    /// `crease_deg` share smooth normals; slivers without area are dropped.
    pub fn finish(self, crease_deg: f32) -> Mesh {
        let tris: Vec<[Corner; 3]> = self
            .tris
            .into_iter()
            .filter(|t| (t[1].p - t[0].p).cross(t[2].p - t[0].p).length() > 2.0e-8)
            .collect();
        let face: Vec<Vec3> = tris
            .iter()
            .map(|t| (t[1].p - t[0].p).cross(t[2].p - t[0].p).normalize())
            .collect();

        // Corners sorted by quantised position: each run of equal keys is a
        // point of the surface.
        let mut order: Vec<([i64; 3], u32)> = Vec::with_capacity(tris.len() * 3);
        for (i, t) in tris.iter().enumerate() {
            for (k, c) in t.iter().enumerate() {
                order.push((position_key(c.p), (i * 3 + k) as u32));
            }
        }
        order.sort_unstable();

        let cos_crease = crease_deg.to_radians().cos();
        let mut mesh = Mesh {
            indices: vec![0; tris.len() * 3],
            ..Mesh::default()
        };
        let mut start = 0;
        while start < order.len() {
            let mut end = start + 1;
            while end < order.len() && order[end].0 == order[start].0 {
                end += 1;
            }
            let group = &order[start..end];
            let first_vertex = mesh.positions.len();
            let p = corner_of(&tris, group[0].1).p;
            for &(_, ci) in group {
                let own = face[ci as usize / 3];
                let mut n = Vec3::ZERO;
                for &(_, cj) in group {
                    let other = face[cj as usize / 3];
                    if own.dot(other) >= cos_crease {
                        n += other * corner_angle(&tris, cj);
                    }
                }
                let n = n.normalize_or(own);
                let uv = corner_of(&tris, ci).uv;
                let found = (first_vertex..mesh.positions.len()).find(|&v| {
                    mesh.normals[v].distance_squared(n) < 1.0e-6
                        && mesh.uvs[v].distance_squared(uv) < 1.0e-9
                });
                let v = found.unwrap_or_else(|| {
                    mesh.positions.push(p);
                    mesh.normals.push(n);
                    mesh.uvs.push(uv);
                    mesh.positions.len() - 1
                });
                mesh.indices[ci as usize] = v as u32;
            }
            start = end;
        }
        mesh
    }
}

/// Positions closer than this key's step (20 µm) are one point.
pub fn position_key(p: Vec3) -> [i64; 3] {
    [p.x, p.y, p.z].map(|v| (f64::from(v) * 50_000.0).round() as i64)
}

fn corner_of(tris: &[[Corner; 3]], c: u32) -> Corner {
    tris[c as usize / 3][c as usize % 3]
}

fn corner_angle(tris: &[[Corner; 3]], c: u32) -> f32 {
    let t = &tris[c as usize / 3];
    let k = c as usize % 3;
    let a = t[(k + 1) % 3].p - t[k].p;
    let b = t[(k + 2) % 3].p - t[k].p;
    a.angle_between(b)
}

/// An indexed triangle mesh, ready to be written.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions in metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates.
    pub uvs: Vec<Vec2>,
    /// Triangle list.
    pub indices: Vec<u32>,
}

#[cfg(test)]
impl Mesh {
    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.indices.len() / 3
    }
}
