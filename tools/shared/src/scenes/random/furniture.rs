//! What stands and hangs in spaces.

use std::f32::consts::{FRAC_PI_2, TAU};

use bevy::prelude::*;

use super::{
    carve::Space,
    draft::Draft,
    finish::{Finish, Surface},
    generator::Generator,
    solid::{Piece, Shape},
};

/// What most things are made of.
const SOLID: [Surface; 6] = [
    Surface::Wood,
    Surface::Painted,
    Surface::Wood,
    Surface::Plaster,
    Surface::Metal,
    Surface::Cloth,
];

/// Furnishes all spaces, more or less.
pub fn furnish(g: &mut Generator, draft: &mut Draft) {
    for space in 0..draft.spaces.len() {
        let area = draft.spaces[space].floor_area();
        let most = (area / 4.0).clamp(1.0, 9.0) as usize;
        for _ in 0..1 + g.below(most) {
            match g.below(9) {
                0 | 1 => table(g, draft, space),
                2 | 3 => shelf(g, draft, space),
                4 => block(g, draft, space),
                5 => ball(g, draft, space),
                6 => plant(g, draft, space),
                7 => hanging(g, draft, space),
                _ => rug(g, draft, space),
            }
        }
        if g.chance(0.4) {
            panel(g, draft, space);
        }
    }
}

/// Pieces in the space of a thing that stands on the floor, turned about its vertical axis.
struct Thing {
    at: Vec3,
    turn: Quat,
}

impl Thing {
    fn new(at: Vec2, turn: f32) -> Self {
        Self {
            at: Vec3::new(at.x, 0.0, at.y),
            turn: Quat::from_rotation_y(turn),
        }
    }

    fn add(&self, draft: &mut Draft, shape: Shape, at: Vec3, finish: Finish) {
        let at = self.at + self.turn * at;
        let piece = Piece::new(shape, at, finish).turned(self.turn);
        draft.pieces.push(piece);
    }
}

/// A place for something turned at random: where it is, and by how much it is turned.
fn place_turned(
    g: &mut Generator,
    draft: &mut Draft,
    space: usize,
    size: Vec2,
) -> Option<(Vec2, f32)> {
    // Most furniture stands along a wall, some at an angle.
    let turn = match g.below(3) {
        0 => 0.0,
        1 => FRAC_PI_2,
        _ => g.range(0.0, TAU),
    };
    let (sin, cos) = (turn.sin().abs(), turn.cos().abs());
    let half = 0.5 * Vec2::new(size.x * cos + size.y * sin, size.x * sin + size.y * cos);
    let at = draft.find_place(g, space, half)?;
    Some((at, turn))
}

/// A board on four legs, with something on it.
fn table(g: &mut Generator, draft: &mut Draft, space: usize) {
    let size = Vec2::new(g.range(0.8, 1.7), g.range(0.5, 0.9));
    let height = g.range(0.42, 0.78);
    let Some((at, turn)) = place_turned(g, draft, space, size) else {
        return;
    };
    let thing = Thing::new(at, turn);
    let finish = Finish::draw_of(g, &[Surface::Wood, Surface::Painted, Surface::Stone]);
    let thick = g.range(0.02, 0.05);
    let board = Vec3::new(size.x, thick, size.y);
    let middle = Vec3::Y * (height - 0.5 * thick);
    thing.add(draft, Shape::Box(board), middle, finish);
    let legs = Finish::draw_of(g, &[Surface::Wood, Surface::Metal]);
    let leg = g.range(0.03, 0.07);
    let length = height - thick;
    for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        let corner = 0.5 * size - 0.5 * leg - 0.02;
        let foot = Vec3::new(x * corner.x, 0.5 * length, z * corner.y);
        thing.add(draft, Shape::Box(Vec3::new(leg, length, leg)), foot, legs);
    }
    for x in [-0.25, 0.25] {
        let radius = g.range(0.05, 0.14);
        let on = Vec3::new(x * size.x, height + radius, 0.0);
        let finish = Finish::draw_of(g, &[Surface::Painted, Surface::Tiles, Surface::Metal]);
        let shape = match g.below(3) {
            0 => Shape::Sphere(radius),
            1 => Shape::Box(Vec3::splat(2.0 * radius)),
            _ => Shape::Cylinder {
                radius,
                height: 2.0 * radius,
            },
        };
        thing.add(draft, shape, on, finish);
    }
}

