//! Memory of a volume's voxels, its three capture views, and whether it must be captured again.

use bevy::{
    camera::Exposure,
    ecs::prelude::*,
    log::warn_once,
    math::{Mat4, UVec2, Vec3},
    render::{
        Extract,
        batching::gpu_preprocessing::GpuPreprocessingSupport,
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
    transform::components::Transform,
};

use super::{
    pipelines::{VoxelCapture, VoxelPipelines},
    types::{BRICK_VOXELS, GpuVoxelize, SUPERSAMPLING, VoxelizeStep, WORDS, argument, counter},
};
use crate::{
    camera::PrimaryGiCamera,
    gpu::{
        readback::Readback,
        statistics::{GiStatistics, Tracked},
    },
    scene::{
        bounds::overlaps,
        needs::SceneNeeds,
        views::{CapturePhases, CaptureQueue, CaptureViews, WantedView, sync_views},
        volume::{ExtractedVolume, Grid, VolumeGrid},
        world::casters::SceneCasters,
    },
    settings::{EmissiveUnits, GiCaptureSettings, GiSettings},
};

/// Everything whose change makes the voxels wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Content {
    casters: u64,
    /// See [`GpuVoxelize::emission`].
    emission: Vec3,
}

/// What [`prepare_voxels`] must know of the main world.
#[derive(Resource, Clone, Copy)]
pub(crate) struct ExtractedContent(Content);

/// The voxels of a volume, in the render world. See the [module](super) for the layout.
#[derive(Component)]
pub struct SceneVoxels {
    /// The grid that is captured.
    pub grid: Grid,
    /// `u32` per brick of the grid: 0, or slot in the pool + 1. This frame's and the one captured
    /// before it.
    pub(crate) brick_maps: [Tracked<Buffer>; 2],
    /// Which of the two brick maps is current.
    pub(crate) current: usize,
    /// The grid of the other brick map.
    pub(crate) previous_grid: Grid,
    /// The records of the voxels.
    pub(crate) pool: Tracked<Buffer>,
    /// 64 bits per slot: which voxels have a surface.
    pub(crate) occupancy: Tracked<Buffer>,
    /// Index of the brick in each slot.
    pub(crate) brick_list: Tracked<Buffer>,
    /// Level of the brightest emission in each slot (`emission_level` in `types.wgsl`).
    pub(crate) emission_levels: Tracked<Buffer>,
    /// `slot * 64 + index in the brick` of each voxel with a surface, by slice.
    pub(crate) voxel_list: Tracked<Buffer>,
    /// See [`counter`].
    pub(crate) counters: Tracked<Buffer>,
    /// See [`argument`].
    pub(crate) arguments: Tracked<Buffer>,
    /// Slots in the pool.
    pub(crate) capacity: u32,
    /// Grows with every capture.
    pub version: u64,
    captured: Option<(Content, Grid)>,
    /// Whether a mesh was missing then, as its assets were.
    waits: bool,
    /// [`counter`] as it was some frames ago.
    pub(crate) readback: Readback,
    /// Voxels with a surface, as of the last read-back.
    occupied: u32,
    /// Slots that the pool lacked, as of the last read-back.
    missing: u32,
    /// As [`counter::EMISSION`] says, as of the last read-back.
    pub(crate) brightest: f32,
    /// Set in the frame in which the volume is captured.
    pub(crate) job: Option<VoxelJob>,
}

/// What one capture needs.
pub(crate) struct VoxelJob {
    /// By axis, for [`VoxelizeStep::Mark`] and [`VoxelizeStep::Sum`].
    pub draw: [[BindGroup; 3]; 2],
    pub views: [Entity; 3],
    pub allocate: BindGroup,
    pub resolve: BindGroup,
    /// Target of each axis: nothing is written to it, but a pass needs one.
    pub targets: [TextureView; 3],
}

