//! Pieces that a scene consists of, and where they are.

use bevy::prelude::*;

use super::finish::Finish;

/// The form of a piece, around its centre. Metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Lengths of the sides.
    Box(Vec3),
    /// Along y.
    Cylinder { radius: f32, height: f32 },
    /// Of this radius.
    Sphere(f32),
    /// A rectangle across z, seen from both sides, of which an alpha mask cuts something out.
    Card(Vec2),
}

impl Shape {
    /// Half the sides of the box around it.
    pub fn half(self) -> Vec3 {
        match self {
            Self::Box(size) => 0.5 * size,
            Self::Cylinder { radius, height } => Vec3::new(radius, 0.5 * height, radius),
            Self::Sphere(radius) => Vec3::splat(radius),
            Self::Card(size) => 0.5 * size.extend(0.0),
        }
    }
}

/// A mesh with its material, in the building's own space: y is up, the floor is at 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub shape: Shape,
    /// Its centre.
    pub at: Vec3,
    pub turn: Quat,
    pub finish: Finish,
}

impl Piece {
    pub fn new(shape: Shape, at: Vec3, finish: Finish) -> Self {
        Self {
            shape,
            at,
            turn: Quat::IDENTITY,
            finish,
        }
    }

    /// A box between two corners.
    pub fn slab(min: Vec3, max: Vec3, finish: Finish) -> Self {
        Self::new(Shape::Box(max - min), 0.5 * (min + max), finish)
    }

    pub fn turned(self, turn: Quat) -> Self {
        Self { turn, ..self }
    }

    /// Distance of a point from the box around the piece, metres; 0 inside.
    pub fn distance(&self, point: Vec3) -> f32 {
        let local = self.turn.inverse() * (point - self.at);
        (local.abs() - self.shape.half()).max(Vec3::ZERO).length()
    }

    /// How far a ray goes until it hits the box around the piece, in lengths of `direction`.
    pub fn hit(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let back = self.turn.inverse();
        let (o, d) = (back * (origin - self.at), back * direction);
        let half = self.shape.half();
        let (mut near, mut far) = (0.0f32, f32::INFINITY);
        for axis in 0..3 {
            if d[axis].abs() < 1e-9 {
                if o[axis].abs() > half[axis] {
                    return None;
                }
                continue;
            }
            let a = (-half[axis] - o[axis]) / d[axis];
            let b = (half[axis] - o[axis]) / d[axis];
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far).then_some(near)
    }

    /// Corners of the box around it.
    pub fn corners(&self) -> [Vec3; 8] {
        let half = self.shape.half();
        std::array::from_fn(|i| {
            let sign = |bit: usize| if (i >> bit) & 1 == 0 { -1.0 } else { 1.0 };
            self.at + self.turn * (half * Vec3::new(sign(0), sign(1), sign(2)))
        })
    }
}
