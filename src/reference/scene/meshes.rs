//! Meshes of the world, as triangles where Bevy's vertex shader places them.

use bevy::{
    asset::Assets,
    camera::{
        primitives::Aabb,
        visibility::{InheritedVisibility, RenderLayers, VisibilityRange},
    },
    ecs::prelude::*,
    image::Image,
    math::{Affine3A, Mat4, Vec2, Vec3, Vec3A},
    mesh::{
        Indices, Mesh, Mesh3d, MeshVertexAttributeId, PrimitiveTopology, VertexAttributeValues,
        morph::{MeshMorphWeights, MorphAttributes, MorphWeights},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    pbr::{MeshMaterial3d, StandardMaterial},
    render::render_resource::Face as CullFace,
    transform::components::GlobalTransform,
};

use super::{layers::LayerSets, materials::MaterialCollector, warnings::Warnings};
use crate::{
    reference::geometry::{Face, Facing},
    scene::world::{casters::NotGiCaster, viewers::Viewers},
};

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

/// Takes meshes over.
#[derive(Default)]
pub(super) struct MeshCollector {
    pub faces: Vec<Face>,
    pub layers: LayerSets,
}

impl MeshCollector {
    /// All meshes that are seen, with their materials.
    pub fn collect(
        &mut self,
        world: &mut World,
        viewers: &Viewers,
        materials: &mut MaterialCollector,
        warnings: &mut Warnings,
    ) {
        let mut query = world.query::<MeshData>();
        let world = &*world;
        let (Some(meshes), Some(standard_materials), Some(images)) = (
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
            let standard = standard_materials.get(&handle.0);
            let (Some(mesh), Some(standard)) = (meshes.get(&mesh.0), standard) else {
                continue;
            };
            let Some(material) = materials.material(handle.0.id(), standard, images, warnings)
            else {
                continue;
            };
            let facing = Facing {
                front: standard.cull_mode != Some(CullFace::Front),
                back: standard.cull_mode != Some(CullFace::Back),
                camera_only,
                layers: self.layers.number(layers),
                masked: materials.found.materials[material as usize].mask.is_some(),
            };
            let placed = Placed {
                transform: affine,
                joints: skin.and_then(|skin| joints(world, skin)),
                weights: morph.and_then(|morph| weights(world, morph)),
                material,
                facing,
            };
            if let Err(why) = placed.faces(mesh, &mut self.faces) {
                warnings.add(format!("a mesh is left out: {why}"));
            }
        }
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

/// Weights of a mesh's morph targets.
fn weights<'a>(world: &'a World, morph: &'a MeshMorphWeights) -> Option<&'a [f32]> {
    match morph {
        MeshMorphWeights::Value { weights } => Some(&weights[..]),
        MeshMorphWeights::Reference(entity) => world
            .get::<MorphWeights>(*entity)
            .map(MorphWeights::weights),
    }
}

/// A mesh in its place.
struct Placed<'a> {
    transform: Affine3A,
    joints: Option<Vec<Mat4>>,
    weights: Option<&'a [f32]>,
    material: u32,
    facing: Facing,
}

/// A vertex in the world.
struct Corner {
    position: Vec3,
    normal: Option<Vec3>,
    /// With the bitangent's sign.
    tangent: Option<(Vec3, f32)>,
    /// Whether it was mirrored on its way there.
    mirrored: bool,
}

impl Placed<'_> {
    /// Adds the triangles of a mesh.
    fn faces(&self, mesh: &Mesh, out: &mut Vec<Face>) -> Result<(), String> {
        let topology = mesh.primitive_topology();
        if !matches!(
            topology,
            PrimitiveTopology::TriangleList | PrimitiveTopology::TriangleStrip
        ) {
            return Err("it has lines or points in place of triangles".into());
        }
        let attributes = Attributes::of(mesh)?;
        let triangles = triangles(mesh, attributes.positions.len())?;
        let faces = triangles
            .into_iter()
            .filter_map(|t| self.face(&attributes, t));
        out.extend(faces);
        Ok(())
    }

    /// The triangle between three vertices, if there are such and it has an area.
    fn face(&self, attributes: &Attributes, mut indices: [usize; 3]) -> Option<Face> {
        if indices.iter().any(|i| *i >= attributes.positions.len()) {
            return None;
        }
        let mut corners = indices.map(|i| self.corner(attributes, i));
        let mut facing = self.facing;
        if corners[0].mirrored {
            // What is mirrored runs the other way round; its front stays where its normals point.
            indices.swap(1, 2);
            corners.swap(1, 2);
            facing = facing.turned();
        }
        let positions = corners.each_ref().map(|corner| corner.position);
        let cross = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
        if !positions.iter().all(|p| p.is_finite()) || cross.length_squared() == 0.0 {
            return None;
        }
        let flat = cross.normalize();
        Some(Face {
            corners: positions,
            normals: corners.each_ref().map(|c| c.normal.unwrap_or(flat)),
            uvs: attributes
                .uvs
                .map(|uvs| indices.map(|i| uvs.map_or(Vec2::ZERO, |uvs| Vec2::from_array(uvs[i])))),
            tangents: corners
                .each_ref()
                .map(|c| c.tangent.unwrap_or((Vec3::ZERO, 1.0))),
            colors: indices.map(|i| attributes.color(i)),
            material: self.material,
            facing,
        })
    }

    /// A vertex, as Bevy's vertex shader places it.
    fn corner(&self, attributes: &Attributes, i: usize) -> Corner {
        let mut p = Vec3::from_array(attributes.positions[i]);
        let mut n = attributes.normals.map(|n| Vec3::from_array(n[i]));
        let mut t = attributes
            .tangents
            .map(|t| (Vec3::from_slice(&t[i][..3]), t[i][3]));
        if let (Some(weights), Some(targets)) = (self.weights, attributes.targets) {
            for (target, weight) in weights.iter().enumerate() {
                if let Some(delta) = targets.get(target * attributes.positions.len() + i) {
                    p += delta.position * *weight;
                    n = n.map(|n| n + delta.normal * *weight);
                    t = t.map(|(t, sign)| (t + delta.tangent * *weight, sign));
                }
            }
        }
        let matrix = self.matrix(attributes, i);
        let mirrored = matrix.matrix3.determinant() < 0.0;
        let turn = if mirrored { -1.0 } else { 1.0 };
        let normal_matrix = matrix.matrix3.inverse().transpose();
        let direction = |v: Vec3| Vec3::from(matrix.matrix3 * Vec3A::from(v)).normalize_or_zero();
        Corner {
            position: matrix.transform_point3(p),
            normal: n.map(|n| Vec3::from(normal_matrix * Vec3A::from(n)).normalize_or_zero()),
            tangent: t.map(|(t, sign)| (direction(t), sign * turn)),
            mirrored,
        }
    }

    /// From the mesh into the world, at a vertex.
    fn matrix(&self, attributes: &Attributes, i: usize) -> Affine3A {
        let (Some(joints), Some(indices), Some(weights)) = (
            &self.joints,
            attributes.joint_indices,
            attributes.joint_weights,
        ) else {
            return self.transform;
        };
        let mut matrix = Mat4::ZERO;
        for (joint, weight) in indices[i].iter().zip(weights[i]) {
            if let Some(joint) = joints.get(*joint as usize) {
                matrix += *joint * weight;
            }
        }
        Affine3A::from_mat4(matrix)
    }
}

/// The attributes of a mesh that Bevy knows.
struct Attributes<'a> {
    positions: &'a [[f32; 3]],
    normals: Option<&'a [[f32; 3]]>,
    uvs: [Option<&'a [[f32; 2]]>; 2],
    tangents: Option<&'a [[f32; 4]]>,
    colors: Option<&'a VertexAttributeValues>,
    joint_indices: Option<&'a [[u16; 4]]>,
    joint_weights: Option<&'a [[f32; 4]]>,
    targets: Option<&'a [MorphAttributes]>,
}

impl<'a> Attributes<'a> {
    fn of(mesh: &'a Mesh) -> Result<Self, String> {
        use VertexAttributeValues::{Float32x2, Float32x3, Float32x4, Uint16x4};
        let attribute = |id: MeshVertexAttributeId| mesh.try_attribute_option(id).ok().flatten();
        let float2 = |id| match attribute(id) {
            Some(Float32x2(values)) => Some(&values[..]),
            _ => None,
        };
        let float3 = |id| match attribute(id) {
            Some(Float32x3(values)) => Some(&values[..]),
            _ => None,
        };
        let float4 = |id| match attribute(id) {
            Some(Float32x4(values)) => Some(&values[..]),
            _ => None,
        };
        let integer4 = |id| match attribute(id) {
            Some(Uint16x4(values)) => Some(&values[..]),
            _ => None,
        };
        Ok(Self {
            positions: float3(Mesh::ATTRIBUTE_POSITION.id)
                .ok_or("its positions are on the GPU only, or not there")?,
            normals: float3(Mesh::ATTRIBUTE_NORMAL.id),
            uvs: [Mesh::ATTRIBUTE_UV_0.id, Mesh::ATTRIBUTE_UV_1.id].map(float2),
            tangents: float4(Mesh::ATTRIBUTE_TANGENT.id),
            colors: attribute(Mesh::ATTRIBUTE_COLOR.id),
            joint_indices: integer4(Mesh::ATTRIBUTE_JOINT_INDEX.id),
            joint_weights: float4(Mesh::ATTRIBUTE_JOINT_WEIGHT.id),
            targets: mesh.get_morph_targets(),
        })
    }

    fn color(&self, i: usize) -> [f32; 4] {
        match self.colors {
            Some(VertexAttributeValues::Float32x4(values)) => values[i],
            Some(VertexAttributeValues::Unorm8x4(values)) => {
                values[i].map(|b| f32::from(b) / 255.0)
            }
            _ => [1.0; 4],
        }
    }
}

/// Vertices of each triangle of a mesh that has so many.
fn triangles(mesh: &Mesh, vertices: usize) -> Result<Vec<[usize; 3]>, String> {
    let strip = mesh.primitive_topology() == PrimitiveTopology::TriangleStrip;
    Ok(match mesh.try_indices_option().ok().flatten() {
        Some(_) if strip => {
            return Err("Bevy 0.19 does not draw triangle strips with indices".into());
        }
        None if strip => {
            // Every other triangle runs the other way round.
            let triangle = |i: usize| [i - 2, i - 1 + i % 2, i - i % 2];
            (2..vertices).map(triangle).collect()
        }
        Some(Indices::U16(indices)) => {
            let triangles = indices.chunks_exact(3);
            triangles
                .map(|i| [i[0], i[1], i[2]].map(usize::from))
                .collect()
        }
        Some(Indices::U32(indices)) => {
            let triangles = indices.chunks_exact(3);
            triangles
                .map(|i| [i[0], i[1], i[2]].map(|i| i as usize))
                .collect()
        }
        None => (0..vertices / 3)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect(),
    })
}
