//! Which meshes take part, and whether anything about them changed.
//!
//! Bevy extracts only what some camera sees. What takes part here is what some GI camera would see if it
//! looked there (see `viewers`), so such meshes are marked visible; cameras draw nothing
//! more, since each keeps its own list.
//!
//! Change is found by comparing values, not by Bevy's change detection: components are written again all the
//! time with what they were before, by animation players at rest for one.

use std::{
    any::TypeId,
    collections::BTreeMap,
    hash::{BuildHasher, Hash, Hasher},
};

use bevy::{
    app::{App, Plugin, PostUpdate},
    asset::{AssetEvent, AssetId, Assets, UntypedAssetId},
    camera::{
        primitives::Aabb,
        visibility::{
            InheritedVisibility, RenderLayers, SetViewVisibility, ViewVisibility, VisibilityRange,
            VisibilitySystems,
        },
    },
    ecs::{entity::EntityHashMap, prelude::*, system::SystemParam},
    light::NotShadowCaster,
    math::{Affine3A, bounding::Aabb3d},
    mesh::{
        Mesh, Mesh3d,
        morph::{MeshMorphWeights, MorphWeights},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    platform::{collections::HashSet, hash::FixedHasher},
    reflect::prelude::*,
    transform::components::GlobalTransform,
};
use serde::{Deserialize, Serialize};

use super::{
    shapes::{MeshShapes, Pose},
    viewers::{Viewer, Viewers},
};
use crate::camera::{GiCamera, PrimaryGiCamera};
use crate::scene::reach::{SceneReach, find_reach};

/// A mesh that neither blocks nor bounces light. It only receives indirect light.
///
/// For gizmos, held items, particles, and meshes that represent a lamp.
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
pub struct NotGiCaster;

/// A mesh that takes part in global illumination.
#[derive(Clone, Debug, PartialEq)]
pub struct Caster {
    /// Entity in the main world.
    pub entity: Entity,
    /// Bounds in the world, metres. Where they are unknown, the whole region that matters to the volumes.
    pub bounds: Aabb3d,
    /// Whether it casts shadows.
    pub shadow: bool,
    /// Render layers. As in Bevy, the mesh blocks only lights with which it shares one.
    pub layers: RenderLayers,
    /// [`SceneCasters::version`] at its last change.
    pub changed: u64,
}

/// All meshes that take part in global illumination.
#[derive(Resource, Default, Debug)]
pub struct SceneCasters {
    /// Sorted by entity.
    pub casters: Vec<Caster>,
    /// Grows whenever a caster appears, vanishes, moves, deforms or changes its material.
    pub version: u64,
    /// Which material each mesh has, by type of material.
    materials: BTreeMap<TypeId, EntityHashMap<UntypedAssetId>>,
    /// Materials that have changed since the casters were last collected.
    changed_materials: HashSet<UntypedAssetId>,
}

impl SceneCasters {
    /// A number that stands for what some casters look like: the same as long as they are the same and
    /// none of them has changed.
    pub(crate) fn content<'a>(casters: impl IntoIterator<Item = &'a Caster>) -> u64 {
        let mut hasher = FixedHasher.build_hasher();
        for caster in casters {
            (caster.entity, caster.changed).hash(&mut hasher);
        }
        hasher.finish()
    }

    /// Which mesh has which material of a type.
    pub(crate) fn materials(&mut self, material: TypeId) -> &mut EntityHashMap<UntypedAssetId> {
        self.materials.entry(material).or_default()
    }

    /// A material looks different now.
    pub(crate) fn note_material(&mut self, material: UntypedAssetId) {
        self.changed_materials.insert(material);
    }
}

pub(crate) struct CastersPlugin;

impl Plugin for CastersPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<SceneCasters>()
            .init_resource::<Viewers>()
            .init_resource::<SceneReach>()
            .add_systems(
                PostUpdate,
                (update_viewers, find_reach, collect_casters)
                    .chain()
                    .in_set(VisibilitySystems::CheckVisibility)
                    .after(crate::scene::volume::update_grids)
                    .ambiguous_with_all(),
            );
    }
}

fn update_viewers(
    primary: Res<PrimaryGiCamera>,
    cameras: Query<Viewer, With<GiCamera>>,
    mut viewers: ResMut<Viewers>,
) {
    viewers.set_if_neq(Viewers::new(*primary, cameras.iter()));
}

type CasterData = (
    Entity,
    &'static InheritedVisibility,
    &'static mut ViewVisibility,
    &'static GlobalTransform,
    &'static Mesh3d,
    Option<&'static Aabb>,
    Option<&'static RenderLayers>,
    Option<&'static VisibilityRange>,
    Has<NotShadowCaster>,
    Option<&'static MeshMorphWeights>,
    Option<&'static SkinnedMesh>,
);

