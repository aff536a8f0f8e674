//! Boxes, and boxes as a directional light sees them.

use bevy::{
    math::{Mat4, Vec3, Vec3A, bounding::Aabb3d},
    transform::components::Transform,
};

/// Whether two boxes touch.
pub(crate) fn overlaps(a: &Aabb3d, b: &Aabb3d) -> bool {
    a.min.cmple(b.max).all() && a.max.cmpge(b.min).all()
}

/// Corners of a box, metres.
pub(crate) fn corners(bounds: &Aabb3d) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let pick = |axis: usize| match (i >> axis) & 1 {
            0 => bounds.min[axis],
            _ => bounds.max[axis],
        };
        Vec3::new(pick(0), pick(1), pick(2))
    })
}

/// A direction that is not along `direction`.
pub(crate) fn any_up(direction: Vec3) -> Vec3 {
    if direction.y.abs() > 0.9 {
        Vec3::Z
    } else {
        Vec3::Y
    }
}

/// Bounds of a box as a light that travels in some direction sees it: the view looks along -z.
pub(crate) struct Beam(Mat4);

impl Beam {
    pub fn new(direction: Vec3) -> Self {
        let view = Transform::default().looking_to(direction, any_up(direction));
        Self(view.to_matrix().inverse())
    }

    pub fn bounds(&self, aabb: &Aabb3d) -> Aabb3d {
        let points = corners(aabb).map(|p| Vec3A::from(self.0.transform_point3(p)));
        Aabb3d::from_point_cloud(bevy::math::Isometry3d::IDENTITY, points.into_iter())
    }

    /// Whether what has the bounds `caster` may stand between the light and `lit`.
    pub fn casts(caster: &Aabb3d, lit: &Aabb3d) -> bool {
        let beside = |axis| caster.min[axis] > lit.max[axis] || caster.max[axis] < lit.min[axis];
        !beside(0) && !beside(1) && caster.max.z >= lit.min.z
    }
}
