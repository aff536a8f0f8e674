//! Where the probes of each volume are wanted.

use bevy::{
    ecs::prelude::*,
    math::{Vec3, Vec4, bounding::BoundingVolume},
    render::{Extract, sync_world::RenderEntity},
    transform::components::GlobalTransform,
};

use super::plan::Placement;
use crate::scene::{
    bounds::overlaps,
    volume::{GiVolume, ProbePin, ProbePlacement, ProbeSet, VolumeGrid},
    world::casters::SceneCasters,
};

/// Most probes of a volume that are placed by hand.
const MAX_PINS: usize = 256;

/// Where the probes of a volume stand, in the render world.
#[derive(Component, Clone)]
pub(crate) struct ExtractedProbeSet {
    pub(super) placement: Placement,
    /// Places by hand.
    pub(super) pins: Vec<Vec4>,
}

type VolumeSet<'a> = (
    RenderEntity,
    &'a GiVolume,
    &'a VolumeGrid,
    Option<&'a ProbeSet>,
);

pub(super) fn extract_sets(
    mut commands: Commands,
    volumes: Extract<Query<VolumeSet>>,
    casters: Extract<Res<SceneCasters>>,
    pins: Extract<Query<&GlobalTransform, With<ProbePin>>>,
) {
    for (entity, volume, grid, set) in &volumes {
        let Some(grid) = grid.0 else { continue };
        let set = set.copied().unwrap_or_default();
        let bounds = grid.bounds();
        let around = (set.placement == ProbePlacement::Automatic).then(|| {
            let inside = casters.casters.iter().map(|caster| caster.bounds);
            let inside = inside.filter(|caster| overlaps(caster, &bounds));
            let all = inside.reduce(|a, b| a.merge(&b)).unwrap_or(bounds);
            (Vec3::from(all.min), Vec3::from(all.max))
        });
        let (min, max) = (Vec3::from(bounds.min), Vec3::from(bounds.max));
        let pins = pins.iter().map(GlobalTransform::translation);
        let pins = pins.filter(|pin| pin.cmpge(min).all() && pin.cmple(max).all());
        commands.entity(entity).insert(ExtractedProbeSet {
            placement: Placement {
                set,
                moves: volume.follow_camera,
                around,
            },
            pins: pins.take(MAX_PINS).map(|pin| pin.extend(0.0)).collect(),
        });
    }
}
