//! The Bevy world, as the path tracer sees it.

use std::{collections::HashMap, f32::consts::PI, fmt};

use bevy::{
    asset::{AssetId, Assets, Handle},
    camera::{
        Camera,
        primitives::Aabb,
        visibility::{InheritedVisibility, RenderLayers, VisibilityRange},
    },
    color::{Color, ColorToComponents},
    ecs::prelude::*,
    image::Image,
    light::{
        AmbientLight, DirectionalLight, EnvironmentMapLight, GlobalAmbientLight, PointLight,
        RectLight, Skybox, SpotLight,
    },
    log::warn,
    material::AlphaMode,
    math::{Affine2, Affine3A, Mat4, Quat, Vec2, Vec3, Vec3A, Vec4},
    mesh::{
        Indices, Mesh, Mesh3d, MeshVertexAttributeId, PrimitiveTopology, UvChannel,
        VertexAttributeValues,
        morph::{MeshMorphWeights, MorphWeights},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    pbr::{MeshMaterial3d, StandardMaterial},
    render::render_resource::Face as CullFace,
    transform::components::GlobalTransform,
};

use super::{
    bsdf::Surface,
    geometry::{Face, Facing, Geometry, Hit},
    lights::{Distribution, Light, Sky, SkyMap},
    texture::{Cubemap, Texture},
};
use crate::{
    camera::{GiCamera, PrimaryGiCamera},
    scene::world::{
        casters::NotGiCaster,
        viewers::{Viewer, Viewers},
    },
    settings::{EmissiveUnits, GiSettings, GiSky},
};

/// A texture of a material, and which texture coordinates it takes.
#[derive(Clone, Copy, Debug)]
struct Slot {
    texture: u32,
    channel: usize,
}

/// A `StandardMaterial`.
#[derive(Debug)]
struct Material {
    base_color: Vec4,
    base_color_texture: Option<Slot>,
    /// Nits: what it lights its surroundings with, and what a camera sees of it.
    emission: Vec3,
    emission_seen: Vec3,
    emission_texture: Option<Slot>,
    roughness: f32,
    metallic: f32,
    metallic_roughness_texture: Option<Slot>,
    reflectance: Vec3,
    normal_texture: Option<(Slot, bool)>,
    uv_transform: Affine2,
    /// Alpha below which there is nothing.
    mask: Option<f32>,
    unlit: bool,
}

/// Everything that light paths meet. Made from a world by [`ReferenceScene::new`]; it does not change
/// with the world afterwards.
pub struct ReferenceScene {
    pub(super) geometry: Geometry,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    pub(super) lights: Vec<Light>,
    /// For each light, sets of render layers that do not stand in its way, a bit each: a mesh casts shadows
    /// in the light of those lights with which it shares a layer, as in Bevy.
    pub(super) passes: Vec<u64>,
    pub(super) sky: Sky,
    /// Faces that shine, and how they are chosen.
    emitters: Vec<u32>,
    emitter_choice: Distribution,
    /// Index in `emitters` by face, +1.
    emitter_of_face: HashMap<u32, u32>,
    /// Of kinds of light: each of `lights`, then all emitters together, then the sky.
    pub(super) light_choice: Distribution,
    /// Whether next-event estimation takes random numbers: not where all light is that of one point.
    pub(super) light_is_drawn: bool,
    /// What could not be taken over, in words.
    warnings: Vec<String>,
}

/// What it was made of; the rest follows from that.
impl fmt::Debug for ReferenceScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ReferenceScene")
            .field("faces", &self.geometry.faces)
            .field("materials", &self.materials)
            .field("textures", &self.textures)
            .field("lights", &self.lights)
            .field("passes", &self.passes)
            .field("sky", &self.sky)
            .finish_non_exhaustive()
    }
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

