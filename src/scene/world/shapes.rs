//! Where meshes are in the world as they are drawn now.
//!
//! Bevy's [`Aabb`] is there for culling: `NoFrustumCulling` takes it away, it is that of the rest pose where
//! morph targets deform a mesh, and of the bind pose for most skins, and apps set it by hand. So bounds come
//! from the mesh asset itself, of which this is a cache; an [`Aabb`] can only enlarge them, where a vertex
//! shader moves things.

use bevy::{
    asset::{AssetEvent, AssetId, Assets, RenderAssetUsages},
    camera::primitives::Aabb,
    math::{
        Affine3A, Vec3A,
        bounding::{Aabb3d, BoundingVolume},
    },
    mesh::{
        Mesh, MeshAccessError, PrimitiveTopology, VertexAttributeValues, morph::MorphAttributes,
        skinning::SkinnedMeshBounds,
    },
    platform::collections::HashMap,
};

/// Something of a mesh that may lie in the render world only, where nobody can ask for it.
#[derive(Clone, Debug, PartialEq)]
enum Known<T> {
    Yes(T),
    No,
}

/// What the bounds of a mesh depend on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshShape {
    /// Of its vertices, in its own space.
    rest: Known<Aabb3d>,
    /// By joint, of the vertices that it moves; `None` for what no skin moves.
    joints: Known<Option<SkinnedMeshBounds>>,
    /// For each morph target, how far it moves vertices.
    morphs: Known<Vec<Aabb3d>>,
}

/// How a mesh is posed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pose<'a> {
    /// Of the entity.
    pub transform: &'a Affine3A,
    /// Bevy's own bounds.
    pub aabb: Option<&'a Aabb>,
    /// By joint, what takes vertices from the mesh's own space to the world.
    pub joints: Option<&'a [Affine3A]>,
    /// Weights of the morph targets.
    pub weights: Option<&'a [f32]>,
}

impl MeshShape {
    /// `None` if there is nothing to capture: no triangles, or none with finite corners.
    fn new(mesh: &Mesh) -> Option<Self> {
        use PrimitiveTopology::{TriangleList, TriangleStrip};
        // Lines and points have no surface that could reflect light.
        if !matches!(mesh.primitive_topology(), TriangleList | TriangleStrip) {
            return None;
        }
        let rest = match mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION) {
            Ok(Some(VertexAttributeValues::Float32x3(positions))) => {
                Known::Yes(enclosing(positions.iter().map(|p| Vec3A::from_array(*p)))?)
            }
            Ok(None) => return None,
            // Bevy keeps the bounds of what it moves to the render world.
            _ => mesh
                .final_aabb
                .filter(is_finite)
                .map_or(Known::No, Known::Yes),
        };
        let joints = match mesh.try_contains_attribute(Mesh::ATTRIBUTE_JOINT_INDEX) {
            Ok(false) => Known::Yes(None),
            Ok(true) => match SkinnedMeshBounds::from_mesh(mesh) {
                Ok(bounds) => Known::Yes(Some(bounds)),
                Err(_) => Known::No,
            },
            Err(_) => match mesh.skinned_mesh_bounds() {
                Some(bounds) => Known::Yes(Some(bounds.clone())),
                None => Known::No,
            },
        };
        let morphs = match mesh.try_morph_targets() {
            Ok(targets) => Known::Yes(displacements(targets, mesh.count_vertices())),
            Err(MeshAccessError::NotFound) => Known::Yes(Vec::new()),
            Err(_) => Known::No,
        };
        Some(Self {
            rest,
            joints,
            morphs,
        })
    }

    /// Bounds in the world, metres; `None` if they are unknown, or not finite.
    pub fn bounds(&self, pose: &Pose) -> Option<Aabb3d> {
        let moved = self.displacement(pose.weights)?;
        let bounds = match (pose.joints, &self.joints) {
            (Some(joints), Known::Yes(Some(bones))) => {
                let bones = bones.iter().map(|(joint, aabb)| {
                    let bone = sum(&Aabb3d::from(*aabb), &moved);
                    Some(transformed(&bone, joints.get(usize::from(joint.0))?))
                });
                // None where a vertex hangs on a joint that is not there.
                let bones = bones.collect::<Option<Vec<_>>>()?;
                bones.into_iter().reduce(|a, b| a.merge(&b))?
            }
            (Some(_), Known::No) => return None,
            _ => {
                let Known::Yes(rest) = &self.rest else {
                    return None;
                };
                let mut local = sum(rest, &moved);
                if let Some(aabb) = pose.aabb
                    && !(aabb.center.is_nan() || aabb.half_extents.is_nan())
                {
                    let own = Aabb3d::new(aabb.center, aabb.half_extents.abs());
                    local = local.merge(&own);
                }
                transformed(&local, pose.transform)
            }
        };
        is_finite(&bounds).then_some(bounds)
    }

    /// How far morph targets move vertices, at most.
    fn displacement(&self, weights: Option<&[f32]>) -> Option<Aabb3d> {
        let none = Aabb3d::new(Vec3A::ZERO, Vec3A::ZERO);
        let Some(weights) = weights else {
            return Some(none);
        };
        let Known::Yes(morphs) = &self.morphs else {
            return None;
        };
        let moved = morphs.iter().zip(weights).map(|(morph, weight)| {
            let ends = [morph.min * *weight, morph.max * *weight];
            Aabb3d {
                min: ends[0].min(ends[1]),
                max: ends[0].max(ends[1]),
            }
        });
        Some(moved.fold(none, |a, b| sum(&a, &b)))
    }
}

