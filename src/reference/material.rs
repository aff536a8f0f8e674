//! Materials, and the surfaces that they make of faces.

use bevy::math::{Affine2, Vec2, Vec3, Vec4};

use super::{
    bsdf::Surface,
    geometry::{Face, mix},
    texture::Texture,
};

/// A texture of a material, and which texture coordinates it takes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    pub texture: u32,
    pub channel: usize,
}

/// A `StandardMaterial`.
#[derive(Debug)]
pub(super) struct Material {
    pub base_color: Vec4,
    pub base_color_texture: Option<Slot>,
    /// Nits: what it lights its surroundings with, and what a camera sees of it.
    pub emission: Vec3,
    pub emission_seen: Vec3,
    pub emission_texture: Option<Slot>,
    pub roughness: f32,
    pub metallic: f32,
    pub metallic_roughness_texture: Option<Slot>,
    pub reflectance: Vec3,
    /// And whether its y is turned over.
    pub normal_texture: Option<(Slot, bool)>,
    pub uv_transform: Affine2,
    /// Alpha below which there is nothing.
    pub mask: Option<f32>,
    pub unlit: bool,
}

/// A point of a surface, as a path meets it.
pub(super) struct Vertex {
    pub position: Vec3,
    /// Of the triangle, on the side from which it is seen.
    pub geometric_normal: Vec3,
    pub shading_normal: Vec3,
    pub surface: Surface,
    /// Nits, as light and as seen; they differ for what is unlit.
    pub emission: Vec3,
    pub emission_seen: Vec3,
}

/// All materials of a scene, with their textures.
#[derive(Debug, Default)]
pub(super) struct Materials {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
}

impl Materials {
    fn of(&self, face: &Face) -> &Material {
        &self.materials[face.material as usize]
    }

    /// How brightly a face shines: nits, the mean of its texture, the sum of the colours.
    pub fn brightness(&self, face: &Face) -> f32 {
        let material = self.of(face);
        let texture = material.emission_texture.map_or(Vec3::ONE, |slot| {
            self.textures[slot.texture as usize].mean().truncate()
        });
        (material.emission * texture).element_sum()
    }

    /// Whether there is something at a point of a face.
    pub fn is_opaque(&self, face: &Face, at: Vec2) -> bool {
        let mask = self.of(face).mask;
        mask.is_none_or(|mask| self.base_color(face, at).w >= mask)
    }

    /// The surface at a point of a face, for what comes along `direction`.
    pub fn vertex(&self, face: &Face, at: Vec2, direction: Vec3) -> Vertex {
        let material = self.of(face);
        let normal = face.cross().normalize_or(Vec3::Y);
        let side = if normal.dot(direction) > 0.0 {
            -1.0
        } else {
            1.0
        };
        let base_color = self.base_color(face, at).truncate();
        let base_color = base_color.clamp(Vec3::ZERO, Vec3::ONE);
        let (mut roughness, mut metallic) = (material.roughness, material.metallic);
        if let Some(slot) = material.metallic_roughness_texture {
            let texel = self.sample(slot, face, at);
            roughness *= texel.y;
            metallic *= texel.z;
        }
        let shine = match material.emission_texture {
            _ if material.unlit => base_color,
            Some(slot) => self.sample(slot, face, at).truncate(),
            None => Vec3::ONE,
        };
        let reflected = |color: Vec3| if material.unlit { Vec3::ZERO } else { color };
        Vertex {
            position: mix(face.corners, at),
            geometric_normal: normal * side,
            shading_normal: self.shading_normal(face, at, normal, side),
            surface: Surface {
                base_color: reflected(base_color),
                perceptual_roughness: roughness,
                metallic,
                reflectance: reflected(material.reflectance),
            },
            emission: material.emission * shine,
            emission_seen: material.emission_seen * shine,
        }
    }

    /// On the side from which the face is seen: 1 for the one of its `normal`, -1 for the other.
    fn shading_normal(&self, face: &Face, at: Vec2, normal: Vec3, side: f32) -> Vec3 {
        let smooth = mix(face.normals, at).normalize_or(normal) * side;
        let Some((slot, flip)) = self.of(face).normal_texture else {
            return smooth;
        };
        let mut n = self.sample(slot, face, at).truncate() * 2.0 - 1.0;
        if flip {
            n.y = -n.y;
        }
        let tangent = mix(face.tangents.map(|(tangent, _)| tangent), at);
        // As MikkTSpace has it: nothing is normalized before the sum.
        let bitangent = (smooth * side).cross(tangent) * face.tangents[0].1;
        let mapped = n.x * tangent + n.y * bitangent + n.z * smooth * side;
        (mapped * side).normalize_or(smooth)
    }

    fn base_color(&self, face: &Face, at: Vec2) -> Vec4 {
        let material = self.of(face);
        let color = mix(face.colors.map(Vec4::from_array), at) * material.base_color;
        match material.base_color_texture {
            Some(slot) => color * self.sample(slot, face, at),
            None => color,
        }
    }

    fn sample(&self, slot: Slot, face: &Face, at: Vec2) -> Vec4 {
        let transform = self.of(face).uv_transform;
        let uv = transform.transform_point2(mix(face.uvs[slot.channel], at));
        self.textures[slot.texture as usize].sample(uv)
    }
}
