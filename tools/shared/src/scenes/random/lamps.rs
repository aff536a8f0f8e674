//! Lamps: lights of Bevy's, and surfaces that shine.

use std::f32::consts::{FRAC_PI_2, PI};

use bevy::prelude::*;

use super::{
    carve::Space,
    draft::Draft,
    finish::Finish,
    generator::Generator,
    solid::{Piece, Shape},
};

/// A kind of light, with what Bevy's component has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    Bulb {
        lumens: f32,
    },
    Spot {
        /// As Bevy counts them: of a bulb that is as bright on the axis.
        lumens: f32,
        /// Half angles of the cone, radians.
        inner: f32,
        outer: f32,
        toward: Vec3,
    },
    Rect {
        lumens: f32,
        size: Vec2,
        toward: Vec3,
    },
    Sun {
        lux: f32,
        toward: Vec3,
    },
}

/// A light, in the building's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    pub source: Source,
    pub at: Vec3,
    /// Linear colour, of luminance 1.
    pub color: [f32; 3],
    /// The space that it is in; `None` for the sun.
    pub space: Option<usize>,
}

impl Lamp {
    /// Lumens that arrive in its space.
    pub fn flux(&self) -> f32 {
        match self.source {
            Source::Bulb { lumens } | Source::Rect { lumens, .. } => lumens,
            // Bevy's falloff between the angles leaves a third of that ring.
            Source::Spot {
                lumens,
                inner,
                outer,
                ..
            } => {
                let [inner, outer] = [inner, outer].map(|angle| 1.0 - angle.cos());
                lumens * 0.5 * (inner + (outer - inner) / 3.0)
            }
            Source::Sun { .. } => 0.0,
        }
    }
}

/// Colours of lamps of 2700 K, 3500 K, 4500 K and 6500 K, linear, of luminance 1.
const WHITES: [[f32; 3]; 4] = [
    [1.84, 0.85, 0.27],
    [1.47, 0.91, 0.53],
    [1.21, 0.96, 0.79],
    [1.0, 1.0, 1.0],
];

/// Most that a small thing emits, as a long fluorescent tube does. Lumens.
const SMALL: f32 = 5000.0;

/// Adds some lamps, of which the first is where the camera is, if there is a ceiling.
pub fn add(g: &mut Generator, draft: &mut Draft, count: usize) {
    for i in 0..count {
        let space = match i == 0 || g.chance(0.4) {
            true => 0,
            false => g.below(draft.spaces.len()),
        };
        // Under the open sky nothing hangs: what a court has is in the passages beside it.
        let space = match draft.has_roof {
            true => space,
            false => space.max(1),
        };
        // Enough for 60 to 400 lux on the floor.
        let area = draft.spaces[space].floor_area();
        let lumens = (area * g.log_range(60.0, 400.0)).clamp(250.0, 16_000.0);
        let color = g.pick(&WHITES);
        match g.below(7) {
            0 | 1 => bulb(g, draft, space, lumens, color),
            2 => spot(g, draft, space, lumens, color),
            3 => rect(g, draft, space, lumens, color),
            4 => shining_panel(g, draft, space, lumens, color),
            5 => shining_tube(g, draft, space, lumens.min(SMALL), color),
            _ => shining_ball(g, draft, space, lumens.min(SMALL), color),
        }
    }
}

/// A point `below` the ceiling of a space with nothing within `clear` metres.
fn point_below_ceiling(
    g: &mut Generator,
    draft: &Draft,
    space: usize,
    below: f32,
    clear: f32,
) -> Option<Vec3> {
    let Space { min, max } = draft.spaces[space];
    let margin = (clear + 0.05).max(0.3);
    let (low, high) = (min.xz() + margin, max.xz() - margin);
    if low.cmpgt(high).any() {
        return None;
    }
    let points = (0..30).map(|_| {
        let (x, z) = (g.range(low.x, high.x), g.range(low.y, high.y));
        Vec3::new(x, max.y - below, z)
    });
    let points: Vec<_> = points.collect();
    points.into_iter().find(|at| draft.clearance(*at) > clear)
}

fn bulb(g: &mut Generator, draft: &mut Draft, space: usize, lumens: f32, color: [f32; 3]) {
    let below = g.range(0.25, 0.6);
    if let Some(at) = point_below_ceiling(g, draft, space, below, 0.2) {
        draft.lamps.push(Lamp {
            source: Source::Bulb { lumens },
            at,
            color,
            space: Some(space),
        });
    }
}