/// [`MeshShape`]s by mesh. `None`: nothing to capture.
#[derive(Default, Debug)]
pub(crate) struct MeshShapes(HashMap<AssetId<Mesh>, Option<MeshShape>>);

impl MeshShapes {
    /// The shape of a mesh; `None` if it is not loaded, or has nothing to capture.
    pub fn get(&mut self, id: AssetId<Mesh>, meshes: &Assets<Mesh>) -> Option<&MeshShape> {
        if !self.0.contains_key(&id) {
            self.0.insert(id, MeshShape::new(meshes.get(id)?));
        }
        self.0.get(&id)?.as_ref()
    }

    /// Keeps up with what happens to meshes.
    pub fn hear(&mut self, event: &AssetEvent<Mesh>, meshes: &Assets<Mesh>) {
        match *event {
            AssetEvent::Added { id } | AssetEvent::Modified { id } => {
                self.0.remove(&id);
                // Later this frame, the data of such a mesh is moved to the render world.
                let leaves = |mesh: &&Mesh| mesh.asset_usage == RenderAssetUsages::RENDER_WORLD;
                if let Some(mesh) = meshes.get(id).filter(leaves) {
                    self.0.insert(id, MeshShape::new(mesh));
                }
            }
            // A mesh that was removed from its assets is drawn as long as something uses it.
            AssetEvent::Unused { id } => {
                self.0.remove(&id);
            }
            AssetEvent::Removed { .. } | AssetEvent::LoadedWithDependencies { .. } => {}
        }
    }
}

/// Bounds of the finite ones among some points; `None` if there is none.
fn enclosing(points: impl Iterator<Item = Vec3A>) -> Option<Aabb3d> {
    let points = points.filter(|p| p.is_finite());
    points
        .map(|p| Aabb3d { min: p, max: p })
        .reduce(|a, b| a.merge(&b))
}

/// How far each morph target moves vertices. Targets lie one after the other.
fn displacements(targets: &[MorphAttributes], vertices: usize) -> Vec<Aabb3d> {
    let targets = targets.chunks(vertices.max(1));
    targets
        .map(|target| {
            let moved = target.iter().map(|vertex| Vec3A::from(vertex.position));
            enclosing(moved).unwrap_or(Aabb3d::new(Vec3A::ZERO, Vec3A::ZERO))
        })
        .collect()
}

/// All sums of a point of one box and a point of another.
fn sum(a: &Aabb3d, b: &Aabb3d) -> Aabb3d {
    Aabb3d {
        min: a.min + b.min,
        max: a.max + b.max,
    }
}

/// The box around a box that is moved (Arvo 1990, "Transforming axis-aligned bounding boxes").
fn transformed(bounds: &Aabb3d, transform: &Affine3A) -> Aabb3d {
    let center = transform.transform_point3a(bounds.center());
    let half = bounds.half_size();
    let m = transform.matrix3;
    let half: Vec3A = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    Aabb3d {
        min: center - half,
        max: center + half,
    }
}

fn is_finite(bounds: &Aabb3d) -> bool {
    bounds.min.is_finite() && bounds.max.is_finite()
}

#[cfg(test)]
mod tests {
    use bevy::{
        math::{Vec3, primitives::Cuboid},
        mesh::{MeshBuilder, Meshable},
    };

    use super::*;

    fn cube() -> Mesh {
        Cuboid::from_length(2.0).mesh().build()
    }