impl ReferenceScene {
    /// Takes over the world as it stands: meshes with a `StandardMaterial` and lights that a GI camera would
    /// see if it looked there, and the sky. Transforms must have been propagated.
    pub fn new(world: &mut World) -> Self {
        let settings = world
            .get_resource::<GiSettings>()
            .cloned()
            .unwrap_or_default();
        let (exposure, sky) = camera_sky(world, &settings);
        let mut builder = Builder {
            exposure: exposure.max(1e-12),
            units: settings.emissive_units,
            ..Default::default()
        };
        let mut cameras = world.query_filtered::<Viewer, With<GiCamera>>();
        let viewers = Viewers::new(primary(world), cameras.iter(world));
        builder.meshes(world, &viewers);
        let (lights, layers): (Vec<_>, Vec<_>) = lights(world, &viewers).into_iter().unzip();
        let passes = layers.iter().map(|layers| builder.passes(layers)).collect();
        let mut warnings = builder.warnings;
        let sky = sky.unwrap_or_else(|why| {
            warnings.push(format!("the sky is left out: {why}"));
            Sky::Constant(Vec3::ZERO)
        });
        for warning in &warnings {
            warn!("reference: {warning}");
        }
        Self::assemble(
            builder.faces,
            builder.materials,
            builder.textures,
            lights,
            passes,
            sky,
            warnings,
        )
    }

    fn assemble(
        faces: Vec<Face>,
        materials: Vec<Material>,
        textures: Vec<Texture>,
        lights: Vec<Light>,
        passes: Vec<u64>,
        sky: Sky,
        warnings: Vec<String>,
    ) -> Self {
        let geometry = Geometry::new(faces);
        let mut emitters = Vec::new();
        let mut powers = Vec::new();
        for (i, face) in geometry.faces.iter().enumerate() {
            let material = &materials[face.material as usize];
            let texture = material.emission_texture.map_or(Vec3::ONE, |slot| {
                textures[slot.texture as usize].mean().truncate()
            });
            let emission = (material.emission * texture).element_sum();
            if emission > 0.0 && !face.facing.camera_only && face.area() > 0.0 {
                emitters.push(i as u32);
                powers.push(emission * face.area());
            }
        }
        let emitter_choice = Distribution::new(powers.iter().copied());
        let radius = geometry
            .faces
            .iter()
            .flat_map(|face| face.corners)
            .fold(0.0f32, |r, p| r.max(p.length()));
        // Lights by their power, and each at least sometimes: what is near is not known here.
        let emitted = PI * powers.iter().sum::<f32>() / 3.0;
        let map = if sky.is_sampled() { 1.0 } else { 0.0 };
        let mut weights: Vec<f32> = lights.iter().map(|light| light.power(radius)).collect();
        weights.push(emitted);
        let total: f32 = weights.iter().sum();
        let sources = weights.iter().filter(|w| **w > 0.0).count().max(1) as f32;
        for weight in &mut weights {
            if *weight > 0.0 {
                *weight = 0.5 * *weight / total + 0.5 / sources;
            }
        }
        let others: f32 = weights.iter().sum();
        weights.push(map * others.max(1e-6));
        let chosen = weights.iter().filter(|w| **w > 0.0).count();
        let has_extent = |light: &Light| matches!(light, Light::Rect { .. });
        let extended = emitted > 0.0 || map > 0.0 || lights.iter().any(has_extent);
        Self {
            light_is_drawn: chosen > 1 || extended,
            light_choice: Distribution::new(weights),
            emitter_of_face: emitters
                .iter()
                .enumerate()
                .map(|(i, face)| (*face, i as u32 + 1))
                .collect(),
            geometry,
            materials,
            textures,
            lights,
            passes,
            sky,
            emitters,
            emitter_choice,
            warnings,
        }
    }

    /// Triangles.
    pub fn triangles(&self) -> usize {
        self.geometry.faces.len()
    }

