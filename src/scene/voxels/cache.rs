//! Memory and bind groups of a volume's voxels.

use bevy::{
    ecs::prelude::*,
    log::warn_once,
    math::Vec3,
    render::{
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    pipelines::{VoxelCapture, VoxelPipelines},
    plan::{self, Content, Demand, Memory, Pool, Progress, Views},
    types::{BRICK_VOXELS, GpuVoxelize, VoxelizeStep, WORDS, argument, counter},
    views::{ExtractedContent, view_size},
};
use crate::{
    gpu::{
        readback::Readback,
        statistics::{GiStatistics, Tracked},
    },
    scene::{
        needs::SceneNeeds,
        views::{CaptureQueue, CaptureViews},
        volume::{ExtractedVolume, Grid},
    },
    settings::GiCaptureSettings,
};

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
    progress: Progress,
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
    let ready = pipelines.ready(&cache);
    let compiled = views.ready(&cache);
    let slot = 4 * WORDS * BRICK_VOXELS;
    let most = device.limits().max_storage_buffer_binding_size / u64::from(slot);
    for (entity, volume, voxels) in &mut volumes {
        let grid = volume.grid;
        let demand = needs.voxels.then_some(Demand { grid, most, ready });
        let memory = plan::memory(voxels.as_deref().map(SceneVoxels::slots), demand);
        let new = |capacity| SceneVoxels::new(grid, capacity, &device, &statistics);
        let Some(mut voxels) = voxels else {
            if let Memory::Allocate(capacity) = memory {
                commands.entity(entity).insert(new(capacity));
            }
            continue;
        };
        match memory {
            Memory::Keep => {}
            Memory::Release => {
                commands.entity(entity).remove::<SceneVoxels>();
                continue;
            }
            Memory::Allocate(capacity) => voxels.replace(new(capacity)),
            Memory::Short(needed) => warn_of_lack(&statistics, needed, voxels.capacity),
        }
        voxels.missing = 0;
        voxels.job = None;
        let owner = volume.main.id();
        let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(|axis| views.get(owner, axis)) else {
            continue;
        };
        let any = |what: fn(&CaptureViews<VoxelCapture>, Entity, u32) -> bool| {
            (0..3).any(|axis| what(&views, owner, axis))
        };
        let now = Content {
            casters: content.casters,
            emission: content.emission,
            grid,
        };
        let drawn = Views {
            compiled,
            changed: any(CaptureViews::changed),
            waits: any(CaptureViews::waits),
        };
        if !voxels.progress.step(now, drawn, settings.freeze) {
            continue;
        }
        queue.0.extend([x, y, z]);
        voxels.version += 1;
        voxels.current = 1 - voxels.current;
        voxels.previous_grid = voxels.grid;
        voxels.grid = grid;
        let job = voxels.job(
            [x, y, z],
            volume,
            content.emission,
            &pipelines,
            &cache,
            &device,
            &render_queue,
        );
        voxels.job = Some(job);
    }
}

/// Some surfaces are left out.
fn warn_of_lack(statistics: &GiStatistics, needed: u32, capacity: u32) {
    let warning = format!(
        "a GiVolume holds more surfaces ({needed} bricks of 4x4x4 voxels) than a buffer of this adapter \
         ({capacity} bricks): some are left out; lower its resolution"
    );
    warn_once!("{warning}");
    statistics.warn(vec![warning]);
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
    /// Room for `capacity` bricks of a grid.
    fn new(grid: Grid, capacity: u32, device: &RenderDevice, statistics: &GiStatistics) -> Self {
        let bricks = grid.bricks().element_product();
        let slots = u64::from(capacity);
        let buffer = |name, words: u64, usage: BufferUsages| {
            statistics.storage_buffer(device, name, words, usage)
        };
        let voxels = slots * u64::from(BRICK_VOXELS);
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
            occupancy: buffer("scene/voxels/occupancy", 2 * slots, none),
            brick_list: buffer("scene/voxels/brick_list", slots, none),
            emission_levels: buffer("scene/voxels/emission_levels", slots, none),
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
            capacity,
            version: 0,
            progress: Progress::default(),
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

    /// The pool, as the plan sees it.
    fn slots(&self) -> Pool {
        Pool {
            dims: self.grid.dims,
            capacity: self.capacity,
            missing: self.missing,
        }
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
