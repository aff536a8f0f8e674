//! Faces that shine, and how points of them are found by next-event estimation.

use std::{collections::HashMap, f32::consts::PI};

use bevy::math::{Vec2, Vec3};

use super::{
    distribution::Distribution,
    geometry::{Geometry, Hit, mix},
    material::Materials,
};

/// All faces that shine, chosen by their power.
pub(super) struct Emitters {
    faces: Vec<u32>,
    choice: Distribution,
    /// Index in `faces`.
    index_of: HashMap<u32, usize>,
    /// Lumens of all together, roughly.
    pub power: f32,
}

impl Emitters {
    pub fn new(geometry: &Geometry, materials: &Materials) -> Self {
        let mut faces = Vec::new();
        let mut powers = Vec::new();
        for (i, face) in geometry.faces.iter().enumerate() {
            let brightness = materials.brightness(face);
            if brightness > 0.0 && !face.facing.camera_only && face.area() > 0.0 {
                faces.push(i as u32);
                powers.push(brightness * face.area());
            }
        }
        Self {
            index_of: faces
                .iter()
                .enumerate()
                .map(|(i, face)| (*face, i))
                .collect(),
            faces,
            choice: Distribution::new(powers.iter().copied()),
            power: PI * powers.iter().sum::<f32>() / 3.0,
        }
    }

    /// A point of a face that shines, chosen by `u`: where, its face, and the density of such points per
    /// square metre.
    pub fn sample(&self, geometry: &Geometry, u: [f32; 2]) -> (Hit, Vec3, f32) {
        let (i, p, rest) = self.choice.sample(u[0]);
        let index = self.faces[i];
        let face = &geometry.faces[index as usize];
        let root = rest.sqrt();
        let barycentric = Vec2::new(root * (1.0 - u[1]), root * u[1]);
        let hit = Hit {
            face: index,
            distance: 0.0,
            barycentric,
        };
        (hit, mix(face.corners, barycentric), p / face.area())
    }

    /// Density with which [`sample`](Self::sample) finds points of a face, per square metre.
    pub fn density(&self, geometry: &Geometry, face: u32) -> f32 {
        self.index_of.get(&face).map_or(0.0, |i| {
            self.choice.probability(*i) / geometry.faces[face as usize].area()
        })
    }
}
