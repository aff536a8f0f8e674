//! [`ProbeSet`] and [`ProbePin`]: placement of probes.

use bevy::{
    ecs::prelude::*,
    math::{UVec3, Vec3},
    reflect::prelude::*,
    transform::components::Transform,
};
use serde::{Deserialize, Serialize};

use super::Grid;
use crate::settings::{Clamp, Parameters, ParametersKind};

/// Maximum number of probes along a side of a volume: the highest [`ProbeSet::resolution`], and one more in a
/// volume that moves.
pub(crate) const MAX_PROBES: u32 = MAX_RESOLUTION + 1;
const MAX_RESOLUTION: u32 = 64;

/// Which cells of a volume's lattice have a probe.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum ProbePlacement {
    /// All cells.
    #[default]
    Volume,
    /// The cells of the bounding box of all meshes in the volume, and one more to each side. For volumes that
    /// are larger than their contents. When the box grows or shrinks by a cell, the light of all probes is
    /// computed anew.
    Automatic,
}

/// Places a single probe by hand, where the lattice misses a niche or a lamp needs a closer probe.
///
/// The probe in whose cell the entity's `Transform` lies moves to that point, and is not moved out of geometry.
/// Maximum 256 in a volume.
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
#[require(Transform)]
pub struct ProbePin;

/// Placement of the probes of a [`GiVolume`](crate::GiVolume), for techniques that use probes. Each
/// volume has one: a required component, with the default unless it is spawned with another.
///
/// Probes stand in the centres of the cubic cells of a lattice over the whole volume. Light is interpolated
/// between them, so the cells should be smaller than the objects that cast shadows of indirect light, and half
/// the height of a room at most.
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ProbeSet {
    /// Number of probes along the longest side of the volume. Probes stand at least two and a half voxels
    /// apart, so that a coarse volume has fewer. Range 4..=64, default 24. Cost: with the cube, in memory and
    /// while light changes.
    pub resolution: u32,
    /// Which cells have a probe. Default [`ProbePlacement::Volume`]. To place single probes, use [`ProbePin`];
    /// around a camera that travels far, use [`GiCascades`](crate::GiCascades).
    pub placement: ProbePlacement,
    /// Number of rays that each probe traces through the voxels to find the surfaces around it. Rounded to the
    /// square of an even number. Range 36..=256, default 64. Cost: proportional, in memory and while things
    /// change.
    pub rays: u32,
    /// Whether probes in or close to geometry move to where they see more, by half a cell at most. Default
    /// `true`. Cost: a few rays for each of them, once per capture.
    pub relocation: bool,
    /// Whether a probe lights only the points that it sees, according to its depths (Chebyshev's inequality, as
    /// in variance shadow maps). Without it, light leaks through walls. Default `true`. Cost: a texture read
    /// for each of the eight probes around a point.
    pub visibility: bool,
    /// Whether some probes are updated only every fourth frame while light changes continuously: those more
    /// than two cells away from any surface, and those whose light changed by less than 1 % in their last
    /// update. Default `true`. Saves up to three quarters of the cost of these probes.
    pub sleeping: bool,
    /// Distance from the surface, along its normal, at which the visibility of probes is tested. A fraction of
    /// a cell. Range 0..=1, default 0.25. Too low: surfaces shade themselves. Too high: light leaks.
    pub bias: f32,
}

impl Default for ProbeSet {
    fn default() -> Self {
        Self {
            resolution: 24,
            placement: ProbePlacement::Volume,
            rays: 64,
            relocation: true,
            visibility: true,
            sleeping: true,
            bias: 0.25,
        }
    }
}

impl ProbeSet {
    /// The same set with `resolution` probes along the longest side.
    pub fn with_resolution(self, resolution: u32) -> Self {
        Self { resolution, ..self }
    }

    /// Rays along a side of the octahedral map of a probe's surroundings.
    pub(crate) fn ray_side(&self) -> u32 {
        2 * ((self.rays as f32).sqrt() / 2.0).round() as u32
    }
}

impl Parameters for ProbeSet {
    const KIND: ParametersKind = ParametersKind::Scene;

    fn clamp(&mut self, c: &mut Clamp) {
        c.int("resolution", &mut self.resolution, 4, MAX_RESOLUTION)
            .unit("probes");
        c.int("rays", &mut self.rays, 36, 256);
        c.float("bias", &mut self.bias, 0.0, 1.0);
    }
}

/// The lattice of a volume's probes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Corner of the first cell, metres.
    pub origin: Vec3,
    /// Side of a cell, metres.
    pub cell: f32,
    /// Cells along each axis, one probe each.
    pub dims: UVec3,
}

/// Voxels along a cell at least. Nearer to each other, the probes beside a surface stand in its own voxels, and see
/// nothing.
const LEAST_VOXELS: f32 = 2.5;

/// Side of a cell, metres.
fn cell(set: &ProbeSet, grid: &Grid) -> f32 {
    let wanted = grid.size().max_element() / set.resolution as f32;
    wanted.max(LEAST_VOXELS * grid.voxel)
}

impl Lattice {
    /// The lattice of a (clamped) set in a volume's grid.
    pub fn new(set: &ProbeSet, grid: &Grid) -> Self {
        let size = grid.size();
        let cell = cell(set, grid);
        let dims = (size / cell - 1e-3).ceil().max(Vec3::ONE);
        Self {
            origin: grid.center() - 0.5 * dims * cell,
            cell,
            dims: dims.as_uvec3(),
        }
    }

