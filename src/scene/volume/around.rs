//! [`GiVolume::around`]: a volume that fits what it is to light.

use bevy::{math::Vec3, transform::components::Transform};

use super::{GiVolume, ProbeSet};
use crate::settings::Clamp;

impl GiVolume {
    /// A volume, with its `Transform`, that fully lights everything between two corners (metres), surfaces on
    /// the border included. It has `resolution` voxels along its longest side.
    ///
    /// The volume extends beyond the corners by the margin that voxels and the probes of a default
    /// [`ProbeSet`] need on the outer side of a surface. Its fade is 0, since nothing lies
    /// beyond.
    ///
    /// ```no_run
    /// # use bevy::prelude::*;
    /// # use bevy_gi::prelude::*;
    /// fn setup(mut commands: Commands) {
    ///     commands.spawn(GiVolume::around(Vec3::ZERO, Vec3::new(8.0, 3.0, 5.0), 128));
    /// }
    /// ```
    pub fn around(min: Vec3, max: Vec3, resolution: u32) -> (Self, Transform) {
        let mut volume = Self::new((max - min).abs()).with_resolution(resolution);
        Clamp::apply("GiVolume", &mut volume);
        let voxels = volume.resolution as f32;
        // The outermost probes, half a cell within the border, must stand before a plane to light it. Half a voxel more
        // puts the planes of the longest side into the middle of voxels: rounding would choose between two.
        let half_cell = 0.5 * voxels / ProbeSet::default().resolution as f32;
        let margin = f32::max(2.0, (half_cell + 1.0).floor()) + 0.5;
        // The volume's longest side is the scene's and both margins, in voxels of the volume.
        let voxel = volume.extent.max_element() / (voxels - 2.0 * margin);
        volume.extent += 2.0 * margin * voxel;
        volume.fade = 0.0;
        (volume, Transform::from_translation(0.5 * (min + max)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{probes::Lattice, volume::Grid};

    #[test]
    fn around_reaches_beyond_its_fade_at_every_size_and_shape() {
        for resolution in [0, 32, 60, 64, 100, 128, 300, 512] {
            for size in [
                Vec3::ONE,
                Vec3::new(8.0, 3.0, 5.0),
                Vec3::new(100.0, 0.0, 60.0),
                Vec3::new(0.0, 2.0, 0.0),
            ] {
                for scale in [1e-3, 1.0, 1e3] {
                    let (min, max) = (Vec3::splat(-scale), size * scale - scale);
                    let (volume, at) = GiVolume::around(min, max, resolution);
                    let grid = Grid::new(&volume, at.translation, Vec3::ONE).unwrap();
                    let fade = volume.fade * grid.size().min_element();
                    let margin = (min - grid.origin).min(grid.origin + grid.size() - max);
                    let voxels = (margin.min_element() - fade) / grid.voxel;
                    let lattice = Lattice::new(&ProbeSet::default(), &grid);
                    let outermost = lattice.origin + 0.5 * lattice.cell;
                    let before = (min - outermost).min_element() / grid.voxel;
                    assert!(before > 0.49, "{before} voxels from a probe to a plane");
                    assert!(
                        voxels > 1.9,
                        "{size} x {scale}, {resolution}: {voxels} voxels"
                    );
                }
            }
        }
    }
}