/// What poses meshes.
#[derive(SystemParam)]
pub(crate) struct Poses<'w, 's> {
    joints: Query<'w, 's, &'static GlobalTransform>,
    weights: Query<'w, 's, &'static MorphWeights>,
    bind_poses: Res<'w, Assets<SkinnedMeshInverseBindposes>>,
}

impl Poses<'_, '_> {
    /// For each joint what takes vertices to the world, as `bevy_pbr::render::skin` has it.
    fn joints(&self, skin: &SkinnedMesh, out: &mut Vec<Affine3A>) {
        let poses = self.bind_poses.get(&skin.inverse_bindposes);
        out.clear();
        out.extend(skin.joints.iter().enumerate().map(|(i, joint)| {
            match (poses.and_then(|p| p.get(i)), self.joints.get(*joint)) {
                (Some(pose), Ok(joint)) => joint.affine() * Affine3A::from_mat4(*pose),
                _ => Affine3A::IDENTITY,
            }
        }));
    }

    /// Weights of a mesh's morph targets. glTF files have one set for all meshes of a node.
    fn weights<'a>(&'a self, morph: &'a MeshMorphWeights) -> Option<&'a [f32]> {
        match morph {
            MeshMorphWeights::Value { weights } => Some(weights),
            MeshMorphWeights::Reference(entity) => {
                self.weights.get(*entity).ok().map(MorphWeights::weights)
            }
        }
    }
}

/// A caster, and what it looks like besides.
struct Seen {
    caster: Caster,
    /// A number for its mesh and its material.
    assets: u64,
    /// Where its pose starts in [`Collected::poses`].
    pose: usize,
    /// Matrices of its pose: of the entity, and of each joint.
    matrices: usize,
    /// Morph targets of its pose.
    weights: usize,
}

/// Casters with their poses.
#[derive(Default)]
pub(crate) struct Collected {
    /// Sorted by entity.
    seen: Vec<Seen>,
    /// Of each, its matrices by column, and the weights of its morph targets.
    poses: Vec<f32>,
}

/// What rounding may do to values that have not changed, relative to the largest of them: an animation player
/// computes the same pose from other moments of time, through a chain of joints. Some tens of errors of 2^-24.
const ROUNDING: f32 = 32.0 * f32::EPSILON;

impl Collected {
    /// Notes a caster.
    fn add(&mut self, caster: Caster, assets: u64, pose: &Pose) {
        let start = self.poses.len();
        let joints = pose.joints.unwrap_or_default();
        let weights = pose.weights.unwrap_or_default();
        self.poses.extend(pose.transform.to_cols_array());
        self.poses
            .extend(joints.iter().flat_map(Affine3A::to_cols_array));
        self.poses.extend(weights);
        self.seen.push(Seen {
            caster,
            assets,
            pose: start,
            matrices: 1 + joints.len(),
            weights: weights.len(),
        });
    }

    fn find(&self, entity: Entity) -> Option<&Seen> {
        let i = self
            .seen
            .binary_search_by_key(&entity, |seen| seen.caster.entity);
        Some(&self.seen[i.ok()?])
    }

    fn pose(&self, seen: &Seen) -> &[f32] {
        &self.poses[seen.pose..][..12 * seen.matrices + seen.weights]
    }

    /// Makes casters what they were where nothing about them has changed, but for rounding. So many small
    /// steps are not lost: they add up until they count.
    fn keep(&mut self, last: &Self) {
        for i in 0..self.seen.len() {
            let new = &self.seen[i];
            let Some(old) = last.find(new.caster.entity) else {
                continue;
            };
            let pose = last.pose(old);
            let same = new.caster.changed == 0
                && (new.assets, new.matrices, new.weights)
                    == (old.assets, old.matrices, old.weights)
                && (new.caster.shadow, &new.caster.layers)
                    == (old.caster.shadow, &old.caster.layers)
                && same_bounds(&new.caster.bounds, &old.caster.bounds)
                && same_pose(self.pose(new), pose, old);
            if same {
                let start = new.pose;
                self.seen[i].caster = old.caster.clone();
                self.poses[start..][..pose.len()].copy_from_slice(pose);
            }
        }
    }
}

/// Largest coordinate of a box.
fn reach(bounds: &Aabb3d) -> f32 {
    bounds.min.abs().max(bounds.max.abs()).max_element()
}

fn same_bounds(a: &Aabb3d, b: &Aabb3d) -> bool {
    let off = (a.min - b.min).abs().max((a.max - b.max).abs());
    off.max_element() <= ROUNDING * reach(b)
}