    fn at_rest(transform: &Affine3A) -> Pose<'_> {
        Pose {
            transform,
            aabb: None,
            joints: None,
            weights: None,
        }
    }

    #[track_caller]
    fn assert_bounds(bounds: Option<Aabb3d>, min: Vec3, max: Vec3) {
        let bounds = bounds.expect("bounds are known");
        let off = (Vec3::from(bounds.min) - min).abs() + (Vec3::from(bounds.max) - max).abs();
        assert!(off.max_element() < 1e-5, "{bounds:?}");
    }

    #[test]
    fn lines_points_and_what_is_nowhere_have_no_shape() {
        let mesh = |topology, positions: Vec<[f32; 3]>| {
            Mesh::new(topology, RenderAssetUsages::default())
                .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        };
        let points = vec![[0.0; 3], [1.0; 3], [0.0, 1.0, 0.0]];
        for topology in [
            PrimitiveTopology::PointList,
            PrimitiveTopology::LineList,
            PrimitiveTopology::LineStrip,
        ] {
            assert_eq!(MeshShape::new(&mesh(topology, points.clone())), None);
        }
        for positions in [vec![], vec![[f32::NAN; 3]; 3]] {
            let mesh = mesh(PrimitiveTopology::TriangleList, positions);
            assert_eq!(MeshShape::new(&mesh), None);
        }
        // A corner that is not finite leaves the others where they are.
        let mut positions = points;
        positions.extend([[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [0.0; 3]]);
        let shape = MeshShape::new(&mesh(PrimitiveTopology::TriangleStrip, positions)).unwrap();
        assert_bounds(
            shape.bounds(&at_rest(&Affine3A::IDENTITY)),
            Vec3::ZERO,
            Vec3::ONE,
        );
    }

    #[test]
    fn bounds_follow_shear_boxes_set_by_hand_and_the_move_to_the_render_world() {
        let mut mesh = cube();
        let shape = MeshShape::new(&mesh).unwrap();
        let shear = Affine3A::from_scale(Vec3::new(2.0, 1.0, 1.0))
            * Affine3A::from_rotation_z(std::f32::consts::FRAC_PI_4);
        let half = Vec3::new(2.0 * 2f32.sqrt(), 2f32.sqrt(), 1.0);
        assert_bounds(shape.bounds(&at_rest(&shear)), -half, half);

        let identity = Affine3A::IDENTITY;
        for (half, bounds) in [(0.1, Some(1.0)), (3.0, Some(3.0)), (f32::INFINITY, None)] {
            let aabb = Aabb {
                center: Vec3A::ZERO,
                half_extents: Vec3A::splat(half),
            };
            let pose = Pose {
                aabb: Some(&aabb),
                ..at_rest(&identity)
            };
            match bounds {
                Some(half) => {
                    assert_bounds(shape.bounds(&pose), Vec3::splat(-half), Vec3::splat(half));
                }
                None => assert_eq!(shape.bounds(&pose), None),
            }
        }

        mesh.take_gpu_data().unwrap();
        let shape = MeshShape::new(&mesh).unwrap();
        assert_bounds(shape.bounds(&at_rest(&identity)), Vec3::NEG_ONE, Vec3::ONE);
        let pose = Pose {
            weights: Some(&[1.0]),
            ..at_rest(&identity)
        };
        assert_eq!(shape.bounds(&pose), None, "morph targets are out of sight");
    }

    #[test]
    fn bounds_are_those_of_the_pose() {
        let mut mesh = cube();
        let vertices = mesh.count_vertices();
        let raised = MorphAttributes {
            position: Vec3::Y,
            ..Default::default()
        };
        mesh.set_morph_targets(vec![raised; vertices]);
        let shape = MeshShape::new(&mesh).unwrap();
        let identity = Affine3A::IDENTITY;
        for (weight, min, max) in [(3.0, 2.0, 4.0), (-2.0, -3.0, -1.0)] {
            let pose = Pose {
                weights: Some(&[weight]),
                ..at_rest(&identity)
            };
            assert_bounds(
                shape.bounds(&pose),
                Vec3::new(-1.0, min, -1.0),
                Vec3::new(1.0, max, 1.0),
            );
        }

        mesh.insert_attribute(
            Mesh::ATTRIBUTE_JOINT_INDEX,
            VertexAttributeValues::Uint16x4(vec![[1, 0, 0, 0]; vertices]),
        );
        mesh.insert_attribute(
            Mesh::ATTRIBUTE_JOINT_WEIGHT,
            vec![[1.0, 0.0, 0.0, 0.0]; vertices],
        );
        let shape = MeshShape::new(&mesh).unwrap();
        let joints = [
            Affine3A::from_translation(Vec3::splat(100.0)),
            Affine3A::from_translation(Vec3::X * 5.0),
        ];
        // Where the entity stands does not matter.
        let elsewhere = Affine3A::from_translation(Vec3::splat(-50.0));
        let mut pose = Pose {
            joints: Some(&joints),
            weights: Some(&[1.0]),
            ..at_rest(&elsewhere)
        };
        assert_bounds(
            shape.bounds(&pose),
            Vec3::new(4.0, 0.0, -1.0),
            Vec3::new(6.0, 2.0, 1.0),
        );
        pose.joints = Some(&joints[..1]);
        assert_eq!(shape.bounds(&pose), None, "a joint is missing");
    }
}
