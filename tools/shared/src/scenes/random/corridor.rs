//! A corridor with bends.

use bevy::prelude::*;

use super::{carve::Space, draft::Draft, generator::Generator};

/// Draws a corridor with one to three bends.
pub fn draw(g: &mut Generator, draft: &mut Draft) {
    let width = g.range(1.5, 2.4);
    let height = g.range(2.4, 3.1);
    let bends = 1 + g.below(3);
    let (mut at, mut way) = (Vec2::ZERO, Vec2::X);
    let mut turns: Vec<f32> = Vec::new();
    for bend in 0..=bends {
        // Longer than two widths and the walls between: parallel parts do not touch.
        let length = g.range(2.0 * width + 1.2, 7.5);
        let next = at + way * length;
        // Each part reaches from the middle of a corner to that of the next, and half a width beyond.
        let low = at.min(next) - 0.5 * width;
        let high = at.max(next) + 0.5 * width;
        draft.spaces.push(Space::new(
            Vec3::new(low.x, 0.0, low.y),
            Vec3::new(high.x, height, high.y),
        ));
        if bend > 0 {
            let touching = (bend - 1, bend, width * height);
            draft.passages.push(touching);
        }
        at = next;
        let turn = next_turn(g, &turns);
        turns.push(turn);
        way = way.perp() * turn;
    }
    longest_first(draft);
}

/// To the left (1) or the right (-1), and not three times the same: the corridor would run into itself.
fn next_turn(g: &mut Generator, turns: &[f32]) -> f32 {
    let turn = if g.chance(0.5) { 1.0 } else { -1.0 };
    match turns {
        [.., a, b] if *a == turn && *b == turn => -turn,
        _ => turn,
    }
}

/// The camera stands in the longest part.
fn longest_first(draft: &mut Draft) {
    let length = |space: &Space| space.size().xz().max_element();
    let longest = (0..draft.spaces.len())
        .max_by(|a, b| length(&draft.spaces[*a]).total_cmp(&length(&draft.spaces[*b])))
        .unwrap_or(0);
    draft.spaces.swap(0, longest);
    let renumbered = |i: usize| match i {
        0 => longest,
        i if i == longest => 0,
        i => i,
    };
    for (from, to, _) in &mut draft.passages {
        (*from, *to) = (renumbered(*from), renumbered(*to));
    }
}