    /// What could not be taken over from the world, in words.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn uv(&self, face: &Face, barycentric: Vec2, channel: usize, transform: Affine2) -> Vec2 {
        let [a, b, c] = face.uvs[channel];
        transform.transform_point2(mix(a, b, c, barycentric))
    }

    fn sample(&self, slot: Slot, face: &Face, barycentric: Vec2, material: &Material) -> Vec4 {
        let uv = self.uv(face, barycentric, slot.channel, material.uv_transform);
        self.textures[slot.texture as usize].sample(uv)
    }

    fn base_color(&self, face: &Face, barycentric: Vec2, material: &Material) -> Vec4 {
        let [a, b, c] = face.colors.map(Vec4::from_array);
        let color = mix(a, b, c, barycentric) * material.base_color;
        match material.base_color_texture {
            Some(slot) => color * self.sample(slot, face, barycentric, material),
            None => color,
        }
    }

    /// Whether there is something at a point of a masked face.
    pub(super) fn is_opaque(&self, hit: &Hit) -> bool {
        let face = &self.geometry.faces[hit.face as usize];
        let material = &self.materials[face.material as usize];
        material
            .mask
            .is_none_or(|mask| self.base_color(face, hit.barycentric, material).w >= mask)
    }

    /// The surface at a hit, for what comes along `direction`.
    pub(super) fn vertex(&self, hit: &Hit, direction: Vec3) -> Vertex {
        let face = &self.geometry.faces[hit.face as usize];
        let material = &self.materials[face.material as usize];
        let at = hit.barycentric;
        let [a, b, c] = face.corners;
        let mut geometric = face.cross().normalize_or(Vec3::Y);
        let side = if geometric.dot(direction) > 0.0 {
            -1.0
        } else {
            1.0
        };
        geometric *= side;
        let [na, nb, nc] = face.normals;
        let mut shading = mix(na, nb, nc, at).normalize_or(geometric * side) * side;
        if let Some((slot, flip)) = material.normal_texture {
            let mut n = self.sample(slot, face, at, material).truncate() * 2.0 - 1.0;
            if flip {
                n.y = -n.y;
            }
            let [ta, tb, tc] = face.tangents.map(|(t, _)| t);
            let tangent = mix(ta, tb, tc, at);
            // As MikkTSpace has it: nothing is normalized before the sum.
            let bitangent = (shading * side).cross(tangent) * face.tangents[0].1;
            let mapped = n.x * tangent + n.y * bitangent + n.z * shading * side;
            shading = (mapped * side).normalize_or(shading);
        }
        let color = self.base_color(face, at, material);
        let (mut roughness, mut metallic) = (material.roughness, material.metallic);
        if let Some(slot) = material.metallic_roughness_texture {
            let texel = self.sample(slot, face, at, material);
            roughness *= texel.y;
            metallic *= texel.z;
        }
        let texture = material.emission_texture.map_or(Vec3::ONE, |slot| {
            self.sample(slot, face, at, material).truncate()
        });
        let base_color = color.truncate().clamp(Vec3::ZERO, Vec3::ONE);
        let (emission, emission_seen) = if material.unlit {
            (
                material.emission * base_color,
                material.emission_seen * base_color,
            )
        } else {
            (
                material.emission * texture,
                material.emission_seen * texture,
            )
        };
        let black = material.unlit;
        Vertex {
            position: mix(a, b, c, at),
            geometric_normal: geometric,
            shading_normal: shading,
            surface: Surface {
                base_color: if black { Vec3::ZERO } else { base_color },
                perceptual_roughness: roughness,
                metallic,
                reflectance: if black {
                    Vec3::ZERO
                } else {
                    material.reflectance
                },
            },
            emission,
            emission_seen,
        }
    }

    /// A point of a face that shines, chosen by `u`: where, its face, and the density of such points per
    /// square metre.
    pub(super) fn emitter(&self, u: [f32; 2]) -> (Hit, Vec3, f32) {
        let (i, p, rest) = self.emitter_choice.sample(u[0]);
        let index = self.emitters[i];
        let face = &self.geometry.faces[index as usize];
        let root = rest.sqrt();
        let barycentric = Vec2::new(root * (1.0 - u[1]), root * u[1]);
        let [a, b, c] = face.corners;
        let hit = Hit {
            face: index,
            distance: 0.0,
            barycentric,
        };
        (hit, mix(a, b, c, barycentric), p / face.area())
    }

    /// Whether a face is met from `direction` at all.
    pub(super) fn is_met(&self, face: u32, direction: Vec3) -> bool {
        let face = &self.geometry.faces[face as usize];
        if face.cross().dot(direction) < 0.0 {
            face.facing.front
        } else {
            face.facing.back
        }
    }

    /// Density of points of a face among those of all that shine, per square metre.
    pub(super) fn emitter_density(&self, face: u32) -> f32 {
        match self.emitter_of_face.get(&face) {
            Some(i) => {
                let p = self.emitter_choice.probability(*i as usize - 1);
                p / self.geometry.faces[face as usize].area()
            }
            None => 0.0,
        }
    }
}

