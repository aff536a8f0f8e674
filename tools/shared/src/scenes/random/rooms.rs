//! Rooms of a flat, with doorways between them.

use bevy::prelude::*;

use super::{carve::Space, draft::Draft, generator::Generator};

/// Draws two to four rooms.
pub fn draw(g: &mut Generator, draft: &mut Draft) {
    let size = Vec2::new(g.range(6.5, 12.0), g.range(4.8, 8.0));
    let height = g.range(2.4, 3.3);
    let gap = draft.inner_wall(g);
    let mut rooms = vec![Rect::from_center_size(Vec2::ZERO, size)];
    let count = 2 + g.below(3);
    while rooms.len() < count {
        rooms.sort_by(|a, b| area(b).total_cmp(&area(a)));
        let Some(halves) = split(g, rooms[0], gap) else {
            break;
        };
        rooms.remove(0);
        rooms.extend(halves);
    }
    rooms.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let space = |room: &Rect| {
        let (min, max) = (room.min, room.max);
        Space::new(
            Vec3::new(min.x, 0.0, min.y),
            Vec3::new(max.x, height, max.y),
        )
    };
    draft.spaces = rooms.iter().map(space).collect();
    connect(g, draft);
}

fn area(room: &Rect) -> f32 {
    room.size().element_product()
}

/// Two rooms of one, across its longer side. `None` if they would be too small.
fn split(g: &mut Generator, room: Rect, gap: f32) -> Option<[Rect; 2]> {
    /// Shortest side of a room, metres.
    const SHORTEST: f32 = 2.2;
    let axis = if room.width() > room.height() { 0 } else { 1 };
    let length = room.size()[axis];
    if length < 2.0 * SHORTEST + gap {
        return None;
    }
    let least = (SHORTEST + 0.5 * gap).max(0.35 * length);
    let at = room.min[axis] + g.range(least, length - least);
    let (mut first, mut second) = (room, room);
    first.max[axis] = at - 0.5 * gap;
    second.min[axis] = at + 0.5 * gap;
    Some([first, second])
}

/// A doorway from each room to one that is reached already; some more where rooms share a wall.
fn connect(g: &mut Generator, draft: &mut Draft) {
    let count = draft.spaces.len();
    let mut reached = vec![0];
    let mut waiting: Vec<usize> = (1..count).collect();
    while !waiting.is_empty() {
        let pairs = waiting
            .iter()
            .flat_map(|to| reached.iter().map(move |from| (*from, *to)));
        let pairs: Vec<_> = pairs
            .filter(|(from, to)| shared_wall(&draft.spaces[*from], &draft.spaces[*to]).is_some())
            .collect();
        if pairs.is_empty() {
            break;
        }
        let (from, to) = g.pick(&pairs);
        doorway(g, draft, from, to);
        reached.push(to);
        waiting.retain(|room| *room != to);
    }
    for from in 0..count {
        for to in from + 1..count {
            let is_open = draft.openings.iter().any(|door| {
                [(from, Some(to)), (to, Some(from))].contains(&(door.space, door.beyond))
            });
            if !is_open && g.chance(0.25) {
                doorway(g, draft, from, to);
            }
        }
    }
}

/// The wall between two rooms, as a box, with the axis across it and whether the second room is on its upper side.
struct SharedWall {
    wall: Space,
    axis: usize,
    sign: f32,
}

/// `None` if there is no wall in which a door would find place.
fn shared_wall(a: &Space, b: &Space) -> Option<SharedWall> {
    /// Widest wall between two rooms, and what a door needs along it, metres.
    const THICKEST: f32 = 0.6;
    const DOOR: f32 = 1.1;
    for (axis, along) in [(0, 2), (2, 0)] {
        for (first, second, sign) in [(a, b, 1.0), (b, a, -1.0)] {
            let gap = second.min[axis] - first.max[axis];
            let mut wall = Space::new(a.min.max(b.min), a.max.min(b.max));
            if gap <= 0.0 || gap > THICKEST || wall.max[along] - wall.min[along] < DOOR {
                continue;
            }
            wall.min[axis] = first.max[axis];
            wall.max[axis] = second.min[axis];
            return Some(SharedWall { wall, axis, sign });
        }
    }
    None
}

/// A doorway in the wall that two rooms share, if they do.
fn doorway(g: &mut Generator, draft: &mut Draft, from: usize, to: usize) {
    let shared = shared_wall(&draft.spaces[from], &draft.spaces[to]);
    let Some(SharedWall { wall, axis, sign }) = shared else {
        return;
    };
    let along = 2 - axis;
    let length = wall.max[along] - wall.min[along];
    // A door, or a wide opening.
    let widest: f32 = if g.chance(0.25) { 2.4 } else { 1.2 };
    let width = g.range(0.75, widest.min(length - 0.2));
    let start = wall.min[along] + g.range(0.1, length - width - 0.1);
    let mut air = wall;
    air.min[along] = start;
    air.max[along] = start + width;
    air.max.y = (wall.min.y + g.range(1.95, 2.3)).min(wall.max.y - 0.1);
    let mut outward = Vec3::ZERO;
    outward[axis] = sign;
    draft.open(air, from, Some(to), outward);
}
