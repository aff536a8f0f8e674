//! [`VctCache`]: the radiance cache of a volume.

use bevy::{
    ecs::prelude::*,
    math::{IVec3, UVec3},
    render::render_resource::*,
};

use super::{
    passes::VctJob,
    pipelines::{VctPipelines, cache_layout},
    plan::{Content, Plan, Progress},
    settings::{VoxelConeTracing, VoxelConeTracingSettings},
    types::{DIRECTIONS, GpuCones, GpuMip, GpuVoxelPass},
};
use crate::{
    gpu::{compute::Recorder, statistics::Tracked},
    scene::{
        volume::Grid,
        voxels::{BRICK_VOXELS, SceneVoxels},
    },
    technique::{Activity, Cache, Frame, Inputs, Settling},
};

/// Cones are turned in each frame, and a few frames must be averaged.
const SETTLING: Settling = Settling {
    history_frames: 8,
    blur: 1,
};

/// The radiance cache of a volume, see the [module](super).
#[derive(Component)]
pub struct VctCache {
    dims: UVec3,
    /// Bricks in the pool that the buffers below go with.
    capacity: u32,
    /// All levels and directions.
    texture: Tracked<Texture>,
    sampler: Sampler,
    /// Of each voxel of the pool, front and back, packed as emission: one holds bounced irradiance over pi, the
    /// other radiance. After a capture they change places: once the bounced light is carried over,
    /// nobody needs the old one, and radiance is computed afresh.
    voxel_light: [Tracked<Buffer>; 2],
    /// Which of the two holds bounced light.
    bounced: usize,
    progress: Progress,
    /// Group 2, and the parameters that it holds.
    bind_group: Option<(BindGroup, VoxelConeTracingSettings)>,
    /// Nits of a unit of the cells' radiance.
    unit: f32,
    job: Option<VctJob>,
}

impl Cache<VoxelConeTracing> for VctCache {
    fn new(frame: &Frame<VoxelConeTracing>) -> Option<Self> {
        let voxels = frame.voxels.filter(|voxels| voxels.version > 0)?;
        let device = frame.device;
        let Grid { dims, levels, .. } = voxels.grid;
        let cells = dims / 2;
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("gi/vct/cells"),
            size: Extent3d {
                width: cells.x,
                height: cells.y,
                depth_or_array_layers: cells.z * DIRECTIONS,
            },
            mip_level_count: levels,
            sample_count: 1,
            dimension: TextureDimension::D3,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let texture = frame.statistics.texture("vct/cells", texture);
        let words = 2 * u64::from(voxels.capacity) * u64::from(BRICK_VOXELS);
        let usage = BufferUsages::COPY_SRC;
        let buffer = |name| frame.statistics.storage_buffer(device, name, words, usage);
        Some(Self {
            dims,
            capacity: voxels.capacity,
            texture,
            sampler: device.create_sampler(&SamplerDescriptor {
                label: Some("gi/vct/cells"),
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                mipmap_filter: MipmapFilterMode::Linear,
                ..Default::default()
            }),
            voxel_light: [buffer("vct/voxel_bounced"), buffer("vct/voxel_radiance")],
            bounced: 0,
            progress: Progress::default(),
            bind_group: None,
            unit: 1.0,
            job: None,
        })
    }

    fn fits(&self, frame: &Frame<VoxelConeTracing>) -> bool {
        let fits = |v: &SceneVoxels| (self.dims, self.capacity) == (v.grid.dims, v.capacity);
        frame.voxels.is_some_and(fits)
    }

    fn update(&mut self, frame: &Frame<VoxelConeTracing>) -> Activity {
        self.job = None;
        let Some(voxels) = frame.voxels else {
            return Activity::default();
        };
        let unit = frame.units.emitters();
        let rescaled = self.progress.has_content() && self.unit != unit;
        self.unit = unit;
        let cones = self.bind_group.as_ref().map(|(_, settings)| settings);
        if rescaled || cones != Some(frame.settings) {
            self.bind_group = Some((self.lookup(frame), frame.settings.clone()));
        }
        let content = Content {
            voxels: voxels.version,
            lighting: frame.lighting,
            settings: frame.settings.clone(),
            history: frame.history,
        };
        let Some(plan) = self.progress.step(content, rescaled) else {
            return Activity::default();
        };
        if plan.captured {
            self.bounced = 1 - self.bounced;
        }
        self.job = Some(self.job(&plan, voxels, frame));
        Activity {
            // The same light in another unit is no reason to forget.
            settling: plan.relights.then_some(SETTLING),
            look_again: false,
        }
    }

    fn record(&self, pipelines: &VctPipelines, inputs: Inputs, recorder: &mut Recorder) {
        let (Some(job), Some(cache), Some(voxels)) = (&self.job, self.bind_group(), inputs.voxels)
        else {
            return;
        };
        job.record(pipelines, voxels, inputs.scene, cache, recorder);
    }

