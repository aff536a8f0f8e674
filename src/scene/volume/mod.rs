//! What the user places: [`GiVolume`], the box in which global illumination is computed, [`GiCascades`] of volumes
//! around the camera, and the [`ProbeSet`] of a volume.

mod around;
pub(crate) mod cascades;
pub(crate) mod probe_set;

pub use cascades::GiCascades;
pub use probe_set::{Lattice, ProbePin, ProbePlacement, ProbeSet};

use bevy::{
    app::{App, Plugin, PostUpdate},
    ecs::prelude::*,
    log::warn,
    math::{UVec3, Vec3, Vec3A, bounding::Aabb3d},
    reflect::prelude::*,
    render::{
        Extract, ExtractSchedule, RenderApp,
        render_resource::ShaderType,
        sync_component::{SyncComponent, SyncComponentPlugin},
        sync_world::{MainEntity, RenderEntity},
    },
    transform::{TransformSystems, components::GlobalTransform, components::Transform},
};
use serde::{Deserialize, Serialize};

use crate::{
    camera::PrimaryGiCamera,
    settings::{Clamp, GiQuality, Parameters, ParametersKind, SettingsComponentPlugin},
};

/// A box in which global illumination is computed.
///
/// The entity's `Transform` places the centre, and its scale multiplies [`extent`](Self::extent). Its rotation
/// is ignored: grids are aligned with the world axes. Volumes may overlap; each pixel is lit by the volume with
/// the finest voxels, and volumes blend into each other over [`fade`](Self::fade) at their borders.
///
/// # Which size, which resolution?
///
/// Enclose everything that should be lit, walls included, with a margin of more than [`fade`](Self::fade) on
/// each side: towards the border, the volume lights less and less. [`around`](Self::around) makes a volume that
/// fits everything between two corners. A voxel (`longest side / resolution`) of a tenth of the smallest room's
/// height is fine enough for diffuse light, a thirtieth for reflections. Memory grows with the area of the
/// surfaces (bricks of voxels). Voxel cone tracing adds 55 bytes per cell of two voxels; a cube has
/// `(resolution / 2)^3` of these.
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
#[require(Transform)]
#[serde(default)]
pub struct GiVolume {
    /// Full size along the world axes in metres, before the scale of the transform. Each 0.0001..=100000,
    /// default 20 x 10 x 20.
    pub extent: Vec3,
    /// Voxels along the longest side. Range 32..=512, default 128. The other sides get as many cubic voxels as
    /// they need, rounded up to whole cells of the coarsest mip level.
    pub resolution: u32,
    /// Whether the volume follows the [primary camera](PrimaryGiCamera). It moves in whole cells of the
    /// coarsest mip level that is stable under motion. The translation of its `Transform` is an offset. Default
    /// `false`. Cost: the volume is voxelized and lit again at each step.
    pub follow_camera: bool,
    /// Width of the border inside the volume over which its light blends into that of coarser volumes, or into
    /// none. A fraction of the shortest side. Range 0..=0.5, default 0.05.
    pub fade: f32,
}

impl Default for GiVolume {
    fn default() -> Self {
        Self::new(Vec3::new(20.0, 10.0, 20.0))
    }
}

impl GiVolume {
    /// A fixed volume of `extent` metres at the default resolution.
    pub const fn new(extent: Vec3) -> Self {
        Self {
            extent,
            resolution: 128,
            follow_camera: false,
            fade: 0.05,
        }
    }

    /// The same volume with `resolution` voxels along its longest side.
    pub const fn with_resolution(self, resolution: u32) -> Self {
        Self { resolution, ..self }
    }

    /// The same volume at the resolution of a quality level: 64, 128, 192 or 256 voxels.
    pub const fn with_quality(self, quality: GiQuality) -> Self {
        self.with_resolution(match quality {
            GiQuality::Low => 64,
            GiQuality::Medium => 128,
            GiQuality::High => 192,
            GiQuality::Ultra => 256,
        })
    }

    /// The same volume, following the camera.
    pub const fn following_camera(self) -> Self {
        Self {
            follow_camera: true,
            ..self
        }
    }
}

/// Smallest side of a volume, metres.
const SMALLEST: f32 = 1e-4;

/// Largest side of a volume, metres.
pub(super) const LARGEST: f32 = 1e5;

impl Parameters for GiVolume {
    const KIND: ParametersKind = ParametersKind::Scene;

