//! [`GiCascades`]: nested volumes around the camera, for worlds that a single volume cannot hold.

use bevy::{
    app::{App, Plugin, PostUpdate},
    camera::visibility::Visibility,
    ecs::prelude::*,
    math::Vec3,
    reflect::prelude::*,
    transform::{TransformSystems, components::Transform},
};
use serde::{Deserialize, Serialize};

use super::{GiVolume, LARGEST, ProbeSet};
use crate::settings::{Clamp, Clamping, Parameters, ParametersKind, SettingsComponentPlugin};

/// Nested [`GiVolume`]s that follow the camera, for worlds that a single volume cannot hold.
///
/// Each volume is larger than the one inside it by the same factor, has as many voxels, and blends into the
/// next at its border. The volumes are children of this entity and are removed with it. A [`ProbeSet`] on this
/// entity is copied to all of them. Its `Transform` is an offset from the camera; its scale multiplies the
/// extents. Volumes are 100 km large at most.
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
#[require(Transform, Visibility)]
#[serde(default)]
pub struct GiCascades {
    /// Number of volumes. Range 1..=4, default 3. Cost: proportional while things change, and in each pixel of
    /// a border.
    pub levels: u32,
    /// Full size of the innermost volume in metres. Each 0.01..=100000, default 16 x 8 x 16.
    pub extent: Vec3,
    /// Size of each volume relative to the one inside it. Range 1.25..=8, default 2.5.
    pub ratio: f32,
    /// Voxels along the longest side of each volume. Range 32..=512, default 64.
    pub resolution: u32,
    /// Width of the border over which each volume blends into the next, as a fraction of its shortest side.
    /// Range 0..=0.5, default 0.15.
    pub fade: f32,
}

impl Default for GiCascades {
    fn default() -> Self {
        Self {
            levels: 3,
            extent: Vec3::new(16.0, 8.0, 16.0),
            ratio: 2.5,
            resolution: 64,
            fade: 0.15,
        }
    }
}

impl GiCascades {
    /// The volume of a level; level 0 is the innermost.
    pub fn volume(&self, level: u32) -> GiVolume {
        GiVolume {
            extent: (self.extent * self.ratio.powi(level as i32)).min(Vec3::splat(LARGEST)),
            resolution: self.resolution,
            follow_camera: true,
            fade: self.fade,
        }
    }
}

impl Parameters for GiCascades {
    const KIND: ParametersKind = ParametersKind::Scene;

    fn clamp(&mut self, c: &mut Clamp) {
        c.int("levels", &mut self.levels, 1, 4).unit("volumes");
        c.float("extent.x", &mut self.extent.x, 0.01, 1e5).unit("m");
        c.float("extent.y", &mut self.extent.y, 0.01, 1e5).unit("m");
        c.float("extent.z", &mut self.extent.z, 0.01, 1e5).unit("m");
        c.float("ratio", &mut self.ratio, 1.25, 8.0);
        c.int("resolution", &mut self.resolution, 32, 512)
            .unit("voxels");
        c.float("fade", &mut self.fade, 0.0, 0.5);
    }
}

/// A volume of [`GiCascades`].
#[derive(Component)]
struct Cascade(u32);

pub(crate) struct CascadesPlugin;

impl Plugin for CascadesPlugin {
    fn build(&self, app: &mut App) {
        app.add_observer(remove_volumes).add_systems(
            PostUpdate,
            update_volumes
                .after(Clamping)
                .before(TransformSystems::Propagate),
        );
        app.add_plugins(SettingsComponentPlugin::<GiCascades>::default());
    }
}

type CascadesData<'a> = (
    Entity,
    &'a GiCascades,
    Option<&'a ProbeSet>,
    Option<&'a Children>,
);
type Changes = Or<(Changed<GiCascades>, Changed<ProbeSet>)>;