    fn bind_group(&self) -> Option<&BindGroup> {
        self.bind_group.as_ref().map(|(group, _)| group)
    }
}

impl VctCache {
    /// Group 2 of whatever looks the cache up.
    fn lookup(&self, frame: &Frame<VoxelConeTracing>) -> BindGroup {
        let mut uniform = UniformBuffer::from(GpuCones::new(frame.settings, self.unit));
        uniform.write_buffer(frame.device, frame.queue);
        cache_layout()
            .bind(frame.device, frame.cache)
            .with("cones", &uniform)
            .with(
                "cells",
                &self.texture.create_view(&TextureViewDescriptor::default()),
            )
            .with("cell_sampler", &self.sampler)
            .build()
    }

    /// The bind groups for what is planned.
    fn job(&self, plan: &Plan, voxels: &SceneVoxels, frame: &Frame<VoxelConeTracing>) -> VctJob {
        let Frame {
            pipelines,
            cache,
            device,
            queue,
            ..
        } = *frame;
        let same_voxels = voxels.grid.voxel == voxels.previous_grid.voxel;
        let shift = (voxels.grid.origin - voxels.previous_grid.origin) / voxels.grid.voxel;
        let pass = |slice: u32| {
            let mut uniform = UniformBuffer::from(GpuVoxelPass {
                slice,
                shift: IVec3::from_array(shift.round().to_array().map(|x| x as i32)),
                carry: (same_voxels && plan.keeps).into(),
                dims: self.dims,
            });
            uniform.write_buffer(device, queue);
            uniform
        };
        let [bounced, radiance] = [self.bounced, 1 - self.bounced].map(|i| &self.voxel_light[i]);
        let group = |slice: u32| {
            pipelines
                .voxel_layout
                .bind(device, cache)
                .with("pass_", &pass(slice))
                .with("pool", voxels.pool.as_entire_binding())
                .with("brick_list", voxels.brick_list.as_entire_binding())
                .with("voxel_list", voxels.voxel_list.as_entire_binding())
                .with("counters", voxels.counters.as_entire_binding())
                .with("bounced", bounced.as_entire_binding())
                .with("other", radiance.as_entire_binding())
                .build()
        };
        let carry = plan.captured.then(|| {
            pipelines
                .carry_layout
                .bind(device, cache)
                .with("pass_", &pass(0))
                .with("brick_list", voxels.brick_list.as_entire_binding())
                .with("voxel_list", voxels.voxel_list.as_entire_binding())
                .with("counters", voxels.counters.as_entire_binding())
                .with("bounced", bounced.as_entire_binding())
                // Not radiance yet: the bounced light of before.
                .with("other", radiance.as_entire_binding())
                .with(
                    "previous_brick_map",
                    voxels.brick_maps[1 - voxels.current].as_entire_binding(),
                )
                .build()
        });
        let level_view = |level: u32| {
            self.texture.create_view(&TextureViewDescriptor {
                base_mip_level: level,
                mip_level_count: Some(1),
                ..Default::default()
            })
        };
        let cells: Vec<_> = (0..voxels.grid.levels)
            .map(|l| (self.dims / 2) >> l)
            .collect();
        let mip = |level: usize| {
            let mut uniform = UniformBuffer::from(GpuMip {
                cells: cells[level],
                unit: self.unit,
            });
            uniform.write_buffer(device, queue);
            uniform
        };
        let filter_voxels = pipelines
            .filter_voxels_layout
            .bind(device, cache)
            .with("mip", &mip(0))
            .with("destination", &level_view(0))
            .with("brick_list", voxels.brick_list.as_entire_binding())
            .with("pool", voxels.pool.as_entire_binding())
            .with("radiance", radiance.as_entire_binding())
            .with("counters", voxels.counters.as_entire_binding())
            .build();
        let clear_cells = plan.captured.then(|| {
            pipelines
                .clear_cells_layout
                .bind(device, cache)
                .with("mip", &mip(0))
                .with("destination", &level_view(0))
                .build()
        });
        let filter_cells = (1..cells.len())
            .map(|level| {
                pipelines
                    .filter_cells_layout
                    .bind(device, cache)
                    .with("mip", &mip(level))
                    .with("destination", &level_view(level as u32))
                    .with("finer", &level_view(level as u32 - 1))
                    .build()
            })
            .collect();
        VctJob {
            clear: plan.forgets.then(|| bounced.clone()),
            carry,
            bounce: plan
                .slices
                .clone()
                .map(|slice| (slice, group(slice)))
                .collect(),
            light: group(0),
            clear_cells,
            filter_voxels,
            filter_cells,
            cells,
        }
    }
}
