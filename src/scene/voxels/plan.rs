//! When a volume is voxelized anew, and for how many bricks there is room: the decisions alone, without a GPU.

use bevy::math::{UVec3, Vec3};

use crate::scene::volume::Grid;

/// Everything whose change makes the voxels wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Content {
    /// Version of the meshes that take part.
    pub casters: u64,
    /// See [`GpuVoxelize::emission`](super::types::GpuVoxelize::emission).
    pub emission: Vec3,
    pub grid: Grid,
}

/// What a frame would draw along the three axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Views {
    /// Whether every pipeline is compiled: until then, meshes are missing.
    pub compiled: bool,
    /// Whether a mesh came, went, or is drawn in another way since the frame before.
    pub changed: bool,
    /// Whether a mesh is missing, as its assets are.
    pub waits: bool,
}

/// What the voxels show.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Progress {
    /// `None` at first, and after a capture in which something may have been missing.
    captured: Option<Content>,
    /// Whether a mesh was missing then, as its assets were.
    waits: bool,
}

impl Progress {
    /// Whether the volume is captured in this frame, so that its voxels show `now`. What is `frozen` stays as it is
    /// once it is complete.
    pub fn step(&mut self, now: Content, views: Views, frozen: bool) -> bool {
        let complete = self.captured.is_some() && !self.waits;
        let same = self.captured == Some(now) && !views.changed;
        if same || (frozen && complete) {
            return false;
        }
        // While pipelines are compiled, the scene is captured each frame: it grows complete.
        self.captured = (views.compiled && !views.changed).then_some(now);
        self.waits = views.waits;
        true
    }
}

/// The pool of a volume.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pool {
    /// Voxels of the grid along each axis.
    pub dims: UVec3,
    /// Slots for bricks.
    pub capacity: u32,
    /// Slots that the last capture lacked, as far as is known.
    pub missing: u32,
}

/// What a volume needs, where anybody reads its voxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    pub grid: Grid,
    /// Slots for which a buffer of the device has room.
    pub most: u64,
    /// Whether the passes that fill the pool are compiled.
    pub ready: bool,
}

/// What happens to the memory of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Memory {
    /// It stays as it is.
    Keep,
    /// It is given back.
    Release,
    /// It is made anew with that many slots, and nothing is captured yet.
    Allocate(u32),
    /// It stays, although that many slots would be needed: no buffer of the device has room for more.
    Short(u32),
}

/// What happens to the memory of a volume that has `pool`, if any, where there is a `demand`, if any.
pub(super) fn memory(pool: Option<Pool>, demand: Option<Demand>) -> Memory {
    let Some(demand) = demand else {
        return Memory::Release;
    };
    match pool {
        None if demand.ready => Memory::Allocate(demand.usual()),
        None => Memory::Keep,
        Some(pool) if pool.dims != demand.grid.dims => Memory::Allocate(demand.usual()),
        Some(Pool { missing: 0, .. }) => Memory::Keep,
        Some(pool) => {
            let needed = pool.capacity + pool.missing;
            // An eighth more: the next capture may have more surfaces.
            match demand.slots(needed + needed / 8) {
                slots if slots > pool.capacity => Memory::Allocate(slots),
                _ => Memory::Short(needed),
            }
        }
    }
}

impl Demand {
    fn bricks(&self) -> u32 {
        self.grid.bricks().element_product()
    }

    /// As many slots as are `wanted`, needed and possible.
    fn slots(&self, wanted: u32) -> u32 {
        u64::from(wanted.min(self.bricks())).min(self.most) as u32
    }

