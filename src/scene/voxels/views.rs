//! The three orthographic views along which a volume is captured, and what the capture must know of the main world.

use bevy::{
    camera::Exposure,
    ecs::prelude::*,
    math::{Mat4, UVec2, Vec3},
    render::{Extract, batching::gpu_preprocessing::GpuPreprocessingSupport},
    transform::components::Transform,
};

use super::{pipelines::VoxelCapture, types::SUPERSAMPLING};
use crate::{
    camera::PrimaryGiCamera,
    scene::{
        bounds::overlaps,
        needs::SceneNeeds,
        views::{CapturePhases, CaptureViews, WantedView, sync_views},
        volume::{Grid, VolumeGrid},
        world::casters::SceneCasters,
    },
    settings::{EmissiveUnits, GiSettings},
};

/// What all volumes show of the main world, besides their grids.
#[derive(Resource, Clone, Copy)]
pub(crate) struct ExtractedContent {
    /// Version of the meshes that take part.
    pub casters: u64,
    /// See [`GpuVoxelize::emission`](super::types::GpuVoxelize::emission).
    pub emission: Vec3,
}

/// Size of an axis' view, samples.
pub(super) fn view_size(grid: &Grid, axis: usize) -> UVec2 {
    let d = grid.dims * SUPERSAMPLING;
    [
        UVec2::new(d.z, d.y),
        UVec2::new(d.x, d.z),
        UVec2::new(d.x, d.y),
    ][axis]
}

/// The orthographic view from the positive side of an axis onto the whole grid.
fn axis_view(grid: &Grid, axis: usize) -> (Mat4, Transform) {
    let size = grid.size();
    let (direction, up) = [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::Y)][axis];
    let (width, height, depth) = [
        (size.z, size.y, size.x),
        (size.x, size.z, size.y),
        (size.x, size.y, size.z),
    ][axis];
    let (w, h) = (0.5 * width, 0.5 * height);
    let eye = Transform::from_translation(grid.center() + direction * 0.5 * depth)
        .looking_to(-direction, up);
    // Reverse-Z: near and far are swapped.
    (Mat4::orthographic_rh(-w, w, -h, h, depth, 0.0), eye)
}

/// See [`GpuVoxelize::emission`](super::types::GpuVoxelize::emission). Bevy shows
/// `emissive * mix(1, exposure, weight)`, and light as `nits * exposure`.
fn emission(units: EmissiveUnits, exposure: f32) -> Vec3 {
    match units {
        EmissiveUnits::AsSeen => Vec3::new(1.0 / exposure, 1.0, 1.0 / exposure),
        EmissiveUnits::Nits => Vec3::new(1.0, 1.0, 0.0),
    }
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn extract_voxel_views(
    mut commands: Commands,
    volumes: Extract<Query<(Entity, &VolumeGrid)>>,
    casters: Extract<Res<SceneCasters>>,
    settings: Extract<Res<GiSettings>>,
    (primary, exposures): (Extract<Res<PrimaryGiCamera>>, Extract<Query<&Exposure>>),
    mut views: ResMut<CaptureViews<VoxelCapture>>,
    mut phases: ResMut<CapturePhases<VoxelCapture>>,
    support: Res<GpuPreprocessingSupport>,
    needs: Res<SceneNeeds>,
) {
    let mut wanted = Vec::new();
    for (owner, grid) in volumes.iter().filter(|_| needs.voxels) {
        let Some(grid) = grid.0 else { continue };
        let bounds = grid.bounds();
        let meshes: Vec<_> = casters
            .casters
            .iter()
            .filter(|caster| overlaps(&caster.bounds, &bounds))
            .map(|caster| caster.entity)
            .collect();
        for axis in 0..3 {
            let (clip_from_view, world_from_view) = axis_view(&grid, axis);
            wanted.push(WantedView {
                owner,
                index: axis as u32,
                clip_from_view,
                world_from_view,
                size: view_size(&grid, axis),
                meshes: meshes.clone(),
            });
        }
    }
    sync_views(&mut commands, &mut views, &mut phases, &support, wanted);

    let exposure = primary
        .0
        .and_then(|camera| exposures.get(camera).ok().copied())
        .unwrap_or_default()
        .exposure();
    commands.insert_resource(ExtractedContent {
        casters: casters.version,
        emission: emission(settings.emissive_units, exposure.max(1e-12)),
    });
}

#[cfg(test)]
mod tests {
    use bevy::math::UVec3;

    use super::*;

    /// A view that cuts a corner off would leave holes there.
    #[test]
    fn each_view_shows_the_whole_grid_in_square_samples() {
        let grid = Grid {
            origin: Vec3::new(-3.0, 1.0, 7.0),
            voxel: 0.25,
            dims: UVec3::new(64, 32, 96),
            levels: 5,
        };
        for axis in 0..3 {
            let (clip_from_view, world_from_view) = axis_view(&grid, axis);
            let clip_from_world = clip_from_view * world_from_view.to_matrix().inverse();
            let low = clip_from_world.project_point3(grid.origin);
            let high = clip_from_world.project_point3(grid.origin + grid.size());
            let (min, max) = (low.min(high), low.max(high));
            assert!(min.abs_diff_eq(Vec3::new(-1.0, -1.0, 0.0), 1e-5), "{min}");
            assert!(max.abs_diff_eq(Vec3::ONE, 1e-5), "{max}");
            // Samples along an edge of a voxel.
            for edge in [Vec3::X, Vec3::Y, Vec3::Z] {
                let clip = clip_from_world.transform_vector3(edge * grid.voxel);
                let samples = 0.5 * clip.truncate() * view_size(&grid, axis).as_vec2();
                let length = samples.length();
                let along = edge[axis] == 1.0;
                let expected = if along { 0.0 } else { SUPERSAMPLING as f32 };
                assert!((length - expected).abs() < 1e-3, "{axis}: {samples}");
            }
        }
    }

    #[test]
    fn emission_is_as_bright_as_the_camera_shows_it() {
        let exposure = 0.25;
        let as_seen = emission(EmissiveUnits::AsSeen, exposure);
        // At weight 0 the exposure does not count, at 1 it does; what is unlit shows its colour.
        assert_eq!(as_seen * exposure, Vec3::new(1.0, exposure, 1.0));
        assert_eq!(
            emission(EmissiveUnits::Nits, exposure),
            Vec3::new(1.0, 1.0, 0.0)
        );
    }
}
