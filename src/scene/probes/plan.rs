//! Where probes stand, and when they trace rays: the decisions alone, without a GPU.

use bevy::math::{UVec3, Vec3, Vec4};

use crate::scene::volume::Grid;
use crate::scene::volume::{Lattice, ProbeSet};

/// Bytes of a ray's hit: what it met, and how far away.
const HIT_BYTES: u32 = 8;

/// How the probes of a volume are placed, but for those that are placed by hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    pub set: ProbeSet,
    /// Whether the volume follows the camera.
    pub moves: bool,
    /// The box around all meshes, where only its cells have probes.
    pub around: Option<(Vec3, Vec3)>,
}

impl Placement {
    /// The lattice in a volume's grid: as fine as the set wants it, or as `most` probes allow.
    pub fn lattice(&self, grid: &Grid, most: u64) -> Lattice {
        let with = |resolution| {
            let set = self.set.with_resolution(resolution);
            let all = match self.moves {
                true => Lattice::moving(&set, grid),
                false => Lattice::new(&set, grid),
            };
            self.around.map_or(all, |(min, max)| all.around(min, max))
        };
        (1..=self.set.resolution)
            .rev()
            .map(with)
            .find(|lattice| u64::from(lattice.count()) <= most)
            .unwrap_or_else(|| with(1))
    }

    /// Probes that fit a buffer of `largest` bytes, where a technique keeps `probe_bytes` for each.
    pub fn most(&self, largest: u64, probe_bytes: u32) -> u64 {
        let hits = HIT_BYTES * self.set.ray_side().pow(2);
        largest / u64::from(probe_bytes.max(hits))
    }
}

/// What decides the sizes of buffers and textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    /// Rays of each probe, as the set has them.
    pub rays: u32,
    /// Probes along each axis.
    pub dims: UVec3,
}

impl Shape {
    pub fn new(set: &ProbeSet, lattice: &Lattice) -> Self {
        Self {
            rays: set.rays,
            dims: lattice.dims,
        }
    }
}

/// What happens to the memory of a volume's probes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Memory {
    /// It stays as it is.
    Keep,
    /// It is made anew; nothing is seen yet.
    Allocate,
}

/// What happens to the memory of probes that have the shape `there`, if there are any, and should have the one that is
/// `wanted`. `ready` says whether their passes are compiled, and there are voxels to see.
pub(super) fn memory(there: Option<Shape>, wanted: Shape, ready: bool) -> Memory {
    let fits = match there {
        Some(there) => there == wanted,
        None => !ready,
    };
    match fits {
        true => Memory::Keep,
        false => Memory::Allocate,
    }
}

/// Everything whose change makes what probes have seen wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Content<'a> {
    /// Version of the voxels; 0 if they have not seen any.
    pub voxels: u64,
    pub set: ProbeSet,
    pub lattice: Lattice,
    /// Places by hand.
    pub pins: &'a [Vec4],
}

/// What a frame traces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    /// Whether probes are placed first, and get their depths from these rays.
    pub places: bool,
    /// Which set of directions the rays have.
    pub round: u32,
}

