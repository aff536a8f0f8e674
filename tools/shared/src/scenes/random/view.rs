//! Where the camera stands, and what it looks at.

use std::f32::consts::TAU;

use bevy::prelude::*;

use super::{draft::Draft, generator::Generator, solid::Piece};

/// Where one stands, in the building's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    pub eye: Vec3,
    pub look: Vec3,
    /// Vertical field of view, degrees.
    pub fov: f32,
}

/// Least distance of the camera from anything, metres.
pub const CLEARANCE: f32 = 0.3;

/// Half the side of the square of floor on which the camera may stand in any case, metres.
const HALF: f32 = 0.45;

/// Heights of eyes above the floor, metres.
const HEIGHTS: [f32; 2] = [1.45, 1.75];

/// Keeps a square of floor of the first space free; its centre.
pub fn reserve(g: &mut Generator, draft: &mut Draft) -> Vec2 {
    let half = Vec2::splat(HALF);
    let found = (0..40).find_map(|_| draft.find_place(g, 0, half));
    found.unwrap_or_else(|| {
        let space = draft.spaces[0];
        (0.5 * (space.min + space.max)).xz()
    })
}

/// The place from which most is seen, of some in the first space, looking that way. `pieces` is everything that may be
/// in the way, and `closed` what is to be kept clear of, too.
pub fn choose(
    g: &mut Generator,
    draft: &Draft,
    reserved: Vec2,
    pieces: &[Piece],
    closed: &[Piece],
) -> Stand {
    let space = draft.spaces[0];
    let mut places: Vec<Vec3> = (0..48)
        .map(|_| {
            let part = Vec3::new(g.unit(), 0.0, g.unit());
            let at = space.min + (space.max - space.min) * part;
            Vec3::new(at.x, g.range(HEIGHTS[0], HEIGHTS[1]), at.z)
        })
        .collect();
    places.push(Vec3::new(reserved.x, HEIGHTS[0], reserved.y));
    let clearance = |eye: Vec3| {
        let all = pieces.iter().chain(closed);
        let distances = all.map(|piece| piece.distance(eye));
        distances.fold(f32::INFINITY, f32::min)
    };
    let fov = g.range(55.0, 72.0);
    let best = places
        .iter()
        .filter(|eye| clearance(**eye) >= CLEARANCE)
        .map(|eye| {
            let (heading, free) = freest(*eye, pieces);
            (*eye, heading, free)
        })
        .max_by(|a, b| a.2.total_cmp(&b.2));
    let (eye, heading) = best.map_or_else(
        || {
            // Nowhere else: where there is most room.
            let widest = places
                .iter()
                .max_by(|a, b| clearance(**a).total_cmp(&clearance(**b)));
            let eye = widest.copied().unwrap_or_default();
            (eye, freest(eye, pieces).0)
        },
        |(eye, heading, _)| (eye, heading),
    );
    Stand {
        eye,
        look: eye + direction(heading, PITCH),
        fov,
    }
}

/// Slope of the camera: a little downwards.
const PITCH: f32 = -0.12;

fn direction(heading: f32, slope: f32) -> Vec3 {
    let across = Vec2::from_angle(heading);
    Vec3::new(across.x, slope, across.y)
}

/// The heading in which the eye sees farthest, and how far: the mean over the picture, metres.
fn freest(eye: Vec3, pieces: &[Piece]) -> (f32, f32) {
    /// What is farther away counts no more, and where nothing is met, as little as a wall close by, metres: who looks
    /// out of a window sees nothing of the scene.
    const FARTHEST: f32 = 10.0;
    const NOTHING: f32 = 1.0;
    const HEADINGS: usize = 36;
    let distance = |heading: f32, slope: f32| {
        let toward = direction(heading, slope).normalize_or(Vec3::X);
        let hits = pieces.iter().filter_map(|piece| piece.hit(eye, toward));
        let nearest = hits.fold(f32::INFINITY, f32::min);
        if nearest.is_finite() {
            nearest.min(FARTHEST)
        } else {
            NOTHING
        }
    };
    let heading = |i: usize| TAU * (i % HEADINGS) as f32 / HEADINGS as f32;
    let free: Vec<f32> = (0..HEADINGS)
        .map(|i| 0.5 * (distance(heading(i), 0.0) + distance(heading(i), 2.0 * PITCH)))
        .collect();
    // Pictures are some 90 degrees wide.
    let wide = HEADINGS / 8;
    let mean = |i: usize| {
        let sum: f32 = (0..=2 * wide)
            .map(|k| free[(i + HEADINGS + k - wide) % HEADINGS])
            .sum();
        sum / (2 * wide + 1) as f32
    };
    (0..HEADINGS)
        .map(|i| (heading(i), mean(i)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0.0, 0.0))
}