/// Linear interpolation over a triangle.
fn mix<T>(a: T, b: T, c: T, at: Vec2) -> T
where
    T: std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
{
    a * (1.0 - at.x - at.y) + b * at.x + c * at.y
}

fn linear(color: Color) -> Vec3 {
    color.to_linear().to_vec3()
}

/// Lights of all kinds, with their render layers.
fn lights(world: &mut World, viewers: &Viewers) -> Vec<(Light, RenderLayers)> {
    // Bevy divides the lumens of points and spots alike by the whole sphere.
    let candela = |color, lumens: f32| linear(color) * lumens / (4.0 * PI);
    let mut lights = Vec::new();
    collect(
        world,
        viewers,
        &mut lights,
        |light: &DirectionalLight, transform| Light::Directional {
            lux: linear(light.color) * light.illuminance,
            direction: transform.forward().into(),
        },
    );
    collect(
        world,
        viewers,
        &mut lights,
        |light: &PointLight, transform| Light::Point {
            position: transform.translation(),
            candela: candela(light.color, light.intensity),
            range: light.range,
            spot: None,
        },
    );
    collect(
        world,
        viewers,
        &mut lights,
        |light: &SpotLight, transform| Light::Point {
            position: transform.translation(),
            candela: candela(light.color, light.intensity),
            range: light.range,
            spot: Some((
                transform.forward().into(),
                light.inner_angle.cos(),
                light.outer_angle.cos(),
            )),
        },
    );
    collect(
        world,
        viewers,
        &mut lights,
        |light: &RectLight, transform| {
            let matrix = transform.affine().matrix3;
            let half = [
                Vec3::from(matrix.x_axis) * light.width * 0.5,
                Vec3::from(matrix.y_axis) * light.height * 0.5,
            ];
            let area = 4.0 * half[0].length() * half[1].length();
            Light::Rect {
                center: transform.translation(),
                half,
                normal: transform.forward().into(),
                nits: linear(light.color) * light.intensity / (PI * area.max(1e-12)),
                range: light.range,
            }
        },
    );
    lights
}

/// The lights of one of Bevy's kinds that are seen.
fn collect<L: Component>(
    world: &mut World,
    viewers: &Viewers,
    lights: &mut Vec<(Light, RenderLayers)>,
    convert: impl Fn(&L, &GlobalTransform) -> Light,
) {
    type Seen<'a, L> = (
        &'a L,
        &'a GlobalTransform,
        &'a InheritedVisibility,
        Option<&'a RenderLayers>,
    );
    let mut query = world.query::<Seen<L>>();
    for (light, transform, visible, layers) in query.iter(world) {
        let layers = layers.unwrap_or_default();
        if visible.get() && viewers.see(layers) {
            lights.push((convert(light, transform), layers.clone()));
        }
    }
}

