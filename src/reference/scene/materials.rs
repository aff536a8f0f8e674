//! Materials of the world, and their textures.

use std::collections::HashMap;

use bevy::{
    asset::{AssetId, Assets, Handle},
    color::ColorToComponents,
    image::Image,
    material::AlphaMode,
    math::{Vec3, Vec4},
    mesh::UvChannel,
    pbr::StandardMaterial,
};

use super::warnings::Warnings;
use crate::{
    reference::{
        material::{Material, Materials, Slot},
        texture::Texture,
    },
    settings::EmissiveUnits,
};

/// Takes each material and each texture over once.
pub(super) struct MaterialCollector {
    exposure: f32,
    units: EmissiveUnits,
    pub found: Materials,
    known_materials: HashMap<AssetId<StandardMaterial>, Option<u32>>,
    known_textures: HashMap<AssetId<Image>, Option<u32>>,
}

impl MaterialCollector {
    /// For a camera with that exposure.
    pub fn new(exposure: f32, units: EmissiveUnits) -> Self {
        Self {
            exposure,
            units,
            found: Materials::default(),
            known_materials: HashMap::new(),
            known_textures: HashMap::new(),
        }
    }

    /// The index of a material; `None` if it is see-through.
    pub fn material(
        &mut self,
        id: AssetId<StandardMaterial>,
        m: &StandardMaterial,
        images: &Assets<Image>,
        warnings: &mut Warnings,
    ) -> Option<u32> {
        if let Some(known) = self.known_materials.get(&id) {
            return *known;
        }
        let mask = match m.alpha_mode {
            AlphaMode::Opaque => Some(None),
            AlphaMode::Mask(cutoff) => Some(Some(cutoff)),
            AlphaMode::AlphaToCoverage => Some(Some(0.5)),
            _ => None,
        };
        let Some(mask) = mask.filter(|_| m.specular_transmission == 0.0) else {
            warnings.add("see-through materials are left out".into());
            self.known_materials.insert(id, None);
            return None;
        };
        let mut slot = |texture: &Option<Handle<Image>>, channel: &UvChannel| {
            let texture = self.texture(texture.as_ref()?, images, warnings)?;
            let channel = match channel {
                UvChannel::Uv0 => 0,
                UvChannel::Uv1 => 1,
            };
            Some(Slot { texture, channel })
        };
        let base_color_texture = slot(&m.base_color_texture, &m.base_color_channel);
        let emission_texture = slot(&m.emissive_texture, &m.emissive_channel);
        let metallic_roughness_texture =
            slot(&m.metallic_roughness_texture, &m.metallic_roughness_channel);
        let normal_texture =
            slot(&m.normal_map_texture, &m.normal_map_channel).map(|s| (s, m.flip_normal_map_y));
        let (emission, emission_seen) = self.emission(m);
        let index = self.found.materials.len() as u32;
        self.found.materials.push(Material {
            base_color: Vec4::from_array(m.base_color.to_linear().to_f32_array()),
            base_color_texture,
            emission: emission.max(Vec3::ZERO),
            emission_seen: emission_seen.max(Vec3::ZERO),
            emission_texture,
            roughness: m.perceptual_roughness,
            metallic: m.metallic,
            metallic_roughness_texture,
            reflectance: m.reflectance * m.specular_tint.to_linear().to_vec3(),
            normal_texture,
            uv_transform: m.uv_transform,
            mask,
            unlit: m.unlit,
        });
        self.known_materials.insert(id, Some(index));
        Some(index)
    }

    /// The index of a texture; `None` if it cannot be read.
    fn texture(
        &mut self,
        handle: &Handle<Image>,
        images: &Assets<Image>,
        warnings: &mut Warnings,
    ) -> Option<u32> {
        if let Some(known) = self.known_textures.get(&handle.id()) {
            return *known;
        }
        let texture = images
            .get(handle)
            .ok_or("it is not loaded".into())
            .and_then(Texture::new);
        let index = match texture {
            Ok(texture) => {
                self.found.textures.push(texture);
                Some(self.found.textures.len() as u32 - 1)
            }
            Err(why) => {
                warnings.add(format!("a texture is left out: {why}"));
                None
            }
        };
        self.known_textures.insert(handle.id(), index);
        index
    }

    /// Nits of a material, as light and as seen.
    fn emission(&self, m: &StandardMaterial) -> (Vec3, Vec3) {
        let emissive = m.emissive.to_vec3();
        // As Bevy shows it: `emissive * mix(1, exposure, weight)` against `nits * exposure`; its deferred
        // renderer loses the weight, which is 0 by default.
        let weight = m.emissive_exposure_weight;
        let seen = (1.0 - weight) / self.exposure + weight;
        let unlit = Vec3::splat(1.0 / self.exposure);
        match (m.unlit, self.units) {
            (false, EmissiveUnits::AsSeen) => (emissive * seen, emissive * seen),
            (false, EmissiveUnits::Nits) => (emissive, emissive),
            (true, EmissiveUnits::AsSeen) => (unlit, unlit),
            (true, EmissiveUnits::Nits) => (Vec3::ZERO, unlit),
        }
    }
}
