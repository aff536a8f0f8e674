//! A court that is open to the sky, with arcades or colonnades around it.

use bevy::prelude::*;

use super::{
    carve::Space,
    draft::Draft,
    finish::{Finish, Surface},
    generator::Generator,
    solid::Shape,
};

/// Draws a court with one to four covered sides.
pub fn draw(g: &mut Generator, draft: &mut Draft) {
    let half = Vec2::new(g.range(2.8, 5.5), g.range(2.8, 5.5));
    let height = g.range(3.4, 6.0);
    let court = Space::new(
        Vec3::new(-half.x, 0.0, -half.y),
        Vec3::new(half.x, height, half.y),
    );
    draft.spaces.push(court);
    draft.has_roof = false;
    let mut top = court;
    top.min.y = height;
    top.max.y = height + draft.wall;
    draft.open(top, 0, None, Vec3::Y);
    let mut sides = vec![(0, 1.0), (0, -1.0), (2, 1.0), (2, -1.0)];
    let count = 1 + g.below(4);
    for _ in 0..count {
        let (axis, sign) = sides.swap_remove(g.below(sides.len()));
        side(g, draft, axis, sign);
    }
}

/// A covered passage along a side of the court, behind arches or columns.
fn side(g: &mut Generator, draft: &mut Draft, axis: usize, sign: f32) {
    let court = draft.spaces[0];
    let depth = g.range(1.7, 2.6);
    let pier = draft.inner_wall(g);
    let height = g.range(2.4, (court.max.y - 0.4).min(3.4));
    let edge = if sign > 0.0 {
        court.max[axis]
    } else {
        court.min[axis]
    };
    let (near, far) = (edge + sign * pier, edge + sign * (pier + depth));
    let mut passage = court;
    passage.min[axis] = near.min(far);
    passage.max[axis] = near.max(far);
    passage.max.y = height;
    draft.spaces.push(passage);
    let index = draft.spaces.len() - 1;
    let mut wall = passage;
    wall.min[axis] = edge.min(near);
    wall.max[axis] = edge.max(near);
    wall.max.y = height - g.range(0.2, 0.4);
    let mut outward = Vec3::ZERO;
    outward[axis] = sign;
    if g.chance(0.5) {
        arches(g, draft, wall, index, outward);
    } else {
        columns(g, draft, wall, index, outward);
    }
}

/// The horizontal axis along a wall that is crossed by `outward`.
fn along(outward: Vec3) -> usize {
    if outward.x == 0.0 { 0 } else { 2 }
}

/// Number of bays along a wall.
fn bays(g: &mut Generator, length: f32) -> usize {
    ((length / g.range(1.7, 2.8)).round() as usize).max(2)
}

fn arches(g: &mut Generator, draft: &mut Draft, wall: Space, passage: usize, outward: Vec3) {
    let axis = along(outward);
    let length = wall.max[axis] - wall.min[axis];
    let count = bays(g, length);
    let bay = length / count as f32;
    let pier = g.range(0.3, 0.55);
    for i in 0..count {
        let mut air = wall;
        air.min[axis] = wall.min[axis] + i as f32 * bay + 0.5 * pier;
        air.max[axis] = wall.min[axis] + (i + 1) as f32 * bay - 0.5 * pier;
        draft.open(air, 0, Some(passage), outward);
    }
}

fn columns(g: &mut Generator, draft: &mut Draft, wall: Space, passage: usize, outward: Vec3) {
    let axis = along(outward);
    let mut air = wall;
    air.min[axis] += 0.25;
    air.max[axis] -= 0.25;
    draft.open(air, 0, Some(passage), outward);
    let length = air.max[axis] - air.min[axis];
    let count = bays(g, length);
    let finish = Finish::draw_of(g, &[Surface::Stone, Surface::Plaster, Surface::Concrete]);
    let radius = g.range(0.1, 0.22);
    let height = wall.max.y;
    for i in 1..count {
        let mut at = 0.5 * (air.min + air.max);
        at[axis] = air.min[axis] + length * i as f32 / count as f32;
        at.y = 0.5 * height;
        draft.add(Shape::Cylinder { radius, height }, at, finish);
        draft.take(at - radius, at + radius, 0.1);
    }
}
