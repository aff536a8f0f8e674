//! Which meshes take part, and whether anything about them changed.
//!
//! Bevy extracts only what some camera sees. Meshes inside a [`GiVolume`] bounce
//! light whether seen or not, so they are marked visible here; cameras draw nothing more, since
//! each keeps its own list.

use std::hash::{BuildHasher, Hash, Hasher};

use bevy::{
    app::{App, Plugin, PostUpdate},
    asset::AssetEvent,
    camera::{
        primitives::Aabb,
        visibility::{InheritedVisibility, SetViewVisibility, ViewVisibility, VisibilitySystems},
    },
    ecs::prelude::*,
    light::NotShadowCaster,
    math::{Vec3, Vec3A, bounding::Aabb3d},
    mesh::{
        Mesh, Mesh3d,
        morph::{MeshMorphWeights, MorphWeights},
        skinning::SkinnedMesh,
    },
    platform::hash::FixedHasher,
    reflect::prelude::*,
    transform::components::GlobalTransform,
};
use serde::{Deserialize, Serialize};

use super::reach::SceneReach;

/// A mesh that casts and bounces nothing: it receives indirect light only.
///
/// For gizmos, held items, particles, and stand-ins of other lights.
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
pub struct NotGiCaster;

/// A mesh that takes part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Caster {
    /// Main-world entity.
    pub entity: Entity,
    /// Bounds in the world, metres.
    pub bounds: Aabb3d,
    /// Whether it casts shadows.
    pub shadow: bool,
    /// [`SceneCasters::version`] of when it last changed.
    pub changed: u64,
}

/// All meshes that take part, sorted by entity.
#[derive(Resource, Default, Debug)]
pub struct SceneCasters {
    /// Sorted by entity.
    pub casters: Vec<Caster>,
    /// Grows whenever a caster appears, vanishes, moves, deforms or changes its material.
    pub version: u64,
    /// Whether a material has changed since the casters were last collected.
    materials_changed: bool,
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

    /// Whether materials of some type have changed.
    pub(crate) fn note_materials(&mut self, changed: bool) {
        self.materials_changed |= changed;
    }
}

pub(crate) struct VisibilityPlugin;

impl Plugin for VisibilityPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<SceneCasters>().add_systems(
            PostUpdate,
            collect_casters
                .in_set(VisibilitySystems::CheckVisibility)
                .after(super::volume::update_grids)
                .ambiguous_with_all(),
        );
    }
}

type CasterData = (
    Entity,
    &'static InheritedVisibility,
    &'static mut ViewVisibility,
    Ref<'static, GlobalTransform>,
    Ref<'static, Aabb>,
    Ref<'static, Mesh3d>,
    Has<NotShadowCaster>,
    Option<Ref<'static, MeshMorphWeights>>,
    Option<&'static SkinnedMesh>,
);

pub(crate) fn collect_casters(
    reach: Res<SceneReach>,
    mut meshes: Query<CasterData, Without<NotGiCaster>>,
    joints: Query<Ref<GlobalTransform>>,
    weights: Query<Ref<MorphWeights>>,
    mut mesh_events: MessageReader<AssetEvent<Mesh>>,
    mut scene: ResMut<SceneCasters>,
    mut last: Local<Vec<Caster>>,
) {
    // Assets may arrive or change without any component changing.
    let all_changed = !mesh_events.is_empty() | std::mem::take(&mut scene.materials_changed);
    mesh_events.clear();
    let next = scene.version + 1;

    std::mem::swap(&mut *last, &mut scene.casters);
    scene.casters.clear();
    for (entity, inherited, mut view, transform, aabb, mesh, no_shadow, morph, skin) in &mut meshes
    {
        if !inherited.get() {
            continue;
        }
        let Some(world) = world_bounds(&transform, &aabb) else {
            continue;
        };
        if !reach.touches(&world) {
            continue;
        }
        view.set_visible();
        let changed = all_changed
            || transform.is_changed()
            || aabb.is_changed()
            || mesh.is_changed()
            || morph.is_some_and(|morph| {
                // glTF files have one set of weights for all meshes of a node.
                let shared = match &*morph {
                    MeshMorphWeights::Reference(entity) => weights.get(*entity).ok(),
                    MeshMorphWeights::Value { .. } => None,
                };
                morph.is_changed() || shared.is_some_and(|weights| weights.is_changed())
            })
            || skin.is_some_and(|skin| {
                let moved = |joint| joints.get(joint).is_ok_and(|t| t.is_changed());
                skin.joints.iter().copied().any(moved)
            });
        scene.casters.push(Caster {
            entity,
            bounds: world,
            shadow: !no_shadow,
            changed: if changed { next } else { 0 },
        });
    }
    scene.casters.sort_unstable_by_key(|c| c.entity);
    for caster in &mut scene.casters {
        let before = last.binary_search_by_key(&caster.entity, |old| old.entity);
        let before = before.map(|i| last[i]);
        let same = before.is_ok_and(|old| {
            caster.changed == 0 && (old.bounds, old.shadow) == (caster.bounds, caster.shadow)
        });
        caster.changed = before.ok().filter(|_| same).map_or(next, |old| old.changed);
    }
    if *last != scene.casters {
        scene.version = next;
    }
}

/// Bounds of a mesh in the world; `None` if they are not finite.
fn world_bounds(transform: &GlobalTransform, aabb: &Aabb) -> Option<Aabb3d> {
    let affine = transform.affine();
    let center = affine.transform_point3a(aabb.center);
    let half = aabb.half_extents;
    let m = affine.matrix3;
    let half: Vec3A = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
    let bounds = Aabb3d {
        min: center - half,
        max: center + half,
    };
    (bounds.min.is_finite() && bounds.max.is_finite()).then_some(bounds)
}

/// Whether two boxes touch.
pub(crate) fn overlaps(a: &Aabb3d, b: &Aabb3d) -> bool {
    a.min.cmple(b.max).all() && a.max.cmpge(b.min).all()
}

/// The box of a grid.
pub(crate) fn grid_bounds(grid: &super::volume::Grid) -> Aabb3d {
    Aabb3d {
        min: grid.origin.into(),
        max: Vec3A::from(grid.origin + grid.size()),
    }
}

/// Corners of a box, metres.
pub(crate) fn corners(bounds: &Aabb3d) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        let pick = |axis: usize| match (i >> axis) & 1 {
            0 => bounds.min[axis],
            _ => bounds.max[axis],
        };
        Vec3::new(pick(0), pick(1), pick(2))
    })
}