/// Makes the volumes what their cascades say.
fn update_volumes(
    mut commands: Commands,
    all: Query<CascadesData, Changes>,
    owners: Query<&Children, With<GiCascades>>,
    volumes: Query<&Cascade>,
    mut unset: RemovedComponents<ProbeSet>,
) {
    for owner in unset.read() {
        for child in owners.get(owner).into_iter().flatten() {
            if volumes.contains(*child) {
                commands.entity(*child).try_remove::<ProbeSet>();
            }
        }
    }
    for (owner, cascades, set, children) in &all {
        let mut missing: Vec<u32> = (0..cascades.levels).collect();
        for child in children.into_iter().flatten() {
            let Ok(Cascade(level)) = volumes.get(*child) else {
                continue;
            };
            if *level < cascades.levels {
                missing.retain(|other| other != level);
                commands.entity(*child).insert(cascades.volume(*level));
            } else {
                commands.entity(*child).despawn();
            }
        }
        for level in missing {
            let name = Name::new(format!("cascade {level}"));
            commands.spawn((name, Cascade(level), cascades.volume(level), ChildOf(owner)));
        }
        if let Some(set) = set.copied() {
            commands.queue(move |world: &mut World| give_set(world, owner, set));
        }
    }
}

/// All volumes, those that were just made included, get the probe set of their owner.
fn give_set(world: &mut World, owner: Entity, set: ProbeSet) {
    let Some(children) = world.get::<Children>(owner) else {
        return;
    };
    let children: Vec<Entity> = children.iter().collect();
    for child in children {
        if world.get::<Cascade>(child).is_some() {
            world.entity_mut(child).insert(set);
        }
    }
}

/// Volumes go with their cascades, also where the entity stays.
fn remove_volumes(
    removed: On<Remove, GiCascades>,
    children: Query<&Children>,
    volumes: Query<&Cascade>,
    mut commands: Commands,
) {
    for child in children.get(removed.entity).into_iter().flatten() {
        if volumes.contains(*child) {
            commands.entity(*child).try_despawn();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{gpu::statistics::GiStatistics, settings::tests::check_ranges};

    fn app() -> App {
        let mut app = App::new();
        app.init_resource::<GiStatistics>()
            .add_plugins(CascadesPlugin);
        app
    }

    fn volumes(app: &mut App) -> Vec<(GiVolume, Option<ProbeSet>)> {
        let world = app.world_mut();
        let mut query = world.query::<(&GiVolume, Option<&ProbeSet>)>();
        let mut all: Vec<_> = query
            .iter(world)
            .map(|(volume, set)| (*volume, set.copied()))
            .collect();
        all.sort_by(|a, b| a.0.extent.x.total_cmp(&b.0.extent.x));
        all
    }

    #[test]
    fn volumes_are_nested_and_follow_their_parameters() {
        let mut app = app();
        let owner = app.world_mut().spawn(GiCascades::default()).id();
        app.update();
        let first = volumes(&mut app);
        assert_eq!(first.len(), 3);
        for (inner, outer) in first.iter().zip(&first[1..]) {
            assert!((outer.0.extent / inner.0.extent - 2.5).abs().max_element() < 1e-5);
            assert!(inner.0.follow_camera);
        }
        let set = ProbeSet::default().with_resolution(12);
        let cascades = GiCascades {
            levels: 9,
            ..Default::default()
        };
        app.world_mut().entity_mut(owner).insert((cascades, set));
        app.update();
        let more = volumes(&mut app);
        assert_eq!(more.len(), 4);
        assert!(more.iter().all(|(_, own)| *own == Some(set)));
        let cascades = GiCascades {
            levels: 1,
            ..Default::default()
        };
        app.world_mut().entity_mut(owner).insert(cascades);
        app.update();
        assert_eq!(volumes(&mut app).len(), 1);
        app.world_mut().entity_mut(owner).remove::<GiCascades>();
        app.update();
        assert_eq!(volumes(&mut app).len(), 0);
    }

    #[test]
    fn every_number_has_a_range() {
        check_ranges::<GiCascades>();
    }
}
