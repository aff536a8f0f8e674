//! Sun and sky, and the windows that they come through.

use bevy::prelude::*;

use super::{
    carve::Space,
    draft::Draft,
    generator::Generator,
    lamps::{Lamp, Source},
};

/// What is outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Daylight {
    /// Luminance of the sky, the same all around. Nits.
    pub sky: [f32; 3],
    pub sun: Option<Lamp>,
}

impl Daylight {
    /// A clear or an overcast day. The sun shines into openings that point against `into`, more often than not.
    pub fn draw(g: &mut Generator, into: Vec3) -> Self {
        if g.chance(0.35) {
            let nits = g.log_range(1500.0, 8000.0);
            return Self {
                sky: [0.94, 1.0, 1.1].map(|c| c * nits),
                sun: None,
            };
        }
        let nits = g.log_range(1500.0, 5000.0);
        let heading = Vec2::new(into.x, into.z).normalize_or(Vec2::X).to_angle();
        let spread = if g.chance(0.7) { 1.0 } else { 3.1 };
        let azimuth = heading + g.range(-spread, spread);
        let elevation = g.range(0.35, 1.15);
        let across = Vec2::from_angle(azimuth) * elevation.cos();
        let sun = Lamp {
            source: Source::Sun {
                lux: g.log_range(20_000.0, 100_000.0),
                toward: Vec3::new(across.x, -elevation.sin(), across.y),
            },
            at: Vec3::ZERO,
            color: [1.1, 0.98, 0.86],
            space: None,
        };
        Self {
            sky: [0.7, 1.0, 1.6].map(|c| c * nits),
            sun: Some(sun),
        }
    }

    /// Illuminance of a plane with this normal that sees nothing but the sky and the sun, lux.
    pub fn illuminance(&self, normal: Vec3) -> f32 {
        let sky = std::f32::consts::PI * crate::figures::luminance(&self.sky);
        let sun = self.sun.map_or(0.0, |sun| match sun.source {
            Source::Sun { lux, toward } => lux * (-toward).dot(normal).max(0.0),
            _ => 0.0,
        });
        sky + sun
    }
}

/// Cuts windows into outer walls, and sometimes into a ceiling.
pub fn windows(g: &mut Generator, draft: &mut Draft) {
    let count = 1 + g.below(2 * draft.spaces.len() + 1);
    let mut cut = 0;
    for attempt in 0..40 {
        if cut == count {
            break;
        }
        // The camera sees the light of one at least, if there is a wall for it.
        let space = match attempt < 12 && cut == 0 {
            true => 0,
            false => g.below(draft.spaces.len()),
        };
        cut += usize::from(window(g, draft, space));
    }
    if g.chance(0.2) || cut == 0 {
        skylight(g, draft);
    }
}

/// A window somewhere in a wall of a space, if that is an outer one with nothing in it yet.
fn window(g: &mut Generator, draft: &mut Draft, space: usize) -> bool {
    let Space { min, max } = draft.spaces[space];
    let (axis, sign) = (g.pick(&[0, 2]), g.pick(&[1.0f32, -1.0]));
    let along = 2 - axis;
    let length = max[along] - min[along];
    let width = g.range(0.6, 2.2f32.min(length - 0.4));
    let height = max.y - min.y;
    // Most have a sill; some reach to the floor. Tall walls have them high up too.
    let sill = match g.below(6) {
        0 => 0.02,
        1 if height > 4.0 => 0.55 * height,
        _ => g.range(0.7, 1.1),
    };
    let top = (sill + g.range(0.8, 1.6)).min(height - 0.15);
    if top - sill < 0.4 || length < 1.2 {
        return false;
    }
    let start = min[along] + g.range(0.2, length - width - 0.2);
    let mut air = Space::new(min, max);
    air.min[along] = start;
    air.max[along] = start + width;
    air.min.y = min.y + sill;
    air.max.y = min.y + top;
    let mut outward = Vec3::ZERO;
    outward[axis] = sign;
    through(&mut air, &draft.spaces[space], axis, sign, draft.wall);
    let mut before = air;
    through(
        &mut before,
        &draft.spaces[space],
        axis,
        sign,
        draft.wall + 1.0,
    );
    let is_outer = |other: &Space| !other.grown(draft.wall).overlaps(&before.grown(-1e-3));
    let others = draft.spaces.iter().enumerate();
    let mut others = others.filter(|(i, _)| *i != space);
    let apart = air.grown(0.1);
    if !others.all(|(_, other)| is_outer(other))
        || draft.openings.iter().any(|o| o.air.overlaps(&apart))
        || draft.pieces.iter().any(|p| apart.contains(p.at))
    {
        return false;
    }
    draft.open(air, space, None, outward);
    true
}

/// Moves a box to the outside of a space's wall, so thick.
fn through(air: &mut Space, space: &Space, axis: usize, sign: f32, thick: f32) {
    if sign > 0.0 {
        air.min[axis] = space.max[axis];
        air.max[axis] = space.max[axis] + thick;
    } else {
        air.max[axis] = space.min[axis];
        air.min[axis] = space.min[axis] - thick;
    }
}

/// An opening in the ceiling where the camera is.
fn skylight(g: &mut Generator, draft: &mut Draft) {
    let Space { min, max } = draft.spaces[0];
    let room = (max - min).xz() - 0.6;
    let size = Vec2::new(g.range(0.5, 1.4), g.range(0.5, 1.4)).min(room);
    let low = min.xz() + 0.3 + (room - size) * Vec2::new(g.unit(), g.unit());
    let air = Space::new(
        Vec3::new(low.x, max.y, low.y),
        Vec3::new(low.x + size.x, max.y + draft.wall, low.y + size.y),
    );
    draft.open(air, 0, None, Vec3::Y);
}