    /// The lattice of a (clamped) set in a volume's grid that moves: its cells keep their places in the world,
    /// so that probes keep what they know. One more along each axis makes up for what the ends cut off.
    pub fn moving(set: &ProbeSet, grid: &Grid) -> Self {
        let size = grid.size();
        let cell = cell(set, grid);
        Self {
            // A little more, since a grid whose steps are whole cells is only nearly at one.
            origin: (grid.origin / cell + 1e-2).floor() * cell,
            cell,
            dims: ((size / cell - 1e-3).ceil().max(Vec3::ONE) + 1.0).as_uvec3(),
        }
    }

    /// Its cells around a box, and one more to each side.
    pub fn around(&self, min: Vec3, max: Vec3) -> Self {
        let dims = self.dims.as_vec3();
        let low = ((min - self.origin) / self.cell).floor() - 1.0;
        let low = low.clamp(Vec3::ZERO, dims - 1.0);
        let high = ((max - self.origin) / self.cell).ceil() + 1.0;
        let high = high.clamp(low + 1.0, dims);
        Self {
            origin: self.origin + low * self.cell,
            cell: self.cell,
            dims: (high - low).as_uvec3(),
        }
    }

    /// Number of probes.
    pub fn count(&self) -> u32 {
        self.dims.element_product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{scene::volume::GiVolume, settings::tests::check_ranges};

    /// Or those beside a surface would stand in it.
    #[test]
    fn probes_stand_voxels_apart() {
        let volume = GiVolume::default().with_resolution(32);
        let grid = Grid::new(&volume, Vec3::ONE, Vec3::ONE).unwrap();
        for resolution in [4, 24, 64] {
            let set = ProbeSet::default().with_resolution(resolution);
            assert!(Lattice::new(&set, &grid).cell >= LEAST_VOXELS * grid.voxel);
            assert!(Lattice::moving(&set, &grid).cell >= LEAST_VOXELS * grid.voxel);
        }
    }

    #[test]
    fn a_lattice_covers_its_volume_with_cubes() {
        for resolution in [4, 10, 24, 64] {
            let volume = GiVolume::new(Vec3::new(30.0, 12.5, 15.0)).with_resolution(256);
            let grid = Grid::new(&volume, Vec3::ONE, Vec3::ONE).unwrap();
            let set = ProbeSet::default().with_resolution(resolution);
            let lattice = Lattice::new(&set, &grid);
            let size = lattice.dims.as_vec3() * lattice.cell;
            assert_eq!(lattice.dims.max_element(), resolution);
            assert!(size.cmpge(grid.size() - 0.01 * lattice.cell).all());
            assert!((size - grid.size()).max_element() < lattice.cell);
            assert!((lattice.origin + 0.5 * size - grid.center()).length() < 1e-3);
        }
    }

    #[test]
    fn a_moving_lattice_covers_its_volume_and_steps_in_whole_cells() {
        for resolution in [4, 10, 24, 64] {
            let volume = GiVolume::default().with_resolution(256).following_camera();
            let set = ProbeSet::default().with_resolution(resolution);
            let at = |x: f32| Grid::new(&volume, Vec3::new(x, 1.0, -x), Vec3::ONE).unwrap();
            let first = Lattice::moving(&set, &at(0.0));
            for i in 0..100 {
                let grid = at(0.37 * i as f32);
                let lattice = Lattice::moving(&set, &grid);
                assert_eq!(lattice.dims, first.dims);
                let steps = (lattice.origin - first.origin) / first.cell;
                assert!(
                    (steps - steps.round()).abs().max_element() < 1e-3,
                    "{steps}"
                );
                let end = lattice.origin + lattice.dims.as_vec3() * lattice.cell;
                let within = 0.02 * lattice.cell;
                assert!(lattice.origin.cmple(grid.origin + within).all());
                assert!(end.cmpge(grid.origin + grid.size() - within).all());
            }
        }
    }

    #[test]
    fn a_lattice_around_a_box_is_a_part_of_it() {
        let grid = Grid::new(&GiVolume::default(), Vec3::ZERO, Vec3::ONE).unwrap();
        let all = Lattice::new(&ProbeSet::default(), &grid);
        let part = all.around(Vec3::new(-1.0, 0.0, -2.0), Vec3::new(1.0, 0.5, 3.0));
        let steps = (part.origin - all.origin) / all.cell;
        assert!((steps - steps.round()).abs().max_element() < 1e-3);
        assert!(part.count() < all.count());
        let end = part.origin + part.dims.as_vec3() * part.cell;
        assert!(
            (part.origin + part.cell)
                .cmple(Vec3::new(-1.0, 0.0, -2.0))
                .all()
        );
        assert!((end - part.cell).cmpge(Vec3::new(1.0, 0.5, 3.0)).all());
        // What lies outside, or is larger, leaves something to stand on.
        assert!(all.around(Vec3::splat(90.0), Vec3::splat(91.0)).count() >= 1);
        assert_eq!(all.around(Vec3::splat(-90.0), Vec3::splat(90.0)), all);
    }

    #[test]
    fn rays_fill_a_square_map() {
        for (rays, side) in [(36, 6), (64, 8), (80, 8), (82, 10), (256, 16)] {
            let set = ProbeSet {
                rays,
                ..Default::default()
            };
            assert_eq!(set.ray_side(), side, "{rays}");
        }
    }

    #[test]
    fn bad_sets_are_clamped() {
        let mut set = ProbeSet {
            resolution: 0,
            rays: 1_000_000,
            bias: f32::NAN,
            ..Default::default()
        };
        assert_eq!(Clamp::apply("ProbeSet", &mut set).len(), 3);
        assert_eq!((set.resolution, set.rays, set.bias), (4, 256, 0.0));
        check_ranges::<ProbeSet>();
    }
}
