//! Writes the scene as a GLB (glTF 2.0) file.

use anyhow::ensure;
use glam::{Mat3, Quat, Vec3, vec3};
use serde_json::{Map, Value, json};

use super::materials::ALL;
use super::scene::Scene;
use super::textures::{Image, Images};

/// Direction the sunlight travels in: steeply into the court, from the west
/// and from behind the south eave onto the north arcade.
pub const SUN: Vec3 = vec3(0.18, -1.0, 0.30);

/// Illuminance of the sun in lux.
const SUN_LUX: f32 = 60_000.0;

/// Vertical field of view of all cameras.
const FOV_DEG: f32 = 60.0;

/// The binary chunk and the JSON objects that describe it.
#[derive(Default)]
struct Blob {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Blob {
    /// Appends a block, aligned to four bytes, and returns its view's index.
    fn view(&mut self, data: &[u8], target: Option<u32>) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let mut view = json!({
            "buffer": 0,
            "byteOffset": self.bytes.len(),
            "byteLength": data.len(),
        });
        if let Some(t) = target {
            view["target"] = json!(t);
        }
        self.bytes.extend_from_slice(data);
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor(&mut self, value: Value) -> usize {
        self.accessors.push(value);
        self.accessors.len() - 1
    }

    fn floats<const N: usize>(&mut self, data: &[[f32; N]], bounds: bool) -> usize {
        let bytes: Vec<u8> = data
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let view = self.view(&bytes, Some(34962));
        let mut value = json!({
            "bufferView": view,
            "componentType": 5126,
            "count": data.len(),
            "type": format!("VEC{N}"),
        });
        if bounds {
            let mut low = [f32::MAX; N];
            let mut high = [f32::MIN; N];
            for v in data {
                for i in 0..N {
                    low[i] = low[i].min(v[i]);
                    high[i] = high[i].max(v[i]);
                }
            }
            value["min"] = json!(low.to_vec());
            value["max"] = json!(high.to_vec());
        }
        self.accessor(value)
    }

