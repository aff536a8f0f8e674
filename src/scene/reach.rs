//! Which places of the world matter to the light inside of the volumes: what stands elsewhere is not captured.

use bevy::{
    ecs::prelude::*,
    math::{
        Vec3, Vec3A,
        bounding::{Aabb3d, BoundingVolume},
    },
};

use super::{
    bounds::{Beam, overlaps},
    volume::VolumeGrid,
    world::{
        lights::{LightQueries, SceneLight},
        viewers::Viewers,
    },
};
use crate::settings::GiSettings;

/// The places: what bounces light into a volume, and what stands between a light and a volume.
#[derive(Resource, Default)]
pub(crate) struct SceneReach {
    /// Around the volumes, and between them and the lamps that reach into them.
    boxes: Vec<Aabb3d>,
    /// For each directional light, the volumes as it sees them: what stands before them casts into them, however far
    /// away.
    beams: Vec<(Beam, Vec<Aabb3d>)>,
}

impl SceneReach {
    fn new(volumes: &[Aabb3d], lights: &[SceneLight]) -> Self {
        // Surfaces beside a volume are lit by lamps inside, and light it in turn; not farther away than it is wide.
        let around = volumes
            .iter()
            .map(|v| v.grow(Vec3A::splat(2.0 * v.half_size().max_element())));
        let mut boxes: Vec<_> = around.collect();
        let mut beams = Vec::<(Vec3, Beam, Vec<Aabb3d>)>::new();
        for light in lights {
            let Some(lit) = light.reach() else {
                let direction = light.gpu.direction;
                if beams.iter().all(|(other, ..)| *other != direction) {
                    let beam = Beam::new(direction);
                    let seen = volumes.iter().map(|volume| beam.bounds(volume)).collect();
                    beams.push((direction, beam, seen));
                }
                continue;
            };
            let at = Aabb3d::new(light.gpu.position, Vec3::ZERO);
            for volume in volumes.iter().filter(|volume| overlaps(&lit, volume)) {
                let between = at.merge(volume);
                if !boxes.iter().any(|known| known.contains(&between)) {
                    boxes.push(between);
                }
            }
        }
        Self {
            boxes,
            beams: beams
                .into_iter()
                .map(|(_, beam, seen)| (beam, seen))
                .collect(),
        }
    }

    /// The bounds of what matters; `None` in place of bounds: they are unknown, and it may be anywhere.
    pub fn reached_by(&self, bounds: Option<Aabb3d>) -> Option<Aabb3d> {
        match bounds {
            Some(bounds) => self.touches(&bounds).then_some(bounds),
            None => self.boxes.iter().copied().reduce(|a, b| a.merge(&b)),
        }
    }

    /// Whether what has these bounds matters.
    fn touches(&self, bounds: &Aabb3d) -> bool {
        self.boxes.iter().any(|place| overlaps(place, bounds))
            || self.beams.iter().any(|(beam, seen)| {
                let caster = beam.bounds(bounds);
                seen.iter().any(|lit| Beam::casts(&caster, lit))
            })
    }
}

pub(crate) fn find_reach(
    volumes: Query<&VolumeGrid>,
    settings: Res<GiSettings>,
    viewers: Res<Viewers>,
    lights: LightQueries,
    mut reach: ResMut<SceneReach>,
) {
    let volumes: Vec<_> = volumes
        .iter()
        .filter_map(|grid| grid.0)
        .map(|g| g.bounds())
        .collect();
    *reach = match volumes.is_empty() {
        true => SceneReach::default(),
        false => SceneReach::new(&volumes, &lights.collect(&settings, &viewers)),
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::world::lights::{GpuLight, LightKind};

    fn cube(center: Vec3) -> Aabb3d {
        Aabb3d::new(center, Vec3::splat(0.5))
    }

    fn light(gpu: GpuLight) -> SceneLight {
        SceneLight {
            entity: Entity::PLACEHOLDER,
            layers: Default::default(),
            gpu,
            shadows: true,
            rsm_size: None,
            rsm_interval: 1,
        }
    }

    /// A roof a kilometre above casts into the volume; what stands beside its shadow does not, nor what is below.
    #[test]
    fn a_sun_is_kept_out_from_any_distance() {
        let sun = light(GpuLight {
            kind: LightKind::Directional as u32,
            direction: Vec3::NEG_Y,
            ..Default::default()
        });
        let reach = SceneReach::new(&[Aabb3d::new(Vec3::ZERO, Vec3::ONE)], &[sun]);
        assert!(reach.touches(&cube(Vec3::new(0.0, 1000.0, 0.0))));
        assert!(!reach.touches(&cube(Vec3::new(20.0, 1000.0, 0.0))));
        assert!(!reach.touches(&cube(Vec3::new(0.0, -1000.0, 0.0))));
    }

    /// What stands between a far lamp and the volume matters, if the lamp gets there at all.
    #[test]
    fn lamps_outside_of_a_volume_count() {
        let lamp = |range| {
            light(GpuLight {
                kind: LightKind::Point as u32,
                position: Vec3::X * 100.0,
                range,
                ..Default::default()
            })
        };
        let volume = Aabb3d::new(Vec3::ZERO, Vec3::ONE);
        let between = cube(Vec3::X * 50.0);
        assert!(SceneReach::new(&[volume], &[lamp(200.0)]).touches(&between));
        assert!(!SceneReach::new(&[volume], &[lamp(60.0)]).touches(&between));
        assert!(!SceneReach::new(&[volume], &[lamp(200.0)]).touches(&cube(Vec3::Y * 50.0)));
    }
}