/// A place at a wall of a space for something so wide and deep: its middle, and the turn that has its back, at the
/// lower end of z, at the wall.
fn place_at_wall(
    g: &mut Generator,
    draft: &mut Draft,
    space: usize,
    [width, depth]: [f32; 2],
) -> Option<(Vec2, f32)> {
    const GAP: f32 = 0.03;
    let Space { min, max } = draft.spaces[space];
    for _ in 0..12 {
        let side = g.below(4);
        let (along, across) = if side < 2 { (0, 1) } else { (1, 0) };
        let (low, high) = (min.xz(), max.xz());
        if high[along] - low[along] < width + 0.2 || high[across] - low[across] < depth + 0.8 {
            continue;
        }
        let mut at = Vec2::ZERO;
        at[along] = g.range(low[along] + 0.5 * width, high[along] - 0.5 * width);
        at[across] = match side % 2 {
            0 => low[across] + 0.5 * depth + GAP,
            _ => high[across] - 0.5 * depth - GAP,
        };
        let mut half = Vec2::splat(0.5 * depth);
        half[along] = 0.5 * width;
        if draft.is_free(space, at, half, 0.0) {
            let rect = Rect::from_center_half_size(at, half);
            draft.taken.push(rect.inflate(0.02));
            // A turn by 90 degrees about y takes z to x.
            let turn = [0.0, 2.0, 1.0, -1.0][side] * FRAC_PI_2;
            return Some((at, turn));
        }
    }
    None
}

/// Boards between two uprights, with or without a back.
fn shelf(g: &mut Generator, draft: &mut Draft, space: usize) {
    let Space { min, max } = draft.spaces[space];
    let (width, depth) = (g.range(0.7, 1.8), g.range(0.25, 0.45));
    let height = g.range(0.8, 2.2f32.min(max.y - min.y - 0.3));
    let Some((at, turn)) = place_at_wall(g, draft, space, [width, depth]) else {
        return;
    };
    let thing = Thing::new(at, turn);
    let finish = Finish::draw_of(g, &[Surface::Wood, Surface::Painted, Surface::Metal]);
    let thick = g.range(0.018, 0.035);
    for x in [-1.0, 1.0] {
        let side = Vec3::new(0.5 * x * (width - thick), 0.5 * height, 0.0);
        let upright = Shape::Box(Vec3::new(thick, height, depth));
        thing.add(draft, upright, side, finish);
    }
    let boards = 2 + g.below(4);
    let inner = width - 2.0 * thick;
    for i in 0..=boards {
        let y = 0.5 * thick + (height - thick) * i as f32 / boards as f32;
        let board = Shape::Box(Vec3::new(inner, thick, depth));
        thing.add(draft, board, Vec3::Y * y, finish);
        let clear = (height - thick) / boards as f32 - thick;
        if i < boards && g.chance(0.7) {
            // A row of books, or of boxes.
            let size = Vec3::new(
                inner * g.range(0.3, 0.9),
                clear * g.range(0.5, 0.9),
                depth * 0.7,
            );
            let x = 0.5 * (inner - size.x) * g.range(-1.0, 1.0);
            let at = Vec3::new(x, y + 0.5 * thick + 0.5 * size.y, 0.0);
            let finish = Finish::draw_of(g, &SOLID);
            thing.add(draft, Shape::Box(size), at, finish);
        }
    }
    if g.chance(0.5) {
        let back = Shape::Box(Vec3::new(inner, height, 0.01));
        let at = Vec3::new(0.0, 0.5 * height, -0.5 * depth + 0.005);
        thing.add(draft, back, at, finish);
    }
}

/// A box, or two of them.
fn block(g: &mut Generator, draft: &mut Draft, space: usize) {
    let size = Vec3::new(g.range(0.3, 1.2), g.range(0.3, 1.4), g.range(0.3, 0.9));
    let Some((at, turn)) = place_turned(g, draft, space, size.xz()) else {
        return;
    };
    let thing = Thing::new(at, turn);
    let finish = Finish::draw_of(g, &SOLID);
    thing.add(draft, Shape::Box(size), Vec3::Y * 0.5 * size.y, finish);
    if size.y < 0.7 && g.chance(0.4) {
        let finish = Finish::draw_of(g, &SOLID);
        let upper = size * g.range(0.5, 0.8);
        let at = Vec3::Y * (size.y + 0.5 * upper.y);
        thing.add(draft, Shape::Box(upper), at, finish);
    }
}

