//! A building while it is drawn.

use bevy::prelude::*;

use super::{
    carve::{Part, Space, carve},
    finish::{Finish, Surface},
    generator::Generator,
    lamps::Lamp,
    solid::{Piece, Shape},
};

/// Air through a wall or a ceiling.
#[derive(Clone, Copy, Debug)]
pub struct Opening {
    pub air: Space,
    /// The space that it leads out of.
    pub space: usize,
    /// The space that it leads into; `None` is the outside.
    pub beyond: Option<usize>,
    /// Unit vector through it, out of the first space.
    pub outward: Vec3,
}

impl Opening {
    /// Square metres.
    pub fn area(&self) -> f32 {
        let size = self.air.size();
        let across = Vec3::ONE - self.outward.abs();
        // The side along the way through counts as 1.
        (size * across + self.outward.abs()).element_product()
    }
}

/// A building: spaces with openings between them, and what stands in them. The floor is at a height of 0.
#[derive(Clone, Debug, Default)]
pub struct Draft {
    /// The first is the one that the camera stands in.
    pub spaces: Vec<Space>,
    pub openings: Vec<Opening>,
    /// Passages between spaces that touch or overlap: their numbers, and square metres.
    pub passages: Vec<(usize, usize, f32)>,
    /// Thickness of the outer walls, floors and ceilings, metres.
    pub wall: f32,
    /// What stands in it, lamps included.
    pub pieces: Vec<Piece>,
    pub lamps: Vec<Lamp>,
    /// Lumens of what shines, by the space that it is in.
    pub shining: Vec<(usize, f32)>,
    /// Floor that nothing may be put onto.
    pub taken: Vec<Rect>,
    /// Whether all spaces have a ceiling.
    pub has_roof: bool,
}

/// What the parts of a building are made of.
#[derive(Clone, Copy, Debug)]
pub struct Finishes {
    pub floor: Finish,
    pub wall: Finish,
    pub ceiling: Finish,
}

impl Finishes {
    pub fn draw(g: &mut Generator) -> Self {
        use Surface::{Brick, Concrete, Painted, Plaster, Stone, Tiles, Wood};
        Self {
            floor: Finish::draw_of(g, &[Wood, Concrete, Tiles, Stone, Wood]),
            wall: Finish::draw_of(g, &[Plaster, Plaster, Plaster, Painted, Brick, Concrete]),
            ceiling: Finish::draw_of(g, &[Plaster, Plaster, Concrete, Wood]),
        }
    }

    fn of(&self, part: Part) -> Finish {
        match part {
            Part::Floor => self.floor,
            Part::Wall => self.wall,
            Part::Ceiling => self.ceiling,
        }
    }

    /// Luminance of the albedo, over all.
    pub fn albedo(&self) -> f32 {
        0.5 * self.wall.albedo() + 0.25 * (self.floor.albedo() + self.ceiling.albedo())
    }
}

impl Draft {
    /// Nothing yet, with walls of some thickness.
    pub fn new(g: &mut Generator) -> Self {
        Self {
            wall: g.log_range(0.05, 0.5),
            has_roof: true,
            ..default()
        }
    }

    /// A thickness of inner walls: at least 0.05 m, at most that of the outer ones.
    pub fn inner_wall(&self, g: &mut Generator) -> f32 {
        g.log_range(0.05, self.wall.max(0.051))
    }

    pub fn add(&mut self, shape: Shape, at: Vec3, finish: Finish) {
        self.pieces.push(Piece::new(shape, at, finish));
    }

    /// A box between two corners.
    pub fn slab(&mut self, min: Vec3, max: Vec3, finish: Finish) {
        self.pieces.push(Piece::slab(min, max, finish));
    }

    /// Keeps the floor below a box free, and `margin` around it.
    pub fn take(&mut self, min: Vec3, max: Vec3, margin: f32) {
        let rect = Rect::from_corners(min.xz(), max.xz());
        self.taken.push(rect.inflate(margin));
    }

    /// Air through a wall, from a space to another one or to the outside; with the floor before it kept free.
    pub fn open(&mut self, air: Space, space: usize, beyond: Option<usize>, outward: Vec3) {
        if outward.y == 0.0 && air.min.y < 0.3 {
            self.take(air.min, air.max, 0.5);
        }
        self.openings.push(Opening {
            air,
            space,
            beyond,
            outward,
        });
    }

    /// Whether a rectangle of floor lies in a space, `margin` from its walls, and is free.
    pub fn is_free(&self, space: usize, center: Vec2, half: Vec2, margin: f32) -> bool {
        let Space { min, max } = self.spaces[space];
        let (low, high) = (center - half, center + half);
        let inside = low.cmpge(min.xz() + margin).all() && high.cmple(max.xz() - margin).all();
        let overlaps = |taken: &Rect| low.cmplt(taken.max).all() && taken.min.cmplt(high).all();
        inside && !self.taken.iter().any(overlaps)
    }

    /// A free rectangle of floor somewhere in a space, which is taken; its centre.
    pub fn find_place(&mut self, g: &mut Generator, space: usize, half: Vec2) -> Option<Vec2> {
        const MARGIN: f32 = 0.06;
        let Space { min, max } = self.spaces[space];
        let (low, high) = (min.xz() + half + MARGIN, max.xz() - half - MARGIN);
        if low.cmpgt(high).any() {
            return None;
        }
        for _ in 0..16 {
            let center = Vec2::new(g.range(low.x, high.x), g.range(low.y, high.y));
            if self.is_free(space, center, half, 0.5 * MARGIN) {
                let rect = Rect::from_center_half_size(center, half);
                self.taken.push(rect.inflate(0.02));
                return Some(center);
            }
        }
        None
    }

    /// Distance of a point from the next piece, metres.
    pub fn clearance(&self, point: Vec3) -> f32 {
        let distances = self.pieces.iter().map(|piece| piece.distance(point));
        distances.fold(f32::INFINITY, f32::min)
    }

    /// Walls, floors and ceilings; without the openings to the outside, if it is sealed.
    pub fn shell(&self, finishes: &Finishes, sealed: bool) -> Vec<Piece> {
        let open = self.openings.iter();
        let open = open.filter(|opening| !sealed || opening.beyond.is_some());
        let air: Vec<_> = open.map(|opening| opening.air).collect();
        let carved = carve(&self.spaces, &air, self.wall);
        let pieces = carved.into_iter();
        let pieces =
            pieces.map(|(solid, part)| Piece::slab(solid.min, solid.max, finishes.of(part)));
        pieces.collect()
    }
}