/// Which rays the next frame traces, so that probes that have seen `before` see `now`; `None` where they rest. The last
/// rays were those of `round`. Whoever wants to look `again` gets others.
pub(super) fn plan(before: &Content, now: &Content, round: u32, again: bool) -> Option<Plan> {
    let places = before != now;
    let plan = Plan {
        places,
        round: if places { 0 } else { round + 1 },
    };
    (places || again).then_some(plan)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::volume::{GiVolume, ProbePlacement};

    fn grid() -> Grid {
        let volume = GiVolume::new(Vec3::splat(12.0)).with_resolution(128);
        Grid::new(&volume, Vec3::ZERO, Vec3::ONE).unwrap()
    }

    const SET: ProbeSet = ProbeSet {
        resolution: 12,
        placement: ProbePlacement::Volume,
        rays: 64,
        relocation: true,
        visibility: true,
        sleeping: true,
        bias: 0.25,
    };

    #[test]
    fn what_changes_decides_what_probes_trace() {
        let lattice = Lattice::new(&SET, &grid());
        let before = Content {
            voxels: 3,
            set: SET,
            lattice,
            pins: &[],
        };
        type Change = fn(&mut Content);
        // What changes, and whether probes are placed anew.
        let cases: [(&str, Change, bool); 8] = [
            ("nothing", |_| {}, false),
            ("a mesh moves", |c| c.voxels += 1, true),
            ("the lattice scrolls", |c| c.lattice.origin.x += 1.0, true),
            ("the lattice grows", |c| c.lattice.dims.x += 1, true),
            ("a probe is pinned", |c| c.pins = &[Vec4::ONE], true),
            ("the bias", |c| c.set.bias = 0.5, true),
            ("relocation", |c| c.set.relocation = false, true),
            ("sleep", |c| c.set.sleeping = false, true),
        ];
        for (what, change, places) in cases {
            let mut now = before;
            change(&mut now);
            let placed = Plan { places, round: 0 };
            // After the sixth set of rays: who looks on gets the seventh, but a change starts with the first.
            let next = Plan { places, round: 6 };
            assert_eq!(
                plan(&before, &now, 5, false),
                places.then_some(placed),
                "{what}"
            );
            assert_eq!(
                plan(&before, &now, 5, true),
                Some(if places { placed } else { next }),
                "{what}, while a cache settles"
            );
        }
    }

    #[test]
    fn probes_look_along_other_rays_until_the_cache_has_settled() {
        let lattice = Lattice::new(&SET, &grid());
        let now = Content {
            voxels: 1,
            set: SET,
            lattice,
            pins: &[],
        };
        let mut before = Content { voxels: 0, ..now };
        let mut round = 0;
        let mut rounds = Vec::new();
        for frame in 0..6 {
            let traced = plan(&before, &now, round, (1..4).contains(&frame));
            before = now;
            round = traced.map_or(round, |plan| plan.round);
            rounds.push(traced.map(|plan| (plan.places, plan.round)));
        }
        let looks = |round| Some((false, round));
        let first = Some((true, 0));
        assert_eq!(rounds, [first, looks(1), looks(2), looks(3), None, None]);
    }

    #[test]
    fn memory_follows_rays_and_lattice() {
        let shape = Shape::new(&SET, &Lattice::new(&SET, &grid()));
        let rays = Shape { rays: 100, ..shape };
        let dims = Shape {
            dims: shape.dims + 1,
            ..shape
        };
        use Memory::*;
        let cases: [(&str, Option<Shape>, bool, Memory); 6] = [
            ("pipelines are compiled, or voxels", None, false, Keep),
            ("the first reader", None, true, Allocate),
            ("nothing changes", Some(shape), true, Keep),
            ("more or fewer rays", Some(rays), true, Allocate),
            ("another lattice", Some(dims), true, Allocate),
            (
                "another lattice, while pipelines are compiled again",
                Some(dims),
                false,
                Allocate,
            ),
        ];
        for (what, there, ready, expected) in cases {
            assert_eq!(memory(there, shape, ready), expected, "{what}");
        }
    }

    #[test]
    fn a_lattice_is_as_fine_as_it_is_wanted_and_fits() {
        let placement = Placement {
            set: SET,
            moves: false,
            around: None,
        };
        let count = |placement: Placement, most| placement.lattice(&grid(), most).count();
        let moving = Placement {
            moves: true,
            ..placement
        };
        let around = Placement {
            around: Some((Vec3::splat(-1.5), Vec3::splat(1.5))),
            ..placement
        };
        let cases: [(&str, Placement, u64, u32); 5] = [
            ("a fixed volume", placement, u64::MAX, 12 * 12 * 12),
            ("one that moves", moving, u64::MAX, 13 * 13 * 13),
            // Half a cell to each side, and one more.
            ("around meshes", around, u64::MAX, 6 * 6 * 6),
            ("what just fits", placement, 12 * 12 * 12, 12 * 12 * 12),
            ("what does not", placement, 12 * 12 * 12 - 1, 11 * 11 * 11),
        ];
        for (what, placement, most, expected) in cases {
            assert_eq!(count(placement, most), expected, "{what}");
        }
        // What is larger decides: a probe's 64 rays, or what a technique keeps for it.
        assert_eq!(placement.most(51_200, 0), 100);
        assert_eq!(placement.most(51_200, 1024), 50);
        assert!(count(placement, 0) >= 1);
    }
}