fn ball(g: &mut Generator, draft: &mut Draft, space: usize) {
    let radius = g.range(0.15, 0.5);
    if let Some(at) = draft.find_place(g, space, Vec2::splat(radius)) {
        let finish = Finish::draw_of(
            g,
            &[
                Surface::Painted,
                Surface::Plaster,
                Surface::Metal,
                Surface::Tiles,
            ],
        );
        let at = Vec3::new(at.x, radius, at.y);
        draft.add(Shape::Sphere(radius), at, finish);
    }
}

/// A pot with cards of leaves that cross each other.
fn plant(g: &mut Generator, draft: &mut Draft, space: usize) {
    let Space { min, max } = draft.spaces[space];
    let width = g.range(0.5, 1.1);
    let pot = g.range(0.25, 0.45);
    let height = g.range(0.5, 1.4).min(max.y - min.y - pot - 0.2);
    let Some(at) = draft.find_place(g, space, Vec2::splat(0.5 * width)) else {
        return;
    };
    let finish = Finish::draw_of(g, &[Surface::Brick, Surface::Tiles, Surface::Painted]);
    let shape = Shape::Cylinder {
        radius: 0.25 * width,
        height: pot,
    };
    draft.add(shape, Vec3::new(at.x, 0.5 * pot, at.y), finish);
    let leaves = Finish::draw(g, Surface::Leaves);
    let cards = 2 + g.below(4);
    let first = g.range(0.0, TAU);
    for i in 0..cards {
        let turn = Quat::from_rotation_y(first + 0.5 * TAU * i as f32 / cards as f32);
        let center = Vec3::new(at.x, pot + 0.5 * height, at.y);
        let card = Shape::Card(Vec2::new(width, height));
        draft
            .pieces
            .push(Piece::new(card, center, leaves).turned(turn));
    }
}

/// Cloth, or a picture, that hangs on a wall.
fn hanging(g: &mut Generator, draft: &mut Draft, space: usize) {
    let Space { min, max } = draft.spaces[space];
    let thick = g.range(0.01, 0.04);
    let width = g.range(0.6, 2.0);
    let Some((at, turn)) = place_at_wall(g, draft, space, [width, thick]) else {
        return;
    };
    let height = g.range(0.6, 2.0f32.min(max.y - min.y - 0.4));
    let top = g.range(height + 0.1, max.y - min.y - 0.1);
    let finish = Finish::draw_of(g, &[Surface::Cloth, Surface::Cloth, Surface::Painted]);
    let shape = Shape::Box(Vec3::new(width, height, thick));
    Thing::new(at, turn).add(draft, shape, Vec3::Y * (top - 0.5 * height), finish);
}

/// Cloth on the floor, under whatever stands there.
fn rug(g: &mut Generator, draft: &mut Draft, space: usize) {
    // No two of them lie in one plane.
    let thick = g.range(0.006, 0.02);
    let Space { min, max } = draft.spaces[space];
    let room = (max - min).xz() - 0.4;
    let size = Vec2::new(g.range(0.8, 2.4), g.range(0.6, 1.8)).min(room);
    let low = min.xz() + 0.2 + (room - size) * Vec2::new(g.unit(), g.unit());
    let finish = Finish::draw(g, Surface::Cloth);
    draft.slab(
        Vec3::new(low.x, 0.0, low.y),
        Vec3::new(low.x + size.x, thick, low.y + size.y),
        finish,
    );
}

/// Another material over a whole wall without openings.
fn panel(g: &mut Generator, draft: &mut Draft, space: usize) {
    let Space { min, max } = draft.spaces[space];
    let (axis, is_upper) = (g.pick(&[0, 2]), g.chance(0.5));
    // It touches the wall, and reaches neither into passages nor into other spaces.
    let mut panel = Space::new(min, max);
    let thick = g.range(0.01, 0.04);
    match is_upper {
        true => panel.min[axis] = max[axis] - thick,
        false => panel.max[axis] = min[axis] + thick,
    }
    let probe = panel.grown(0.01);
    let in_use = draft.openings.iter().any(|o| o.air.overlaps(&probe));
    let others = draft.spaces.iter().enumerate();
    let others = others.filter(|(i, other)| *i != space && other.overlaps(&probe));
    if in_use || others.count() > 0 {
        return;
    }
    let finish = Finish::draw_of(
        g,
        &[
            Surface::Painted,
            Surface::Painted,
            Surface::Brick,
            Surface::Wood,
            Surface::Tiles,
        ],
    );
    draft.slab(panel.min, panel.max, finish);
}
