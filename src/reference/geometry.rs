//! Triangles, and rays through them.

use std::ops::{Add, Mul};

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
    /// Which of the scene's sets of render layers it has.
    pub layers: u32,
}

impl Facing {
    /// The same for corners that run the other way round.
    pub fn turned(self) -> Self {
        Self {
            front: self.back,
            back: self.front,
            ..self
        }
    }
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

    /// Whether it is met from `direction` at all.
    pub fn is_met(&self, direction: Vec3) -> bool {
        if self.cross().dot(direction) < 0.0 {
            self.facing.front
        } else {
            self.facing.back
        }
    }
}

/// Linear interpolation between the corners of a triangle; `at` are the weights of the second and the third.
pub(super) fn mix<T>([a, b, c]: [T; 3], at: Vec2) -> T
where
    T: Mul<f32, Output = T> + Add<Output = T>,
{
    a * (1.0 - at.x - at.y) + b * at.x + c * at.y
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
    /// Sets of render layers that do not stand in its way, a bit each.
    pub passes: u64,
}

impl Segment {
    fn passes(&self, facing: Facing) -> bool {
        // Beyond 64 different sets of layers, all stand in the way.
        self.passes.checked_shr(facing.layers).unwrap_or(0) & 1 != 0
    }
}

/// All faces of the scene.
pub(super) struct Geometry {
    pub faces: Vec<Face>,
    /// What light paths meet.
    lit: Tree,
    /// What the camera meets, where that is more.
    seen: Option<Tree>,
}

/// Faces in a bounding volume hierarchy.
struct Tree {
    bvh: Option<Bvh2>,
    /// Indices of faces and what rays ask of them, in the order of the hierarchy.
    corners: Vec<Corners>,
}

/// A corner of a face and the two edges from it.
#[derive(Clone, Copy)]
struct Corners {
    first: Vec3A,
    edges: [Vec3A; 2],
    facing: Facing,
    face: u32,
}

impl Geometry {
    pub fn new(faces: Vec<Face>) -> Self {
        let tree = |keep: &dyn Fn(&Face) -> bool| {
            let kept = |(_, face): &(usize, &Face)| keep(face);
            Tree::new(faces.iter().enumerate().filter(kept))
        };
        let differs = faces.iter().any(|face| face.facing.camera_only);
        Self {
            lit: tree(&|face| !face.facing.camera_only),
            seen: differs.then(|| tree(&|_| true)),
            faces,
        }
    }

    /// Metres from the origin to the farthest corner.
    pub fn radius(&self) -> f32 {
        let corners = self.faces.iter().flat_map(|face| face.corners);
        corners.fold(0.0, |r, p| r.max(p.length()))
    }

    fn tree(&self, segment: &Segment) -> &Tree {
        match &self.seen {
            Some(seen) if segment.from_camera => seen,
            _ => &self.lit,
        }
    }

    /// The nearest face along a segment; `opaque` decides about the points of masked faces.
    pub fn trace(&self, segment: &Segment, opaque: impl Fn(&Hit) -> bool) -> Option<Hit> {
        self.tree(segment).trace(segment, opaque)
    }

    /// Whether nothing stands in the way of a segment.
    pub fn is_free(&self, segment: &Segment, opaque: impl Fn(&Hit) -> bool) -> bool {
        self.tree(segment).is_free(segment, opaque)
    }
}

impl Tree {
    fn new<'a>(faces: impl Iterator<Item = (usize, &'a Face)>) -> Self {
        let mut corners: Vec<_> = faces
            .map(|(index, face)| {
                let [a, b, c] = face.corners.map(Vec3A::from);
                Corners {
                    first: a,
                    edges: [b - a, c - a],
                    facing: face.facing,
                    face: index as u32,
                }
            })
            .collect();
        // The crate's vectors are of another version of glam.
        let triangles: Vec<_> = corners
            .iter()
            .map(|c| Triangle {
                v0: c.first.to_array().into(),
                v1: (c.first + c.edges[0]).to_array().into(),
                v2: (c.first + c.edges[1]).to_array().into(),
            })
            .collect();
        let bvh = (!triangles.is_empty()).then(|| {
            build_bvh2_from_tris(
                &triangles,
                BvhBuildParams::slow_build(),
                &mut Default::default(),
            )
        });
        if let Some(bvh) = &bvh {
            // A face may stand in several leaves.
            let ordered = bvh.primitive_indices.iter();
            corners = ordered.map(|i| corners[*i as usize]).collect();
        }
        Self { bvh, corners }
    }

    fn trace(&self, segment: &Segment, opaque: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let bvh = self.bvh.as_ref()?;
        let mut hit = RayHit::none();
        let mut barycentric = Vec2::ZERO;
        bvh.ray_traverse(ray(segment), &mut hit, |ray, primitive| {
            match self.meet(segment, ray.tmax, primitive, &opaque) {
                Some((t, uv)) => {
                    barycentric = uv;
                    t
                }
                None => f32::INFINITY,
            }
        })
        .then(|| Hit {
            face: self.corners[hit.primitive_id as usize].face,
            distance: hit.t,
            barycentric,
        })
    }

    fn is_free(&self, segment: &Segment, opaque: impl Fn(&Hit) -> bool) -> bool {
        self.bvh.as_ref().is_none_or(|bvh| {
            bvh.ray_traverse_miss(ray(segment), |ray, primitive| {
                self.meet(segment, ray.tmax, primitive, &opaque)
                    .map_or(f32::INFINITY, |(t, _)| t)
            })
        })
    }

    /// Distance, below `farthest`, and barycentric coordinates of the point in which a segment meets a
    /// triangle (Möller and Trumbore 1997), if it is there for such a segment.
    #[inline(always)]
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
            face,
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
        if !there || determinant == 0.0 || segment.passes(*facing) {
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
                face: *face,
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