    fn clamp(&mut self, c: &mut Clamp) {
        for (name, side) in [
            ("extent.x", &mut self.extent.x),
            ("extent.y", &mut self.extent.y),
            ("extent.z", &mut self.extent.z),
        ] {
            c.float(name, side, SMALLEST, LARGEST).unit("m");
        }
        c.int("resolution", &mut self.resolution, 32, MAX_RESOLUTION)
            .unit("voxels");
        c.float("fade", &mut self.fade, 0.0, 0.5);
    }
}

/// Maximum number of voxels along a side of a volume.
pub(crate) const MAX_RESOLUTION: u32 = 512;

/// Voxels along the side of a brick, the unit of sparse storage.
pub const BRICK: u32 = 4;

/// The grid of a [`GiVolume`]: cubic voxels, aligned with the world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Corner of the first voxel, metres.
    pub origin: Vec3,
    /// Side of a voxel, metres.
    pub voxel: f32,
    /// Voxels along each axis, a whole number of cells of the coarsest level.
    pub dims: UVec3,
    /// Levels of the radiance mip chain; a cell of level `l` is `2 << l` voxels wide.
    pub levels: u32,
}

impl Grid {
    /// The grid of a (clamped) volume around `center`.
    ///
    /// `None` if a value is not finite.
    pub fn new(volume: &GiVolume, center: Vec3, scale: Vec3) -> Option<Self> {
        let extent = volume.extent * scale.abs();
        if !center.is_finite() || !extent.is_finite() || extent.min_element() <= 0.0 {
            return None;
        }
        let levels = match volume.resolution {
            0..64 => 4,
            64..128 => 5,
            _ => 6,
        };
        let coarsest = 1 << levels;
        let voxel = extent.max_element() / volume.resolution as f32;
        let dims = (extent / voxel / coarsest as f32)
            .map(|cells| (cells - 1e-4).ceil().max(1.0))
            .as_uvec3()
            * coarsest;
        // Rounded to voxels that a moving volume keeps in place: all but the two coarsest levels.
        let snap = voxel * (coarsest / 4) as f32;
        let corner = center - 0.5 * dims.as_vec3() * voxel;
        let origin = if volume.follow_camera {
            (corner / snap).floor() * snap
        } else {
            corner
        };
        (voxel > 0.0 && origin.is_finite()).then_some(Self {
            origin,
            voxel,
            dims,
            levels,
        })
    }

    /// Size along each axis, metres.
    pub fn size(&self) -> Vec3 {
        self.dims.as_vec3() * self.voxel
    }

    /// Centre, metres.
    pub fn center(&self) -> Vec3 {
        self.origin + 0.5 * self.size()
    }

    /// Its box, metres.
    pub fn bounds(&self) -> Aabb3d {
        Aabb3d {
            min: self.origin.into(),
            max: Vec3A::from(self.origin + self.size()),
        }
    }

    /// Bricks along each axis.
    pub fn bricks(&self) -> UVec3 {
        self.dims / BRICK
    }
}

/// [`Grid`] in WGSL.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuVolume {
    /// Metres.
    pub origin: Vec3,
    /// Metres.
    pub voxel: f32,
    /// Voxels.
    pub dims: UVec3,
    /// Levels of the radiance mip chain.
    pub levels: u32,
    /// Fraction of the shortest side over which the volume fades out.
    pub fade: f32,
    /// Index of the volume's own map among those of a directional light.
    pub light_map: u32,
}

/// The order of volumes: where several overlap, the one with the finest voxels comes first.
pub(crate) fn finest_first(a: (&Grid, Entity), b: (&Grid, Entity)) -> std::cmp::Ordering {
    a.0.voxel.total_cmp(&b.0.voxel).then(a.1.cmp(&b.1))
}

/// The volume's grid this frame, in the main world. `None` while it is invalid.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq)]
pub struct VolumeGrid(pub Option<Grid>);

/// A [`GiVolume`] in the render world.
#[derive(Component, Clone, Copy, Debug)]
pub struct ExtractedVolume {
    pub(crate) main: MainEntity,
    pub(crate) grid: Grid,
    pub(crate) fade: f32,
    /// Its place among all volumes, see [`finest_first`].
    pub(crate) rank: u32,
}

impl ExtractedVolume {
    pub(crate) fn gpu(&self) -> GpuVolume {
        GpuVolume {
            origin: self.grid.origin,
            voxel: self.grid.voxel,
            dims: self.grid.dims,
            levels: self.grid.levels,
            fade: self.fade,
            light_map: self.rank,
        }
    }
}

impl SyncComponent for GiVolume {
    /// What else hangs on a volume goes with it, see `with_volume`.
    type Target = ExtractedVolume;
}