type CameraSky = (
    Option<&'static bevy::camera::Exposure>,
    Option<&'static EnvironmentMapLight>,
    Option<&'static Skybox>,
    Option<&'static AmbientLight>,
);

/// The primary GI camera, in a world that may have none of the plugins.
fn primary(world: &mut World) -> PrimaryGiCamera {
    let mut cameras = world.query_filtered::<(Entity, &Camera), With<GiCamera>>();
    PrimaryGiCamera::of(cameras.iter(world))
}

/// Exposure of the primary GI camera, and the sky as [`GiSettings::sky`] has it.
fn camera_sky(world: &mut World, settings: &GiSettings) -> (f32, Result<Sky, String>) {
    let primary = primary(world).0;
    let mut query = world.query::<CameraSky>();
    let camera = primary.and_then(|camera| query.get(world, camera).ok());
    let exposure = camera
        .and_then(|(exposure, ..)| exposure.copied())
        .unwrap_or_default()
        .exposure();
    let map = |image: &Handle<Image>, scale: f32, rotation: Quat| -> Result<Sky, String> {
        let images = world.resource::<Assets<Image>>();
        let image = images.get(image).ok_or("its image is not loaded")?;
        let map = Cubemap::new(image)?;
        let map = SkyMap::new(map, scale, rotation.inverse());
        Ok(Sky::Map(Box::new(map)))
    };
    let sky = match (settings.sky, camera) {
        (GiSky::Constant(color), _) => Ok(Sky::Constant(color.to_vec3())),
        (GiSky::Black, _) | (GiSky::Camera, None) => Ok(Sky::Constant(Vec3::ZERO)),
        (GiSky::Camera, Some((_, environment, skybox, ambient))) => {
            if let Some(light) = environment {
                map(&light.specular_map, light.intensity, light.rotation)
            } else if let Some((skybox, image)) = skybox.and_then(|s| Some((s, s.image.as_ref()?)))
            {
                map(image, skybox.brightness, skybox.rotation)
            } else if settings.replace_ambient {
                let global = world.get_resource::<GlobalAmbientLight>();
                let (color, brightness) = match (ambient, global) {
                    (Some(a), _) => (a.color, a.brightness),
                    (None, Some(a)) => (a.color, a.brightness),
                    (None, None) => Default::default(),
                };
                Ok(Sky::Constant(linear(color) * brightness))
            } else {
                Ok(Sky::Constant(Vec3::ZERO))
            }
        }
    };
    (exposure, sky)
}

type MeshData = (
    &'static Mesh3d,
    &'static MeshMaterial3d<StandardMaterial>,
    &'static GlobalTransform,
    &'static InheritedVisibility,
    Has<NotGiCaster>,
    Option<&'static SkinnedMesh>,
    Option<&'static MeshMorphWeights>,
    Option<&'static RenderLayers>,
    (Option<&'static VisibilityRange>, Option<&'static Aabb>),
);

/// Collects faces, materials and textures.
#[derive(Default)]
struct Builder {
    exposure: f32,
    units: EmissiveUnits,
    faces: Vec<Face>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    known_materials: HashMap<AssetId<StandardMaterial>, Option<u32>>,
    known_textures: HashMap<AssetId<Image>, Option<u32>>,
    /// The sets of render layers that meshes have.
    layers: Vec<RenderLayers>,
    warnings: Vec<String>,
}