/// Size of an axis' view, samples.
fn view_size(grid: &Grid, axis: usize) -> UVec2 {
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

    // Bevy shows `emissive * mix(1, exposure, weight)`, and light as `nits * exposure`.
    let exposure = primary
        .0
        .and_then(|camera| exposures.get(camera).ok().copied())
        .unwrap_or_default()
        .exposure()
        .max(1e-12);
    let (weight_0, weight_1, unlit) = match settings.emissive_units {
        EmissiveUnits::AsSeen => (1.0 / exposure, 1.0, 1.0 / exposure),
        EmissiveUnits::Nits => (1.0, 1.0, 0.0),
    };
    commands.insert_resource(ExtractedContent(Content {
        casters: casters.version,
        emission: Vec3::new(weight_0, weight_1, unlit),
    }));
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn prepare_voxels(
    mut commands: Commands,
    mut volumes: Query<(Entity, &ExtractedVolume, Option<&mut SceneVoxels>)>,
    settings: Res<GiCaptureSettings>,
    content: Res<ExtractedContent>,
    views: Res<CaptureViews<VoxelCapture>>,
    mut queue: ResMut<CaptureQueue>,
    pipelines: Res<VoxelPipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    render_queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
    needs: Res<SceneNeeds>,
) {
    if !needs.voxels {
        // Nobody looks: the memory is given back.
        for (entity, ..) in &volumes {
            commands.entity(entity).remove::<SceneVoxels>();
        }
        return;
    }
    let ready = pipelines.ready(&cache);
    let pipelines_ready = views.ready(&cache);
    for (entity, volume, voxels) in &mut volumes {
        let Some(mut voxels) = voxels else {
            if ready {
                let new = SceneVoxels::new(volume.grid, None, &device, &statistics);
                commands.entity(entity).insert(new);
            }
            continue;
        };
        if voxels.grid.dims != volume.grid.dims {
            voxels.replace(SceneVoxels::new(volume.grid, None, &device, &statistics));
        }
        if voxels.missing > 0 {
            let needed = voxels.capacity + voxels.missing;
            let capacity = needed + needed / 8;
            let larger = SceneVoxels::new(volume.grid, Some(capacity), &device, &statistics);
            voxels.missing = 0;
            if larger.capacity > voxels.capacity {
                voxels.replace(larger);
            } else {
                let warning = format!(
                    "a GiVolume holds more surfaces ({needed} bricks of 4x4x4 voxels) than a buffer \
                     of this adapter ({} bricks): some are left out; lower its resolution",
                    voxels.capacity
                );
                warn_once!("{warning}");
                statistics.warn(vec![warning]);
            }
        }
        voxels.job = None;
        let wanted = (content.0, volume.grid);
        let any = |what: fn(&CaptureViews<VoxelCapture>, Entity, u32) -> bool| {
            (0..3).any(|axis| what(&views, volume.main.id(), axis))
        };
        let frozen = settings.freeze && voxels.captured.is_some() && !voxels.waits;
        let changed = any(CaptureViews::changed);
        if frozen || (voxels.captured == Some(wanted) && !changed) {
            continue;
        }
        let axes = [0, 1, 2].map(|axis| views.get(volume.main.id(), axis));
        let [Some(x), Some(y), Some(z)] = axes else {
            continue;
        };
        queue.0.extend([x, y, z]);
        // While pipelines are compiled, the scene is captured each frame: it grows complete.
        voxels.captured = (pipelines_ready && !changed).then_some(wanted);
        voxels.waits = any(CaptureViews::waits);
        voxels.version += 1;
        voxels.current = 1 - voxels.current;
        voxels.previous_grid = voxels.grid;
        voxels.grid = volume.grid;
        let job = voxels.job(
            [x, y, z],
            volume,
            content.0.emission,
            &pipelines,
            &cache,
            &device,
            &render_queue,
        );
        voxels.job = Some(job);
    }
}

/// Hears from the GPU how many bricks and voxels the last captures filled, and how brightly the brightest shines.
pub(crate) fn read_counts(mut volumes: Query<&mut SceneVoxels>, statistics: Res<GiStatistics>) {
    let (mut voxels_sum, mut bricks_sum) = (0, 0);
    for mut voxels in &mut volumes {
        if let Some(words) = voxels.readback.poll() {
            let bricks = words[counter::BRICKS as usize];
            voxels.missing = bricks.saturating_sub(voxels.capacity);
            voxels.occupied = words[counter::VOXELS as usize];
            voxels.brightest = f32::from_bits(words[counter::EMISSION as usize]);
        }
        voxels_sum += u64::from(voxels.occupied);
        bricks_sum += u64::from(voxels.capacity);
    }
    statistics.count("scene/voxels_occupied", voxels_sum);
    statistics.count("scene/brick_slots", bricks_sum);
}

impl SceneVoxels {
    /// Room for `capacity` bricks, or for what scenes usually need.
    fn new(
        grid: Grid,
        capacity: Option<u32>,
        device: &RenderDevice,
        statistics: &GiStatistics,
    ) -> Self {
        let bricks = grid.bricks().element_product();
        // Surfaces fill bricks with the square of the resolution, volumes have its cube: a quarter
        // is enough for most scenes. Where it is not, `read_counts` finds out.
        let wanted = capacity.unwrap_or((bricks / 4).clamp(2048, 65536));
        let limit =
            device.limits().max_storage_buffer_binding_size / u64::from(4 * WORDS * BRICK_VOXELS);
        let capacity = u64::from(wanted.min(bricks)).min(limit);
        let buffer = |name, words: u64, usage: BufferUsages| {
            statistics.storage_buffer(device, name, words, usage)
        };
        let voxels = capacity * u64::from(BRICK_VOXELS);
        let none = BufferUsages::empty();
        Self {
            grid,
            previous_grid: grid,
            brick_maps: [(); 2].map(|()| {
                buffer(
                    "scene/voxels/brick_map",
                    bricks.into(),
                    BufferUsages::COPY_SRC,
                )
            }),
            current: 0,
            pool: buffer(
                "scene/voxels/pool",
                voxels * u64::from(WORDS),
                BufferUsages::COPY_SRC,
            ),
            occupancy: buffer("scene/voxels/occupancy", 2 * capacity, none),
            brick_list: buffer("scene/voxels/brick_list", capacity, none),
            emission_levels: buffer("scene/voxels/emission_levels", capacity, none),
            voxel_list: buffer("scene/voxels/voxel_list", voxels, none),
            counters: buffer(
                "scene/voxels/counters",
                counter::WORDS.into(),
                BufferUsages::COPY_SRC,
            ),
            arguments: buffer(
                "scene/voxels/arguments",
                argument::WORDS.into(),
                BufferUsages::INDIRECT,
            ),
            capacity: capacity as u32,
            version: 0,
            captured: None,
            waits: false,
            readback: Readback::new(device, counter::SLICE_COUNT),
            occupied: 0,
            missing: 0,
            brightest: 0.0,
            job: None,
        }
    }

    /// Starts anew with other buffers.
    fn replace(&mut self, mut new: Self) {
        new.version = self.version;
        new.brightest = self.brightest;
        *self = new;
    }

    /// `u32` per brick of the grid, x fastest: 0, or slot in the [pool](Self::pool) + 1.
    pub fn brick_map(&self) -> &Buffer {
        &self.brick_maps[self.current]
    }

    /// [`WORDS`] words per voxel, 64 voxels per slot: the records of the [module](super)'s table.
    pub fn pool(&self) -> &Buffer {
        &self.pool
    }

    #[allow(clippy::too_many_arguments, reason = "what a capture depends on")]
    fn job(
        &self,
        views: [Entity; 3],
        volume: &ExtractedVolume,
        emission: Vec3,
        pipelines: &VoxelPipelines,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> VoxelJob {
        let uniform = |axis: u32, step: VoxelizeStep| {
            let mut buffer = UniformBuffer::from(GpuVoxelize {
                volume: volume.gpu(),
                axis,
                step: step as u32,
                emission,
            });
            buffer.write_buffer(device, queue);
            buffer
        };
        let draw = [VoxelizeStep::Mark, VoxelizeStep::Sum].map(|step| {
            [0, 1, 2].map(|axis| {
                pipelines
                    .draw_layout
                    .bind(device, cache)
                    .with("voxelize", &uniform(axis, step))
                    .with("brick_map", self.brick_map().as_entire_binding())
                    .with("pool", self.pool.as_entire_binding())
                    .with("emission_levels", self.emission_levels.as_entire_binding())
                    .build()
            })
        });
        let uniform = uniform(0, VoxelizeStep::Sum);
        let targets = [0, 1, 2].map(|axis| {
            let size = view_size(&self.grid, axis);
            device
                .create_texture(&TextureDescriptor {
                    label: Some("gi/scene/voxelize_target"),
                    size: Extent3d {
                        width: size.x,
                        height: size.y,
                        depth_or_array_layers: 1,
                    },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: TextureDimension::D2,
                    format: TextureFormat::R8Unorm,
                    usage: TextureUsages::RENDER_ATTACHMENT,
                    view_formats: &[],
                })
                .create_view(&TextureViewDescriptor::default())
        });
        VoxelJob {
            draw,
            views,
            allocate: pipelines
                .allocate_layout
                .bind(device, cache)
                .with("brick_map", self.brick_map().as_entire_binding())
                .with("brick_list", self.brick_list.as_entire_binding())
                .with("counters", self.counters.as_entire_binding())
                .with("arguments", self.arguments.as_entire_binding())
                .with("emission_levels", self.emission_levels.as_entire_binding())
                .build(),
            resolve: pipelines
                .resolve_layout
                .bind(device, cache)
                .with("voxelize", &uniform)
                .with("pool", self.pool.as_entire_binding())
                .with("brick_list", self.brick_list.as_entire_binding())
                .with("counters", self.counters.as_entire_binding())
                .with("voxel_list", self.voxel_list.as_entire_binding())
                .with("occupancy", self.occupancy.as_entire_binding())
                .with("emission_levels", self.emission_levels.as_entire_binding())
                .build(),
            targets,
        }
    }
}