/// Observer of the render world: a volume that is gone, or has no grid, takes `B` with it.
pub(crate) fn with_volume<B: Bundle>(gone: On<Remove, ExtractedVolume>, mut commands: Commands) {
    commands.entity(gone.entity).try_remove::<B>();
}

pub(crate) struct VolumePlugin;

impl Plugin for VolumePlugin {
    fn build(&self, app: &mut App) {
        app.register_required_components::<GiVolume, VolumeGrid>()
            .add_plugins(SettingsComponentPlugin::<GiVolume>::default())
            .add_systems(PostUpdate, update_grids.after(TransformSystems::Propagate));
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.add_systems(ExtractSchedule, extract_volumes);
        // Without a renderer, it would panic where a volume is removed.
        app.add_plugins(SyncComponentPlugin::<GiVolume>::default());
    }
}

/// Computes the grid of every volume.
pub(crate) fn update_grids(
    mut volumes: Query<(Entity, &GiVolume, &GlobalTransform, &mut VolumeGrid)>,
    primary: Res<PrimaryGiCamera>,
    transforms: Query<&GlobalTransform>,
) {
    let camera = primary.0.and_then(|camera| transforms.get(camera).ok());
    let camera = camera.map(GlobalTransform::translation);
    for (entity, volume, transform, mut grid) in &mut volumes {
        let follow = camera.filter(|_| volume.follow_camera).unwrap_or_default();
        let new = Grid::new(volume, transform.translation() + follow, transform.scale());
        let first = grid.is_added();
        if (grid.set_if_neq(VolumeGrid(new)) || first) && new.is_none() {
            warn!(
                "GiVolume of {entity}: its transform is not finite or without size; it is skipped"
            );
        }
    }
}

fn extract_volumes(
    mut commands: Commands,
    volumes: Extract<Query<(Entity, RenderEntity, &GiVolume, &VolumeGrid)>>,
) {
    let mut sorted = Vec::new();
    for (main, render, volume, grid) in &volumes {
        match grid.0 {
            Some(grid) => sorted.push((main, render, volume.fade, grid)),
            None => {
                _ = commands
                    .entity(render)
                    .remove::<<GiVolume as SyncComponent>::Target>()
            }
        }
    }
    sorted.sort_by(|(a, .., a_grid), (b, .., b_grid)| finest_first((a_grid, *a), (b_grid, *b)));
    for (rank, (main, render, fade, grid)) in sorted.into_iter().enumerate() {
        commands.entity(render).insert(ExtractedVolume {
            main: main.into(),
            grid,
            fade,
            rank: rank as u32,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_are_cubic_and_cover_the_extent() {
        for resolution in [32, 60, 64, 100, 128, 256, 512] {
            let volume = GiVolume::new(Vec3::new(30.0, 12.5, 15.0)).with_resolution(resolution);
            let grid = Grid::new(&volume, Vec3::ONE, Vec3::ONE).unwrap();
            assert!(grid.size().cmpge(volume.extent - 1e-3).all(), "{grid:?}");
            assert_eq!(grid.dims % (1 << grid.levels), UVec3::ZERO);
            assert!((grid.center() - Vec3::ONE).length() < 1e-4);
        }
    }

    #[test]
    fn following_moves_in_whole_cells() {
        let volume = GiVolume::default().following_camera();
        let at = |x: f32| Grid::new(&volume, Vec3::splat(x), Vec3::ONE).unwrap();
        let snap = at(0.0).voxel * 16.0;
        for i in 0..100 {
            let cells = at(i as f32 * 0.37).origin / snap;
            assert!((cells - cells.round()).abs().max_element() < 1e-3);
        }
    }

    #[test]
    fn bad_volumes_are_clamped_or_skipped() {
        let mut volume = GiVolume::new(Vec3::new(f32::NAN, 0.0, f32::INFINITY));
        volume.resolution = 10_000;
        volume.fade = f32::NAN;
        assert!(!Clamp::apply("GiVolume", &mut volume).is_empty());
        assert_eq!(volume.resolution, 512);
        assert!(volume.extent.is_finite() && volume.extent.min_element() > 0.0);
        assert!((0.0..=0.5).contains(&volume.fade));
        assert!(Clamp::apply("GiVolume", &mut volume).is_empty());
        assert!(Grid::new(&volume, Vec3::NAN, Vec3::ONE).is_none());
        assert!(Grid::new(&volume, Vec3::ZERO, Vec3::ZERO).is_none());
    }
}
