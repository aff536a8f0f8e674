//! How bright a building is, roughly: each space is a sphere that mixes its light, and openings exchange it. It decides
//! on the camera's exposure only.

use std::f32::consts::PI;

use super::{daylight::Daylight, draft::Draft};

/// What the mean luminance becomes in the exposed picture, before tone mapping.
const GREY: f32 = 0.16;

/// The exposure value at ISO 100 that makes a grey of so many nits.
pub fn ev100(nits: f32) -> f32 {
    // As `bevy::camera::Exposure` has it.
    (nits.max(1e-3) / (1.2 * GREY)).log2()
}

/// Mean luminance in the first space, nits, with surfaces of this albedo.
pub fn luminance(draft: &Draft, albedo: f32, daylight: Option<&Daylight>) -> f32 {
    let count = draft.spaces.len();
    // Lumens that come from lamps and from outside.
    let mut own = vec![0.0f32; count];
    for lamp in &draft.lamps {
        if let Some(space) = lamp.space {
            own[space] += lamp.flux();
        }
    }
    for (space, lumens) in &draft.shining {
        own[*space] += lumens;
    }
    let mut links: Vec<_> = draft.passages.clone();
    let mut open = vec![0.0f32; count];
    for opening in &draft.openings {
        match opening.beyond {
            Some(beyond) => links.push((opening.space, beyond, opening.area())),
            None => {
                open[opening.space] += opening.area();
                let outside = daylight.map_or(0.0, |day| day.illuminance(opening.outward));
                own[opening.space] += opening.area() * outside;
            }
        }
    }
    for (a, b, area) in &links {
        open[*a] += area;
        open[*b] += area;
    }
    let surface: Vec<f32> = draft.spaces.iter().map(|space| space.surface()).collect();
    // Mean illuminance of each space: surface * E = own + albedo * walls * E + what comes through openings.
    let mut lux = vec![0.0f32; count];
    for _ in 0..60 {
        let mut flux = own.clone();
        for (a, b, area) in &links {
            flux[*a] += area * albedo * lux[*b];
            flux[*b] += area * albedo * lux[*a];
        }
        let balance = |i: usize| {
            let walls = (surface[i] - open[i]).max(0.2 * surface[i]);
            flux[i] / (surface[i] - albedo * walls)
        };
        lux = (0..count).map(balance).collect();
    }
    albedo * lux[0] / PI
}

#[cfg(test)]
mod tests {
    use bevy::{camera::Exposure, prelude::*};

    use super::*;
    use crate::scenes::random::{
        carve::Space,
        lamps::{Lamp, Source},
    };

    /// An integrating sphere: 600 lm on 6 m2 that reflect half are 200 lux.
    #[test]
    fn a_closed_room_is_an_integrating_sphere() {
        let draft = Draft {
            spaces: vec![Space::new(Vec3::ZERO, Vec3::ONE)],
            lamps: vec![Lamp {
                source: Source::Bulb { lumens: 600.0 },
                at: Vec3::splat(0.5),
                color: [1.0; 3],
                space: Some(0),
            }],
            ..default()
        };
        let nits = luminance(&draft, 0.5, None);
        assert!((nits - 0.5 * 200.0 / PI).abs() < 1e-2, "{nits}");
        let exposed = nits * Exposure { ev100: ev100(nits) }.exposure();
        assert!((exposed - GREY).abs() < 1e-4);
    }
}
