//! Triangles, and rays through them.

use bevy::math::{Vec2, Vec3, Vec3A};
use obvhs::{
    BvhBuildParams,
    bvh2::{Bvh2, builder::build_bvh2_from_tris},
    ray::{Ray, RayHit},
    triangle::Triangle,
};

/// Which rays meet a triangle, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Facing {
    /// Met from where its corners run counter-clockwise.
    pub front: bool,
    /// Met from the other side.
    pub back: bool,
    /// Met by rays of the camera only, see [`NotGiCaster`](crate::NotGiCaster).
    pub camera_only: bool,
    /// Has an alpha mask, which decides for each point.
    pub masked: bool,
}

/// A triangle in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// Corners, metres.
    pub corners: [Vec3; 3],
    /// Normals of the corners.
    pub normals: [Vec3; 3],
    /// Two sets of texture coordinates of the corners.
    pub uvs: [[Vec2; 3]; 2],
    /// Tangents of the corners, with the bitangent's sign.
    pub tangents: [(Vec3, f32); 3],
    /// Linear colours of the corners, with alpha.
    pub colors: [[f32; 4]; 3],
    /// Index of the material.
    pub material: u32,
    pub facing: Facing,
}

impl Face {
    /// Twice the area along the normal.
    pub fn cross(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    pub fn area(&self) -> f32 {
        0.5 * self.cross().length()
    }
}

/// Where a ray meets a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Index of the face.
    pub face: u32,
    /// Distance, metres.
    pub distance: f32,
    /// Weights of the second and the third corner.
    pub barycentric: Vec2,
}

/// Something along which light travels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// Metres.
    pub length: f32,
    pub from_camera: bool,
}

/// All faces of the scene in a bounding volume hierarchy.
pub(super) struct Geometry {
    pub faces: Vec<Face>,
    bvh: Option<Bvh2>,
    /// In the order of the hierarchy.
    order: Vec<u32>,
    corners: Vec<Corners>,
}

/// A corner and the two edges from it, in the order of the hierarchy.
struct Corners {
    first: Vec3A,
    edges: [Vec3A; 2],
    facing: Facing,
}

impl Geometry {
    pub fn new(faces: Vec<Face>) -> Self {
        // The crate's vectors are of another version of glam.
        let triangle = |face: &Face| {
            let [v0, v1, v2] = face.corners.map(|p| p.to_array().into());
            Triangle { v0, v1, v2 }
        };
        let bvh = (!faces.is_empty()).then(|| {
            let triangles: Vec<_> = faces.iter().map(triangle).collect();
            build_bvh2_from_tris(
                &triangles,
                BvhBuildParams::slow_build(),
                &mut Default::default(),
            )
        });
        let order = bvh
            .as_ref()
            .map_or(Vec::new(), |bvh| bvh.primitive_indices.clone());
        let corners = order
            .iter()
            .map(|i| {
                let face = &faces[*i as usize];
                let [a, b, c] = face.corners.map(Vec3A::from);
                Corners {
                    first: a,
                    edges: [b - a, c - a],
                    facing: face.facing,
                }
            })
            .collect();
        Self {
            faces,
            bvh,
            order,
            corners,
        }
    }

    /// The nearest face along a segment; `opaque` decides about the points of masked faces.
    pub fn trace(&self, segment: &Segment, opaque: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let bvh = self.bvh.as_ref()?;
        let ray = ray(segment);
        let mut hit = RayHit::none();
        let mut barycentric = Vec2::ZERO;
        bvh.ray_traverse(ray, &mut hit, |ray, primitive| {
            match self.meet(segment, ray.tmax, primitive, &opaque) {
                Some((t, uv)) => {
                    barycentric = uv;
                    t
                }
                None => f32::INFINITY,
            }
        })
        .then(|| Hit {
            face: self.order[hit.primitive_id as usize],
            distance: hit.t,
            barycentric,
        })
    }

    /// Whether nothing stands in the way of a segment.
    pub fn is_free(&self, segment: &Segment, opaque: impl Fn(&Hit) -> bool) -> bool {
        self.bvh.as_ref().is_none_or(|bvh| {
            bvh.ray_traverse_miss(ray(segment), |ray, primitive| {
                self.meet(segment, ray.tmax, primitive, &opaque)
                    .map_or(f32::INFINITY, |(t, _)| t)
            })
        })
    }

    /// Distance, below `farthest`, and barycentric coordinates of the point in which a segment meets a
    /// triangle (Möller and Trumbore 1997), if it is there for such a segment.
    #[inline]
    fn meet(
        &self,
        segment: &Segment,
        farthest: f32,
        primitive: usize,
        opaque: &impl Fn(&Hit) -> bool,
    ) -> Option<(f32, Vec2)> {
        let Corners {
            first,
            edges: [e1, e2],
            facing,
        } = &self.corners[primitive];
        let direction = Vec3A::from(segment.direction);
        let p = direction.cross(*e2);
        // Positive where the front is met.
        let determinant = e1.dot(p);
        let there = if determinant > 0.0 {
            facing.front
        } else {
            facing.back
        };
        if !there || determinant == 0.0 || (facing.camera_only && !segment.from_camera) {
            return None;
        }
        let inverse = 1.0 / determinant;
        let to = Vec3A::from(segment.origin) - *first;
        let u = to.dot(p) * inverse;
        if !(0.0..=1.0).contains(&u) {
            return None;
        }
        let q = to.cross(*e1);
        let v = direction.dot(q) * inverse;
        if v < 0.0 || u + v > 1.0 {
            return None;
        }
        let t = e2.dot(q) * inverse;
        if !(t > 0.0 && t < farthest) {
            return None;
        }
        let barycentric = Vec2::new(u, v);
        if facing.masked {
            let hit = Hit {
                face: self.order[primitive],
                distance: t,
                barycentric,
            };
            if !opaque(&hit) {
                return None;
            }
        }
        Some((t, barycentric))
    }
}

fn ray(segment: &Segment) -> Ray {
    Ray::new(
        segment.origin.to_array().into(),
        segment.direction.to_array().into(),
        0.0,
        segment.length,
    )
}

/// A point just off a surface, on the side of `normal`, so that a ray from it does not meet the surface
/// again (Wächter and Binder 2019, "A fast and robust method for avoiding self-intersection").
pub(super) fn off_surface(p: Vec3, normal: Vec3) -> Vec3 {
    const ORIGIN: f32 = 1.0 / 32.0;
    const FLOAT: f32 = 1.0 / 65536.0;
    const INTEGER: f32 = 256.0;
    let offset = |p: f32, n: f32| {
        if p.abs() < ORIGIN {
            return p + FLOAT * n;
        }
        let steps = (INTEGER * n) as i32;
        f32::from_bits((p.to_bits() as i32 + if p < 0.0 { -steps } else { steps }) as u32)
    };
    Vec3::new(
        offset(p.x, normal.x),
        offset(p.y, normal.y),
        offset(p.z, normal.z),
    )
}
