//! Light from outside of the scene, and how it is found by its brightness.

use std::f32::consts::PI;

use bevy::math::{Quat, Vec2, Vec3};

use super::{distribution::Distribution, lights::Arrival, texture::Cubemap};

/// Light from outside of the scene.
#[derive(Debug)]
pub(super) enum Sky {
    /// Nits from everywhere.
    Constant(Vec3),
    /// A cube map, chosen from by its brightness.
    Map(Box<SkyMap>),
}

#[derive(Debug)]
pub(super) struct SkyMap {
    pub map: Cubemap,
    /// Nits of a texel of 1.
    pub scale: f32,
    /// From the world into the map's space, before that is mirrored.
    pub map_from_world: Quat,
    /// Of cells of the sphere, in equal steps of azimuth and of height.
    distribution: Distribution,
}

/// Cells of the sphere along azimuth and height, from which skies are sampled.
const SKY_CELLS: [usize; 2] = [128, 64];

impl SkyMap {
    pub fn new(map: Cubemap, scale: f32, map_from_world: Quat) -> Self {
        let mut sky = Self {
            map,
            scale,
            map_from_world,
            distribution: Distribution::default(),
        };
        let [w, h] = SKY_CELLS;
        let weight = |cell: usize| {
            // The mean of some points of a cell, and a little, so that nothing is left out.
            let mut sum = 0.0;
            for i in 0..16 {
                let u = Vec2::new((i % 4) as f32 + 0.5, (i / 4) as f32 + 0.5) / 4.0;
                sum += sky.radiance(cell_direction(cell, u)).element_sum();
            }
            sum
        };
        let weights: Vec<f32> = (0..w * h).map(weight).collect();
        let mean = weights.iter().sum::<f32>() / weights.len() as f32;
        sky.distribution = Distribution::new(weights.iter().map(|w| w + 0.01 * mean));
        sky
    }

    fn radiance(&self, direction: Vec3) -> Vec3 {
        let d = self.map_from_world * direction;
        self.map.sample(Vec3::new(d.x, d.y, -d.z)) * self.scale
    }
}

/// A direction in a cell; cells of equal height on the sphere have equal solid angles.
fn cell_direction(cell: usize, u: Vec2) -> Vec3 {
    let [w, h] = SKY_CELLS;
    let y = ((cell / w) as f32 + u.y) / h as f32 * 2.0 - 1.0;
    let (sin, cos) = (((cell % w) as f32 + u.x) / w as f32 * 2.0 * PI).sin_cos();
    let r = (1.0 - y * y).max(0.0).sqrt();
    Vec3::new(r * cos, y, r * sin)
}

fn direction_cell(d: Vec3) -> usize {
    let [w, h] = SKY_CELLS;
    let turn = d.z.atan2(d.x) / (2.0 * PI);
    let x = ((turn - turn.floor()) * w as f32) as usize;
    let y = ((d.y * 0.5 + 0.5) * h as f32) as usize;
    y.min(h - 1) * w + x.min(w - 1)
}

impl Sky {
    /// Nits from a direction.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Constant(nits) => *nits,
            Self::Map(map) => map.radiance(direction),
        }
    }

    /// A direction from which much light comes; `None` where all are alike.
    pub fn arrive(&self, u: [f32; 2]) -> Option<Arrival> {
        let Self::Map(sky) = self else { return None };
        if sky.distribution.is_empty() {
            return None;
        }
        let (cell, _, rest) = sky.distribution.sample(u[0]);
        let direction = cell_direction(cell, Vec2::new(rest, u[1]));
        let pdf = self.pdf(direction);
        Some(Arrival {
            direction,
            distance: f32::INFINITY,
            light: sky.radiance(direction) / pdf,
            pdf: Some(pdf),
        })
    }

    /// Density with which [`arrive`](Self::arrive) finds a direction, per steradian.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        match self {
            Self::Map(sky) if !sky.distribution.is_empty() => {
                let cells = (SKY_CELLS[0] * SKY_CELLS[1]) as f32;
                sky.distribution.probability(direction_cell(direction)) * cells / (4.0 * PI)
            }
            _ => 0.0,
        }
    }

    /// Whether next-event estimation looks for the sky at all.
    pub fn is_sampled(&self) -> bool {
        matches!(self, Self::Map(sky) if !sky.distribution.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_find_their_cells() {
        for cell in 0..SKY_CELLS[0] * SKY_CELLS[1] {
            assert_eq!(direction_cell(cell_direction(cell, Vec2::splat(0.5))), cell);
        }
    }
}