    fn indices(&mut self, data: &[u32], vertices: usize) -> usize {
        let short = vertices < 65_535;
        let bytes: Vec<u8> = if short {
            data.iter()
                .flat_map(|&i| (i as u16).to_le_bytes())
                .collect()
        } else {
            data.iter().flat_map(|i| i.to_le_bytes()).collect()
        };
        let view = self.view(&bytes, Some(34963));
        self.accessor(json!({
            "bufferView": view,
            "componentType": if short { 5123 } else { 5125 },
            "count": data.len(),
            "type": "SCALAR",
        }))
    }
}

/// Serialises the scene with its images.
pub fn write(scene: &Scene, images: &Images) -> anyhow::Result<Vec<u8>> {
    let mut blob = Blob::default();

    let geometry: Vec<Value> = scene
        .geometries
        .iter()
        .map(|g| {
            let p: Vec<[f32; 3]> = g.positions.iter().map(|v| v.to_array()).collect();
            let n: Vec<[f32; 3]> = g.normals.iter().map(|v| v.to_array()).collect();
            let t: Vec<[f32; 2]> = g.uvs.iter().map(|v| v.to_array()).collect();
            let (p, n, t) = (
                blob.floats(&p, true),
                blob.floats(&n, false),
                blob.floats(&t, false),
            );
            let i = blob.indices(&g.indices, g.positions.len());
            json!({
                "attributes": { "POSITION": p, "NORMAL": n, "TEXCOORD_0": t },
                "indices": i,
            })
        })
        .collect();
    let meshes: Vec<Value> = scene
        .meshes
        .iter()
        .map(|m| {
            let primitives: Vec<Value> = m
                .primitives
                .iter()
                .map(|p| {
                    let mut value = geometry[p.geometry].clone();
                    value["material"] = json!(ALL.iter().position(|&x| x == p.mat));
                    value
                })
                .collect();
            json!({ "name": m.name, "primitives": primitives })
        })
        .collect();

    let (mut nodes, cameras) = nodes(scene);
    let root = nodes.len();
    let children: Vec<usize> = (0..root).collect();
    nodes.push(json!({ "name": "Sponza", "children": children }));

    let (image_values, textures, materials) = materials(&mut blob, images);

    while !blob.bytes.len().is_multiple_of(4) {
        blob.bytes.push(0);
    }
    let document = json!({
        "asset": { "version": "2.0", "generator": "procedural atrium generator" },
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
        "extensions": { "KHR_lights_punctual": { "lights": [{
            "name": "Sun",
            "type": "directional",
            "color": [1.0, 0.95, 0.87],
            "intensity": SUN_LUX,
        }] } },
        "scene": 0,
        "scenes": [{ "name": "Sponza", "nodes": [root] }],
        "nodes": nodes,
        "cameras": cameras,
        "meshes": meshes,
        "materials": materials,
        "images": image_values,
        "textures": textures,
        // Trilinear, repeating.
        "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 }],
        "accessors": blob.accessors,
        "bufferViews": blob.views,
        "buffers": [{ "byteLength": blob.bytes.len() }],
    });
    container(&document, &blob.bytes)
}

/// Mesh instances, cameras and the sun as glTF nodes, and the camera list.
fn nodes(scene: &Scene) -> (Vec<Value>, Vec<Value>) {
    let mut nodes = Vec::new();
    for (i, c) in scene.cameras.iter().enumerate() {
        let mut node = looking(c.target - c.eye);
        node["name"] = json!(c.name);
        node["camera"] = json!(i);
        node["translation"] = json!(c.eye.to_array());
        nodes.push(node);
    }
    let mut sun = looking(SUN);
    sun["name"] = json!("Sun");
    sun["translation"] = json!([0.0, 20.0, 0.0]);
    sun["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    nodes.push(sun);
    for n in &scene.nodes {
        let mut node = json!({ "name": n.name, "mesh": n.mesh });
        if n.translation != Vec3::ZERO {
            node["translation"] = json!(n.translation.to_array());
        }
        if n.rotation != Quat::IDENTITY {
            node["rotation"] = json!(n.rotation.to_array());
        }
        if n.scale != 1.0 {
            node["scale"] = json!([n.scale, n.scale, n.scale]);
        }
        nodes.push(node);
    }
    let cameras = scene
        .cameras
        .iter()
        .map(|c| {
            json!({
                "name": c.name,
                "type": "perspective",
                "perspective": {
                    "yfov": FOV_DEG.to_radians(),
                    "aspectRatio": 16.0 / 9.0,
                    "znear": 0.05,
                    "zfar": 200.0,
                },
            })
        })
        .collect();
    (nodes, cameras)
}

/// A node rotation whose -Z axis points along `direction`, Y up.
fn looking(direction: Vec3) -> Value {
    let back = -direction.normalize();
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let q = Quat::from_mat3(&Mat3::from_cols(right, up, back)).normalize();
    json!({ "rotation": q.to_array() })
}

fn materials(blob: &mut Blob, images: &Images) -> (Vec<Value>, Vec<Value>, Vec<Value>) {
    let (mut image_values, mut textures) = (Vec::new(), Vec::new());
    // Images may be shared between sets, so they are written by index.
    for Image { name, mime, bytes } in &images.files {
        let view = blob.view(bytes, None);
        image_values.push(json!({ "name": name, "mimeType": mime, "bufferView": view }));
        textures.push(json!({ "name": name, "sampler": 0, "source": image_values.len() - 1 }));
    }
    let materials = ALL
        .iter()
        .map(|mat| {
            let p = mat.params();
            let mut pbr = json!({
                "baseColorFactor": [p.base[0], p.base[1], p.base[2], 1.0],
                "metallicFactor": p.metallic,
                "roughnessFactor": p.roughness,
            });
            let mut value = Map::new();
            value.insert("name".into(), json!(p.name));
            if let Some(set) = p.set {
                let s = images.set(set);
                pbr["baseColorTexture"] = json!({ "index": s.colour });
                pbr["metallicRoughnessTexture"] = json!({ "index": s.roughness });
                value.insert("normalTexture".into(), json!({ "index": s.normal }));
            }
            value.insert("pbrMetallicRoughness".into(), pbr);
            if p.double_sided {
                value.insert("doubleSided".into(), json!(true));
            }
            if p.masked {
                value.insert("alphaMode".into(), json!("MASK"));
                value.insert("alphaCutoff".into(), json!(0.5));
            }
            if p.emissive != [0.0; 3] {
                value.insert("emissiveFactor".into(), json!(p.emissive));
                value.insert(
                    "extensions".into(),
                    json!({ "KHR_materials_emissive_strength": {
                        "emissiveStrength": p.emissive_strength,
                    } }),
                );
            }
            Value::Object(value)
        })
        .collect();
    (image_values, textures, materials)
}

/// Wraps JSON and binary data in the GLB container.
fn container(document: &Value, binary: &[u8]) -> anyhow::Result<Vec<u8>> {
    let mut text = serde_json::to_vec(document)?;
    while !text.len().is_multiple_of(4) {
        text.push(b' ');
    }
    let total = 12 + 8 + text.len() + 8 + binary.len();
    ensure!(u32::try_from(total).is_ok(), "the file is too large");
    let mut out = Vec::with_capacity(total);
    out.extend_from_slice(b"glTF");
    for v in [2, total as u32, text.len() as u32] {
        out.extend_from_slice(&v.to_le_bytes());
    }
    out.extend_from_slice(b"JSON");
    out.extend_from_slice(&text);
    out.extend_from_slice(&(binary.len() as u32).to_le_bytes());
    out.extend_from_slice(b"BIN\0");
    out.extend_from_slice(binary);
    Ok(out)
}
