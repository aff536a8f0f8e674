//! Tall halls: of two storeys with stairs to a gallery, and of pillars.

use bevy::prelude::*;

use super::{
    carve::Space,
    draft::Draft,
    finish::{Finish, Surface},
    generator::Generator,
    solid::Shape,
};

/// What the stairs and the gallery of a hall are.
struct Gallery {
    /// Height of its deck above the floor.
    height: f32,
    thickness: f32,
    /// Where it ends, along z.
    edge: f32,
    /// Width of the stairs.
    stairs: f32,
    finish: Finish,
}

/// Draws a hall with a gallery at one end, and stairs along a wall.
pub fn draw_two_storeys(g: &mut Generator, draft: &mut Draft) {
    let half = Vec2::new(g.range(3.0, 5.0), g.range(4.4, 5.8));
    let deck = g.range(2.5, 3.0);
    let height = deck + g.range(2.4, 3.2);
    let hall = Space::new(
        Vec3::new(-half.x, 0.0, -half.y),
        Vec3::new(half.x, height, half.y),
    );
    draft.spaces.push(hall);
    let gallery = Gallery {
        height: deck,
        thickness: g.range(0.1, 0.3),
        edge: -half.y + g.range(1.9, 2.8),
        stairs: g.range(1.0, 1.4),
        finish: Finish::draw_of(g, &[Surface::Wood, Surface::Concrete, Surface::Plaster]),
    };
    draft.slab(
        Vec3::new(-half.x, deck - gallery.thickness, -half.y),
        Vec3::new(half.x, deck, gallery.edge),
        gallery.finish,
    );
    stairs(g, draft, &hall, &gallery);
    parapet(g, draft, &hall, &gallery);
    supports(g, draft, &hall, &gallery);
}

/// Steps from the floor to the deck along the wall at the lower end of x: solid, or boards.
fn stairs(g: &mut Generator, draft: &mut Draft, hall: &Space, gallery: &Gallery) {
    let count = (gallery.height / 0.18).ceil() as usize;
    let (rise, tread) = (gallery.height / count as f32, 0.27);
    let is_solid = g.chance(0.5);
    let finish = Finish::draw_of(g, &[Surface::Wood, Surface::Stone, Surface::Concrete]);
    let (left, right) = (hall.min.x, hall.min.x + gallery.stairs);
    for step in 0..count {
        let top = rise * (step + 1) as f32;
        let near = gallery.edge + tread * (count - 1 - step) as f32;
        let bottom = if is_solid { 0.0 } else { top - 0.06 };
        // Boards overlap a little, as real ones do.
        let overlap = if is_solid { 0.0 } else { 0.03 };
        draft.slab(
            Vec3::new(left, bottom, near),
            Vec3::new(right, top, near + tread + overlap),
            finish,
        );
    }
    let run = tread * count as f32;
    // With room to walk up to them.
    let foot = Vec3::new(right + 0.1, 0.0, gallery.edge + run + 0.8);
    draft.take(Vec3::new(left, 0.0, gallery.edge), foot, 0.0);
}

/// A wall of the height of a rail at the edge of the deck, but where the stairs arrive.
fn parapet(g: &mut Generator, draft: &mut Draft, hall: &Space, gallery: &Gallery) {
    let thickness = g.range(0.05, 0.15);
    let finish = Finish::draw_of(g, &[Surface::Painted, Surface::Plaster, Surface::Wood]);
    draft.slab(
        Vec3::new(
            hall.min.x + gallery.stairs,
            gallery.height,
            gallery.edge - thickness,
        ),
        Vec3::new(hall.max.x, gallery.height + 0.95, gallery.edge),
        finish,
    );
}

/// Columns below the edge of the deck.
fn supports(g: &mut Generator, draft: &mut Draft, hall: &Space, gallery: &Gallery) {
    let count = 1 + g.below(3);
    let radius = g.range(0.06, 0.16);
    let height = gallery.height - gallery.thickness;
    let from = hall.min.x + gallery.stairs;
    for i in 0..count {
        let part = (i as f32 + 0.5) / count as f32;
        let x = from + (hall.max.x - from) * part;
        let at = Vec3::new(x, 0.5 * height, gallery.edge - radius);
        draft.add(Shape::Cylinder { radius, height }, at, gallery.finish);
        draft.take(at - radius, at + radius, 0.1);
    }
}

/// Draws a hall with two rows of pillars, round or square.
pub fn draw_pillars(g: &mut Generator, draft: &mut Draft) {
    let half = Vec2::new(g.range(4.0, 6.5), g.range(3.4, 5.5));
    let height = g.range(3.0, 5.0);
    let hall = Space::new(
        Vec3::new(-half.x, 0.0, -half.y),
        Vec3::new(half.x, height, half.y),
    );
    draft.spaces.push(hall);
    let count = 2 + g.below(3);
    let radius = g.range(0.14, 0.36);
    let row = half.y * g.range(0.35, 0.55);
    let is_round = g.chance(0.6);
    let finish = Finish::draw_of(
        g,
        &[
            Surface::Stone,
            Surface::Plaster,
            Surface::Concrete,
            Surface::Brick,
        ],
    );
    for i in 0..2 * count {
        let part = ((i / 2) as f32 + 0.5) / count as f32;
        let x = -half.x + 2.0 * half.x * part;
        let z = if i % 2 == 0 { row } else { -row };
        let at = Vec3::new(x, 0.5 * height, z);
        let shape = match is_round {
            true => Shape::Cylinder { radius, height },
            false => Shape::Box(Vec3::new(2.0 * radius, height, 2.0 * radius)),
        };
        draft.add(shape, at, finish);
        draft.take(at - radius, at + radius, 0.15);
        // A base, wider than the pillar.
        let base = 0.2;
        let wide = radius + 0.07;
        draft.slab(
            Vec3::new(x - wide, 0.0, z - wide),
            Vec3::new(x + wide, base, z + wide),
            finish,
        );
    }
}