fn same_pose(new: &[f32], old: &[f32], seen: &Seen) -> bool {
    let close = |a: &[f32], b: &[f32], size: f32| {
        let mut pairs = a.iter().zip(b);
        pairs.all(|(a, b)| a.to_bits() == b.to_bits() || (a - b).abs() <= ROUNDING * size)
    };
    let largest = |values: &[f32]| values.iter().fold(0.0, |max: f32, v| max.max(v.abs()));
    let reach = reach(&seen.caster.bounds);
    let (new, new_weights) = new.split_at(12 * seen.matrices);
    let (old, old_weights) = old.split_at(12 * seen.matrices);
    let mut matrices = new.chunks(12).zip(old.chunks(12));
    matrices.all(|(new, old)| {
        let (linear, translation) = old.split_at(9);
        close(&new[..9], linear, largest(linear)) && close(&new[9..], translation, reach)
    }) && close(new_weights, old_weights, largest(old_weights).max(1.0))
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn collect_casters(
    reach: Res<SceneReach>,
    viewers: Res<Viewers>,
    mut meshes: Query<CasterData, Without<NotGiCaster>>,
    poses: Poses,
    assets: Res<Assets<Mesh>>,
    mut mesh_events: MessageReader<AssetEvent<Mesh>>,
    mut shapes: Local<MeshShapes>,
    mut changed_meshes: Local<HashSet<AssetId<Mesh>>>,
    mut scene: ResMut<SceneCasters>,
    mut last: Local<Collected>,
    mut joints: Local<Vec<Affine3A>>,
) {
    changed_meshes.clear();
    for event in mesh_events.read() {
        shapes.hear(event, &assets);
        if let Some(id) = changed_asset(event) {
            changed_meshes.insert(id);
        }
    }

    let scene = &mut *scene;
    let next = scene.version + 1;
    let mut now = Collected::default();
    for (
        entity,
        inherited,
        mut view,
        transform,
        mesh,
        aabb,
        layers,
        range,
        no_shadow,
        morph,
        skin,
    ) in &mut meshes
    {
        let layers = layers.unwrap_or_default();
        let affine = transform.affine();
        if !inherited.get() || !viewers.see(layers) || !affine.is_finite() {
            continue;
        }
        let center = aabb.filter(|_| range.is_some_and(|range| range.use_aabb));
        let center = center.map_or(affine.translation, |aabb| {
            affine.transform_point3a(aabb.center)
        });
        if range.is_some_and(|range| !viewers.see_level(range, center)) {
            continue;
        }
        let Some(shape) = shapes.get(mesh.id(), &assets) else {
            continue;
        };
        if let Some(skin) = skin {
            poses.joints(skin, &mut joints);
        }
        let pose = Pose {
            transform: &affine,
            aabb,
            joints: skin.is_some().then_some(&joints[..]),
            weights: morph.and_then(|morph| poses.weights(morph)),
        };
        let Some(bounds) = reach.reached_by(shape.bounds(&pose)) else {
            continue;
        };
        view.set_visible();
        let mut look = FixedHasher.build_hasher();
        mesh.id().hash(&mut look);
        let mut changed = changed_meshes.contains(&mesh.id());
        for material in scene.materials.values().filter_map(|of| of.get(&entity)) {
            material.hash(&mut look);
            changed |= scene.changed_materials.contains(material);
        }
        let caster = Caster {
            entity,
            bounds,
            shadow: !no_shadow,
            layers: layers.clone(),
            changed: if changed { next } else { 0 },
        };
        now.add(caster, look.finish(), &pose);
    }
    scene.changed_materials.clear();

    now.seen.sort_unstable_by_key(|seen| seen.caster.entity);
    now.keep(&last);
    for Seen { caster, .. } in &mut now.seen {
        // What was not kept.
        if caster.changed == 0 {
            caster.changed = next;
        }
    }
    let casters = || now.seen.iter().map(|seen| &seen.caster);
    if !casters().eq(&scene.casters) {
        scene.casters = casters().cloned().collect();
        scene.version = next;
    }
    *last = now;
}

/// The asset that looks different after an event.
pub(crate) fn changed_asset<A: bevy::asset::Asset>(event: &AssetEvent<A>) -> Option<AssetId<A>> {
    match *event {
        AssetEvent::Added { id } | AssetEvent::Modified { id } | AssetEvent::Unused { id } => {
            Some(id)
        }
        // As in Bevy's renderer: what is removed from its assets is drawn as long as something uses it.
        AssetEvent::Removed { .. } | AssetEvent::LoadedWithDependencies { .. } => None,
    }
}