fn spot(g: &mut Generator, draft: &mut Draft, space: usize, lumens: f32, color: [f32; 3]) {
    let below = g.range(0.15, 0.4);
    let Some(at) = point_below_ceiling(g, draft, space, below, 0.2) else {
        return;
    };
    let Space { min, max } = draft.spaces[space];
    // At the floor, or at the lower half of a wall.
    let target = min + (max - min) * Vec3::new(g.unit(), g.range(0.0, 0.5), g.unit());
    let outer = g.range(0.35, 0.9);
    let inner = outer * g.range(0.4, 0.9);
    let toward = (target - at).normalize_or(Vec3::NEG_Y);
    let mut lamp = Lamp {
        source: Source::Spot {
            lumens,
            inner,
            outer,
            toward,
        },
        at,
        color,
        space: Some(space),
    };
    // So many lumens in the cone.
    let part = lamp.flux() / lumens;
    lamp.source = Source::Spot {
        lumens: lumens / part.max(0.01),
        inner,
        outer,
        toward,
    };
    draft.lamps.push(lamp);
}

fn rect(g: &mut Generator, draft: &mut Draft, space: usize, lumens: f32, color: [f32; 3]) {
    let size = Vec2::new(g.range(0.3, 1.2), g.range(0.3, 0.6));
    let below = g.range(0.02, 0.3);
    let clear = 0.5 * size.length();
    let Some(at) = point_below_ceiling(g, draft, space, below, clear) else {
        return;
    };
    draft.lamps.push(Lamp {
        source: Source::Rect {
            lumens,
            size,
            toward: Vec3::NEG_Y,
        },
        at,
        color,
        space: Some(space),
    });
}

/// Adds a piece that shines with so many lumens from so many square metres.
fn shine(
    draft: &mut Draft,
    space: usize,
    piece: impl FnOnce(Finish) -> Piece,
    area: f32,
    lumens: f32,
    color: [f32; 3],
) {
    // A diffuse emitter: lumens = pi * area * nits.
    let nits = lumens / (PI * area);
    let finish = Finish::lamp(color.map(|c| c * nits));
    draft.pieces.push(piece(finish));
    draft.shining.push((space, lumens));
}

fn shining_panel(g: &mut Generator, draft: &mut Draft, space: usize, lumens: f32, color: [f32; 3]) {
    const THICK: f32 = 0.03;
    let size = Vec2::new(g.range(0.4, 1.3), g.range(0.25, 0.7));
    let clear = 0.5 * size.length();
    let Some(at) = point_below_ceiling(g, draft, space, 0.5 * THICK, clear) else {
        return;
    };
    let shape = Shape::Box(Vec3::new(size.x, THICK, size.y));
    let area = size.x * size.y;
    let piece = |finish| Piece::new(shape, at, finish);
    shine(draft, space, piece, area, lumens, color);
}

fn shining_tube(g: &mut Generator, draft: &mut Draft, space: usize, lumens: f32, color: [f32; 3]) {
    let (radius, height) = (g.range(0.008, 0.03), g.range(0.6, 1.5));
    let below = g.range(0.06, 0.3);
    let Some(at) = point_below_ceiling(g, draft, space, below, 0.5 * height) else {
        return;
    };
    let turn = Quat::from_rotation_y(g.range(0.0, PI)) * Quat::from_rotation_z(FRAC_PI_2);
    let shape = Shape::Cylinder { radius, height };
    let area = 2.0 * PI * radius * (height + radius);
    let piece = |finish| Piece::new(shape, at, finish).turned(turn);
    shine(draft, space, piece, area, lumens, color);
}

fn shining_ball(g: &mut Generator, draft: &mut Draft, space: usize, lumens: f32, color: [f32; 3]) {
    let radius = g.range(0.07, 0.2);
    let below = radius + g.range(0.1, 0.4);
    let clear = radius + 0.1;
    let Some(at) = point_below_ceiling(g, draft, space, below, clear) else {
        return;
    };
    let piece = |finish| Piece::new(Shape::Sphere(radius), at, finish);
    let area = 4.0 * PI * radius * radius;
    shine(draft, space, piece, area, lumens, color);
}
