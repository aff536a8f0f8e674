//! Where light comes from, and how a point of a surface finds it: next-event estimation.

use std::f32::consts::PI;

use bevy::math::{Vec2, Vec3};

use super::texture::Cubemap;

/// A light of Bevy's.
#[derive(Clone, Copy, Debug)]
pub(super) enum Light {
    /// Lux, and the direction in which the light travels.
    Directional { lux: Vec3, direction: Vec3 },
    /// A point or a spot.
    Point {
        position: Vec3,
        candela: Vec3,
        range: f32,
        /// Axis of the cone and the cosines of its inner and outer angle.
        spot: Option<(Vec3, f32, f32)>,
    },
    /// One side of a rectangle.
    Rect {
        center: Vec3,
        /// Half of its width and of its height, as vectors.
        half: [Vec3; 2],
        /// Unit vector to where it shines.
        normal: Vec3,
        nits: Vec3,
        range: f32,
    },
}

/// Light that arrives at a point from one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrival {
    /// Unit vector to where it comes from.
    pub direction: Vec3,
    /// Metres; infinite for what is infinitely far away.
    pub distance: f32,
    /// Radiance over density for lights with an area, irradiance on a plane that faces it for those
    /// without.
    pub light: Vec3,
    /// Density of the direction, per steradian; `None` where no other way leads there.
    pub pdf: Option<f32>,
}

/// Bevy's smooth end of a light's range (`getRangeFalloff`).
fn range_falloff(distance2: f32, range: f32) -> f32 {
    let factor = distance2 / (range * range).max(1e-8);
    (1.0 - factor * factor).clamp(0.0, 1.0).powi(2)
}

impl Light {
    /// Light that arrives at `p`, from a point of the light chosen by `u`.
    pub fn arrive(&self, p: Vec3, u: Vec2) -> Option<Arrival> {
        match *self {
            Self::Directional { lux, direction } => Some(Arrival {
                direction: -direction,
                distance: f32::INFINITY,
                light: lux,
                pdf: None,
            }),
            Self::Point {
                position,
                candela,
                range,
                spot,
            } => {
                let to = position - p;
                let distance2 = to.length_squared();
                let distance = distance2.sqrt();
                let direction = to / distance;
                let mut light = candela * range_falloff(distance2, range) / distance2.max(0.0001);
                if let Some((axis, inner, outer)) = spot {
                    let cone = (-direction.dot(axis) - outer) / (inner - outer).max(1e-4);
                    light *= cone.clamp(0.0, 1.0).powi(2);
                }
                (distance > 0.0 && light != Vec3::ZERO).then_some(Arrival {
                    direction,
                    distance,
                    light,
                    pdf: None,
                })
            }
            Self::Rect {
                center,
                half,
                normal,
                nits,
                range,
            } => {
                let s = u * 2.0 - 1.0;
                let to = center + half[0] * s.x + half[1] * s.y - p;
                let distance2 = to.length_squared();
                let distance = distance2.sqrt();
                let direction = to / distance;
                let cos = -direction.dot(normal);
                if !(cos > 0.0 && distance > 0.0) {
                    return None;
                }
                let area = 4.0 * half[0].length() * half[1].length();
                // The range falls off with the distance of the centre, as in Bevy.
                let falloff = range_falloff((center - p).length_squared(), range);
                Some(Arrival {
                    direction,
                    distance,
                    light: nits * falloff * (area * cos / distance2),
                    pdf: None,
                })
            }
        }
    }

    /// Lumens, roughly, for a scene of radius `radius`.
    pub fn power(&self, radius: f32) -> f32 {
        let (light, solid) = match self {
            Self::Directional { lux, .. } => (*lux, PI * radius * radius),
            Self::Point { candela, spot, .. } => {
                let cos = spot.map_or(-1.0, |(_, _, outer)| outer);
                (*candela, 2.0 * PI * (1.0 - cos))
            }
            Self::Rect { nits, half, .. } => {
                (*nits, PI * 4.0 * half[0].length() * half[1].length())
            }
        };
        light.element_sum() / 3.0 * solid
    }
}

/// Choices by weight.
#[derive(Clone, Debug, Default)]
pub(super) struct Distribution {
    /// Sums of the weights up to and with each, over the whole.
    cumulative: Vec<f32>,
}

impl Distribution {
    pub fn new(weights: impl IntoIterator<Item = f32>) -> Self {
        let mut sum = 0.0f64;
        let sums: Vec<f64> = weights
            .into_iter()
            .map(|w| {
                sum += f64::from(w.max(0.0));
                sum
            })
            .collect();
        if sum <= 0.0 {
            return Self::default();
        }
        Self {
            cumulative: sums.iter().map(|s| (s / sum) as f32).collect(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// The choice for `u`, its probability, and what is left of `u` as a new number in 0..1.
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        let i = self
            .cumulative
            .partition_point(|c| *c <= u)
            .min(self.cumulative.len() - 1);
        let p = self.probability(i);
        let before = self.cumulative[i] - p;
        (i, p, ((u - before) / p).clamp(0.0, 0.999_999_94))
    }

    pub fn probability(&self, i: usize) -> f32 {
        let before = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        self.cumulative[i] - before
    }
}

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
    pub map_from_world: bevy::math::Quat,
    /// Of cells of the sphere, in equal steps of azimuth and of height.
    distribution: Distribution,
}

/// Cells of the sphere along azimuth and height, from which skies are sampled.
const SKY_CELLS: [usize; 2] = [128, 64];

impl SkyMap {
    pub fn new(map: Cubemap, scale: f32, map_from_world: bevy::math::Quat) -> Self {
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
    fn choices_follow_their_weights() {
        let d = Distribution::new([1.0, 0.0, 3.0]);
        assert_eq!(d.sample(0.1).0, 0);
        assert_eq!(d.sample(0.3).0, 2);
        assert!((d.probability(2) - 0.75).abs() < 1e-6);
        let (_, _, rest) = d.sample(0.625);
        assert!((rest - 0.5).abs() < 1e-5);
        assert!(Distribution::new([0.0, -1.0]).is_empty());
    }

    #[test]
    fn directions_find_their_cells() {
        for cell in 0..SKY_CELLS[0] * SKY_CELLS[1] {
            assert_eq!(direction_cell(cell_direction(cell, Vec2::splat(0.5))), cell);
        }
    }

    /// On the axis of a spot, E = I / d^2; half-way between the angles, a quarter of that (Bevy squares).
    #[test]
    fn a_spot_is_as_bright_as_its_intensity() {
        let spot = Light::Point {
            position: Vec3::Y * 2.0,
            candela: Vec3::splat(100.0),
            range: 1e6,
            spot: Some((Vec3::NEG_Y, 0.9, 0.5)),
        };
        let on_axis = spot.arrive(Vec3::ZERO, Vec2::ZERO).unwrap();
        assert!((on_axis.light.x - 25.0).abs() < 1e-4);
        // Cosine 0.7 to the axis.
        let p = Vec3::new(2.0 * (1.0f32 / 0.49 - 1.0).sqrt(), 0.0, 0.0);
        let beside = spot.arrive(p, Vec2::ZERO).unwrap();
        let distance2 = 4.0 / 0.49;
        assert!((beside.light.x - 100.0 / distance2 * 0.25).abs() < 1e-3);
    }
}