impl Builder {
    fn meshes(&mut self, world: &mut World, viewers: &Viewers) {
        let mut query = world.query::<MeshData>();
        let world = &*world;
        let (Some(meshes), Some(materials), Some(images)) = (
            world.get_resource::<Assets<Mesh>>(),
            world.get_resource::<Assets<StandardMaterial>>(),
            world.get_resource::<Assets<Image>>(),
        ) else {
            return;
        };
        for (mesh, handle, transform, visible, camera_only, skin, morph, layers, lod) in
            query.iter(world)
        {
            let layers = layers.unwrap_or_default();
            let affine = transform.affine();
            if !visible.get() || !viewers.see(layers) || !affine.is_finite() {
                continue;
            }
            if let (Some(range), aabb) = lod {
                let center = aabb.filter(|_| range.use_aabb).map(|aabb| aabb.center);
                let center = affine.transform_point3a(center.unwrap_or_default());
                if !viewers.see_level(range, center) {
                    continue;
                }
            }
            let (Some(mesh), Some(standard)) = (meshes.get(&mesh.0), materials.get(&handle.0))
            else {
                continue;
            };
            let Some(material) = self.material(handle.0.id(), standard, images) else {
                continue;
            };
            let facing = Facing {
                front: standard.cull_mode != Some(CullFace::Front),
                back: standard.cull_mode != Some(CullFace::Back),
                camera_only,
                layers: self.layer_set(layers),
                masked: self.materials[material as usize].mask.is_some(),
            };
            let weights = morph.and_then(|morph| match morph {
                MeshMorphWeights::Value { weights } => Some(&weights[..]),
                MeshMorphWeights::Reference(entity) => world
                    .get::<MorphWeights>(*entity)
                    .map(MorphWeights::weights),
            });
            let joints = skin.and_then(|skin| joints(world, skin));
            let placed = Placed {
                transform: affine,
                joints,
                weights,
                material,
                facing,
            };
            if let Err(why) = placed.faces(mesh, &mut self.faces) {
                self.warn(format!("a mesh is left out: {why}"));
            }
        }
    }

    /// The number of a set of render layers.
    fn layer_set(&mut self, layers: &RenderLayers) -> u32 {
        let known = self.layers.iter().position(|known| known == layers);
        known.unwrap_or_else(|| {
            self.layers.push(layers.clone());
            self.layers.len() - 1
        }) as u32
    }

    /// Sets of layers, a bit each, that share none with a light's.
    fn passes(&self, light: &RenderLayers) -> u64 {
        let sets = self.layers.iter().take(64).enumerate();
        let passing = sets.filter(|(_, layers)| !layers.intersects(light));
        passing.fold(0, |bits, (i, _)| bits | 1 << i)
    }

    fn warn(&mut self, warning: String) {
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }

    /// The index of a material; `None` if it is see-through.
    fn material(
        &mut self,
        id: AssetId<StandardMaterial>,
        m: &StandardMaterial,
        images: &Assets<Image>,
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
            self.warn("see-through materials are left out".into());
            self.known_materials.insert(id, None);
            return None;
        };
        let mut slot = |texture: &Option<Handle<Image>>, channel: &UvChannel| {
            let texture = self.texture(texture.as_ref()?, images)?;
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
        let emissive = m.emissive.to_vec3();
        // As Bevy shows it: `emissive * mix(1, exposure, weight)` against `nits * exposure`; its deferred
        // renderer loses the weight, which is 0 by default.
        let weight = m.emissive_exposure_weight;
        let seen = (1.0 - weight) / self.exposure + weight;
        let (emission, emission_seen) = match (m.unlit, self.units) {
            (false, EmissiveUnits::AsSeen) => (emissive * seen, emissive * seen),
            (false, EmissiveUnits::Nits) => (emissive, emissive),
            (true, EmissiveUnits::AsSeen) => (
                Vec3::splat(1.0 / self.exposure),
                Vec3::splat(1.0 / self.exposure),
            ),
            (true, EmissiveUnits::Nits) => (Vec3::ZERO, Vec3::splat(1.0 / self.exposure)),
        };
        let index = self.materials.len() as u32;
        self.materials.push(Material {
            base_color: Vec4::from_array(m.base_color.to_linear().to_f32_array()),
            base_color_texture,
            emission: emission.max(Vec3::ZERO),
            emission_seen: emission_seen.max(Vec3::ZERO),
            emission_texture,
            roughness: m.perceptual_roughness,
            metallic: m.metallic,
            metallic_roughness_texture,
            reflectance: m.reflectance * linear(m.specular_tint),
            normal_texture,
            uv_transform: m.uv_transform,
            mask,
            unlit: m.unlit,
        });
        self.known_materials.insert(id, Some(index));
        Some(index)
    }