    /// Slots that scenes usually need. Surfaces fill bricks with the square of the resolution, volumes have its
    /// cube: a quarter is enough for most. Where it is not, the first capture tells.
    fn usual(&self) -> u32 {
        self.slots((self.bricks() / 4).clamp(2048, 65536))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid {
        origin: Vec3::ZERO,
        voxel: 0.1,
        dims: UVec3::splat(128),
        levels: 6,
    };

    /// Of [`GRID`].
    const BRICKS: u32 = 32 * 32 * 32;

    /// A volume, and what its frames find.
    struct Volume {
        progress: Progress,
        content: Content,
        views: Views,
        frozen: bool,
    }

    impl Volume {
        /// Never captured.
        fn new() -> Self {
            Self {
                progress: Progress::default(),
                content: Content {
                    casters: 1,
                    emission: Vec3::ONE,
                    grid: GRID,
                },
                views: Views {
                    compiled: true,
                    changed: false,
                    waits: false,
                },
                frozen: false,
            }
        }

        /// Captured, and at rest.
        fn settled() -> Self {
            let mut volume = Self::new();
            assert_eq!(volume.frames(3), [true, false, false]);
            volume
        }

        /// Whether it is captured in a frame.
        fn frame(&mut self) -> bool {
            let Self { content, views, .. } = *self;
            let captured = self.progress.step(content, views, self.frozen);
            // Meshes have come, or gone, only once.
            self.views.changed = false;
            captured
        }

        fn frames(&mut self, count: usize) -> Vec<bool> {
            (0..count).map(|_| self.frame()).collect()
        }
    }

    type Change = fn(&mut Volume);

    #[test]
    fn what_changes_decides_whether_a_volume_is_captured() {
        // What changes, and for how many frames the volume is captured then.
        let cases: [(&str, Change, usize); 8] = [
            ("nothing", |_| {}, 0),
            ("a mesh moves", |v| v.content.casters += 1, 1),
            ("the grid scrolls", |v| v.content.grid.origin.x += 1.6, 1),
            ("finer voxels", |v| v.content.grid.voxel = 0.05, 1),
            ("the exposure", |v| v.content.emission *= 2.0, 1),
            // What a mesh is drawn with comes a frame after the mesh itself.
            ("a mesh comes", |v| v.views.changed = true, 2),
            ("an asset is missing", |v| v.views.waits = true, 0),
            (
                "a mesh moves, and an asset is missing",
                |v| {
                    v.content.casters += 1;
                    v.views.waits = true;
                },
                1,
            ),
        ];
        for (what, change, captures) in cases {
            let mut volume = Volume::settled();
            change(&mut volume);
            let frames = volume.frames(4);
            assert!(frames.is_sorted_by(|a, b| a >= b), "{what}: {frames:?}");
            let count = frames.iter().filter(|captured| **captured).count();
            assert_eq!(count, captures, "{what}");
        }
    }

    #[test]
    fn what_moves_all_the_time_is_captured_all_the_time() {
        let mut volume = Volume::settled();
        for _ in 0..10 {
            volume.content.casters += 1;
            assert!(volume.frame());
        }
        assert!(!volume.frame());
    }

    #[test]
    fn a_volume_is_captured_until_every_pipeline_is_compiled() {
        let mut volume = Volume::new();
        volume.views.compiled = false;
        assert_eq!(volume.frames(5), [true; 5]);
        volume.views.compiled = true;
        assert_eq!(volume.frames(3), [true, false, false]);
    }

    #[test]
    fn what_is_frozen_stays_as_it_is_once_it_is_complete() {
        // What happens while it is frozen, and whether it is captured then.
        let cases: [(&str, Change, [bool; 3]); 6] = [
            ("a mesh moves", |v| v.content.casters += 1, [false; 3]),
            ("a mesh comes", |v| v.views.changed = true, [false; 3]),
            (
                "the grid scrolls",
                |v| v.content.grid.origin.x += 1.6,
                [false; 3],
            ),
            (
                "it was never captured",
                |v| v.progress = Progress::default(),
                [true, false, false],
            ),
            (
                "pipelines were missing",
                |v| {
                    v.progress = Progress::default();
                    v.views.compiled = false;
                    assert!(v.frame());
                    v.views.compiled = true;
                },
                [true, false, false],
            ),
            (
                "an asset was missing, and comes",
                |v| {
                    v.progress = Progress::default();
                    v.views.waits = true;
                    assert_eq!(v.frames(2), [true, false]);
                    v.views.waits = false;
                    v.views.changed = true;
                },
                [true, true, false],
            ),
        ];
        for (what, change, captured) in cases {
            let mut volume = Volume::settled();
            volume.frozen = true;
            change(&mut volume);
            assert_eq!(volume.frames(3), captured, "{what}");
        }
    }

    #[test]
    fn demand_and_captures_decide_the_memory() {
        let demand = Demand {
            grid: GRID,
            most: u64::MAX,
            ready: true,
        };
        let pool = Pool {
            dims: GRID.dims,
            capacity: BRICKS / 4,
            missing: 0,
        };
        let lacking = |missing| Some(Pool { missing, ..pool });
        let with = |change: fn(&mut Demand)| {
            let mut demand = demand;
            change(&mut demand);
            Some(demand)
        };
        let compiling = with(|d| d.ready = false);
        let small_device = with(|d| d.most = u64::from(BRICKS) / 4);
        let small_grid = with(|d| d.grid.dims = UVec3::new(64, 64, 32));
        let large_grid = with(|d| d.grid.dims = UVec3::splat(512));
        use Memory::*;
        let cases: [(&str, Option<Pool>, Option<Demand>, Memory); 13] = [
            ("nobody reads", Some(pool), None, Release),
            ("nobody has read", None, None, Release),
            ("pipelines are compiled", None, compiling, Keep),
            ("the first reader", None, Some(demand), Allocate(BRICKS / 4)),
            ("nothing changes", Some(pool), Some(demand), Keep),
            // No more slots than bricks, and at least 2048 if there are.
            ("a small grid", Some(pool), small_grid, Allocate(2048)),
            ("a large grid", Some(pool), large_grid, Allocate(65536)),
            (
                "another grid, and what the one before lacked",
                lacking(100),
                small_grid,
                Allocate(2048),
            ),
            ("a small device", None, small_device, Allocate(BRICKS / 4)),
            (
                "slots are missing: an eighth more",
                lacking(BRICKS / 4),
                Some(demand),
                Allocate(BRICKS / 2 + BRICKS / 16),
            ),
            (
                "slots are missing: one for each brick",
                lacking(BRICKS / 4 * 3),
                Some(demand),
                Allocate(BRICKS),
            ),
            (
                "slots are missing on a small device",
                lacking(100),
                small_device,
                Short(BRICKS / 4 + 100),
            ),
            ("compiled again", Some(pool), compiling, Keep),
        ];
        for (what, pool, demand, expected) in cases {
            assert_eq!(memory(pool, demand), expected, "{what}");
        }
    }

    #[test]
    fn a_larger_pool_is_captured_anew_also_while_it_is_frozen() {
        let mut volume = Volume::settled();
        volume.frozen = true;
        // What `Memory::Allocate` does.
        volume.progress = Progress::default();
        assert_eq!(volume.frames(2), [true, false]);
    }
}
