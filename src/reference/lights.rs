//! Where light comes from, and how a point of a surface finds it: next-event estimation.

use std::f32::consts::PI;

use bevy::math::{Vec2, Vec3};

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

    /// Whether its light arrives from more than one place.
    pub fn has_extent(&self) -> bool {
        match self {
            Self::Directional { .. } | Self::Point { .. } => false,
            Self::Rect { .. } => true,
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

#[cfg(test)]
mod tests {
    use super::*;

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