    fn texture(&mut self, handle: &Handle<Image>, images: &Assets<Image>) -> Option<u32> {
        if let Some(known) = self.known_textures.get(&handle.id()) {
            return *known;
        }
        let texture = images
            .get(handle)
            .ok_or("it is not loaded".into())
            .and_then(Texture::new);
        let index = match texture {
            Ok(texture) => {
                self.textures.push(texture);
                Some(self.textures.len() as u32 - 1)
            }
            Err(why) => {
                self.warn(format!("a texture is left out: {why}"));
                None
            }
        };
        self.known_textures.insert(handle.id(), index);
        index
    }
}

/// World matrices of a skin's joints.
fn joints(world: &World, skin: &SkinnedMesh) -> Option<Vec<Mat4>> {
    let poses = world
        .get_resource::<Assets<SkinnedMeshInverseBindposes>>()?
        .get(&skin.inverse_bindposes)?;
    skin.joints
        .iter()
        .zip(poses.iter())
        .map(|(joint, pose)| Some(world.get::<GlobalTransform>(*joint)?.to_matrix() * *pose))
        .collect()
}

/// A mesh in its place.
struct Placed<'a> {
    transform: Affine3A,
    joints: Option<Vec<Mat4>>,
    weights: Option<&'a [f32]>,
    material: u32,
    facing: Facing,
}

impl Placed<'_> {
    /// Adds the triangles of a mesh, as Bevy's vertex shader places them.
    ///
    /// Long, as it reads every attribute that Bevy knows once, and uses all of them for each vertex.
    fn faces(&self, mesh: &Mesh, out: &mut Vec<Face>) -> Result<(), String> {
        let topology = mesh.primitive_topology();
        if !matches!(
            topology,
            PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip
        ) {
            return Err("it has lines or points in place of triangles".into());
        }
        let attribute = |id: MeshVertexAttributeId| mesh.try_attribute_option(id).ok().flatten();
        let vec3 = |id: MeshVertexAttributeId| match attribute(id) {
            Some(VertexAttributeValues::Float32x3(values)) => Some(values),
            _ => None,
        };
        let positions = vec3(Mesh::ATTRIBUTE_POSITION.id)
            .ok_or("its positions are on the GPU only, or not there")?;
        let normals = vec3(Mesh::ATTRIBUTE_NORMAL.id);
        let uvs =
            [Mesh::ATTRIBUTE_UV_0.id, Mesh::ATTRIBUTE_UV_1.id].map(|id| match attribute(id) {
                Some(VertexAttributeValues::Float32x2(values)) => Some(values),
                _ => None,
            });
        let tangents = match attribute(Mesh::ATTRIBUTE_TANGENT.id) {
            Some(VertexAttributeValues::Float32x4(values)) => Some(values),
            _ => None,
        };
        let colors = attribute(Mesh::ATTRIBUTE_COLOR.id);
        let color = |i: usize| match colors {
            Some(VertexAttributeValues::Float32x4(values)) => values[i],
            Some(VertexAttributeValues::Unorm8x4(values)) => {
                values[i].map(|b| f32::from(b) / 255.0)
            }
            _ => [1.0; 4],
        };
        let joint_indices = match attribute(Mesh::ATTRIBUTE_JOINT_INDEX.id) {
            Some(VertexAttributeValues::Uint16x4(values)) => Some(values),
            _ => None,
        };
        let joint_weights = match attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT.id) {
            Some(VertexAttributeValues::Float32x4(values)) => Some(values),
            _ => None,
        };
        let targets = mesh.get_morph_targets();

        // Position, normal and tangent of a vertex in the world, and whether it is mirrored on the way there.
        let vertex = |i: usize| -> (Vec3, Option<Vec3>, Option<(Vec3, f32)>, bool) {
            let mut p = Vec3::from_array(positions[i]);
            let mut n = normals.map(|n| Vec3::from_array(n[i]));
            let mut t = tangents.map(|t| (Vec3::from_slice(&t[i][..3]), t[i][3]));
            if let (Some(weights), Some(targets)) = (self.weights, targets) {
                for (target, weight) in weights.iter().enumerate() {
                    if let Some(delta) = targets.get(target * positions.len() + i) {
                        p += delta.position * *weight;
                        n = n.map(|n| n + delta.normal * *weight);
                        t = t.map(|(t, sign)| (t + delta.tangent * *weight, sign));
                    }
                }
            }
            let skinned = match (&self.joints, joint_indices, joint_weights) {
                (Some(joints), Some(indices), Some(weights)) => {
                    let mut matrix = Mat4::ZERO;
                    for (joint, weight) in indices[i].iter().zip(weights[i]) {
                        if let Some(joint) = joints.get(*joint as usize) {
                            matrix += *joint * weight;
                        }
                    }
                    Affine3A::from_mat4(matrix)
                }
                _ => self.transform,
            };
            let mirrored = skinned.matrix3.determinant() < 0.0;
            let turn = if mirrored { -1.0 } else { 1.0 };
            let normal_matrix = skinned.matrix3.inverse().transpose();
            let direction =
                |v: Vec3| Vec3::from(skinned.matrix3 * Vec3A::from(v)).normalize_or_zero();
            (
                skinned.transform_point3(p),
                n.map(|n| Vec3::from(normal_matrix * Vec3A::from(n)).normalize_or_zero()),
                t.map(|(t, sign)| (direction(t), sign * turn)),
                mirrored,
            )
        };
        let mut face = |mut corners: [usize; 3]| {
            if corners.iter().any(|i| *i >= positions.len()) {
                return;
            }
            let mut vertices = corners.map(vertex);
            let mut facing = self.facing;
            if vertices[0].3 {
                // What is mirrored runs the other way round; its front stays where its normals point.
                corners.swap(1, 2);
                vertices.swap(1, 2);
                facing = facing.turned();
            }
            let positions = vertices.map(|(p, ..)| p);
            let cross = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
            if !positions.iter().all(|p| p.is_finite()) || cross.length_squared() == 0.0 {
                return;
            }
            let flat = cross.normalize();
            out.push(Face {
                corners: positions,
                normals: vertices.map(|(_, n, ..)| n.unwrap_or(flat)),
                uvs: uvs.map(|uvs| {
                    corners.map(|i| uvs.map_or(Vec2::ZERO, |uvs| Vec2::from_array(uvs[i])))
                }),
                tangents: vertices.map(|(_, _, t, _)| t.unwrap_or((Vec3::ZERO, 1.0))),
                colors: corners.map(color),
                material: self.material,
                facing,
            });
        };
        match mesh.try_indices_option().ok().flatten() {
            Some(_) if topology == PrimitiveTopology::TriangleStrip => {
                return Err("Bevy 0.19 does not draw triangle strips with indices".into());
            }
            None if topology == PrimitiveTopology::TriangleStrip => {
                for i in 2..positions.len() {
                    // Every other triangle runs the other way round.
                    let flip = i % 2;
                    face([i - 2, i - 1 + flip, i - flip]);
                }
            }
            Some(Indices::U16(indices)) => {
                for i in indices.chunks_exact(3) {
                    face([i[0], i[1], i[2]].map(usize::from));
                }
            }
            Some(Indices::U32(indices)) => {
                for i in indices.chunks_exact(3) {
                    face([i[0], i[1], i[2]].map(|i| i as usize));
                }
            }
            None => {
                for i in 0..positions.len() / 3 {
                    face([3 * i, 3 * i + 1, 3 * i + 2]);
                }
            }
        }
        Ok(())
    }
}
