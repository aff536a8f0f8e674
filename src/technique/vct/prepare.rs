//! Memory of the radiance cache, its bind groups, and what is left to do.

use bevy::{
    ecs::prelude::*,
    math::{IVec3, UVec3},
    render::{
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    node::VctPipelines,
    settings::VoxelConeTracingSettings,
    types::{DIRECTIONS, GpuCones, GpuMip, GpuVoxelPass},
};
use crate::{
    camera::ExtractedGiCamera,
    gpu::statistics::{GiStatistics, Tracked},
    scene::{
        bind_group::LightingVersion,
        units::LightUnits,
        volume::{ExtractedVolume, Grid},
        voxels::{BRICK_VOXELS, SLICES, SceneVoxels},
    },
    settings::{GiHistory, GiTechnique},
    technique::{Settling, TechniqueCache},
};

/// Cones are turned in each frame, and a few frames must be averaged.
const SETTLING: Settling = Settling {
    history_frames: 8,
    blur: 1,
};

/// Everything whose change makes the cache wrong.
#[derive(Clone, PartialEq)]
struct Content {
    voxels: u64,
    lighting: LightingVersion,
    settings: VoxelConeTracingSettings,
    history: u32,
}

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
    content: Option<Content>,
    /// Frames of bouncing that are left until the light has settled.
    frames_left: u32,
    /// Counts frames of bouncing.
    frame: u32,
    bind_group: Option<BindGroup>,
    cones: Option<VoxelConeTracingSettings>,
    /// Nits of a unit of the cells' radiance.
    unit: f32,
    pub(crate) job: Option<VctJob>,
}

impl TechniqueCache for VctCache {
    fn bind_group(&self) -> Option<&BindGroup> {
        self.bind_group.as_ref()
    }
}

/// What one frame's update runs.
pub(crate) struct VctJob {
    /// Whether light changes, and not only its unit.
    relights: bool,
    /// The bounced light is dropped first.
    pub clear: Option<Tracked<Buffer>>,
    /// After a capture.
    pub carry: Option<BindGroup>,
    /// Slices to trace, each with its group 0.
    pub bounce: Vec<(u32, BindGroup)>,
    pub light: BindGroup,
    /// After a capture.
    pub clear_cells: Option<BindGroup>,
    pub filter_voxels: BindGroup,
    pub filter_cells: Vec<BindGroup>,
    /// Cells of each level.
    pub cells: Vec<UVec3>,
}

type VolumeData<'a> = (Entity, Option<&'a SceneVoxels>, Option<&'a mut VctCache>);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn prepare_vct(
    mut commands: Commands,
    mut volumes: Query<VolumeData, With<ExtractedVolume>>,
    cameras: Query<&ExtractedGiCamera>,
    settings: Res<VoxelConeTracingSettings>,
    history: Res<GiHistory>,
    (lighting, units): (Res<LightingVersion>, Res<LightUnits>),
    pipelines: Res<VctPipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
) {
    let wanted = cameras
        .iter()
        .any(|camera| camera.technique == GiTechnique::VoxelConeTracing);
    let ready = pipelines.ready(&cache);
    for (entity, voxels, vct) in &mut volumes {
        let Some(voxels) = voxels.filter(|_| wanted) else {
            // Nobody looks: the memory is given back.
            commands.entity(entity).remove::<VctCache>();
            continue;
        };
        let Some(mut vct) = vct else {
            if ready && voxels.version > 0 {
                let new = VctCache::new(voxels, &device, &statistics);
                commands.entity(entity).insert(new);
            }
            continue;
        };
        if (vct.dims, vct.capacity) != (voxels.grid.dims, voxels.capacity) {
            *vct = VctCache::new(voxels, &device, &statistics);
        }
        let unit = units.emitters();
        let rescaled = vct.content.is_some() && vct.unit != unit;
        vct.unit = unit;
        if rescaled || vct.cones.as_ref() != Some(&*settings) {
            vct.update_bind_group(&settings, &pipelines, &cache, &device, &queue);
        }
        vct.plan(
            rescaled,
            voxels,
            Content {
                voxels: voxels.version,
                lighting: *lighting,
                settings: settings.clone(),
                history: history.epoch(),
            },
            &pipelines,
            &cache,
            &device,
            &queue,
        );
        let mut volume = commands.entity(entity);
        // The same light in another unit is no reason to forget.
        match vct.job {
            Some(VctJob { relights: true, .. }) => volume.insert(SETTLING),
            _ => volume.remove::<Settling>(),
        };
    }
}

impl VctCache {
    fn new(voxels: &SceneVoxels, device: &RenderDevice, statistics: &GiStatistics) -> Self {
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
        let texture = statistics.texture("vct/cells", texture);
        let words = 2 * u64::from(voxels.capacity) * u64::from(BRICK_VOXELS);
        let buffer = |name| statistics.storage_buffer(device, name, words, BufferUsages::COPY_SRC);
        Self {
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
            content: None,
            frames_left: 0,
            frame: 0,
            bind_group: None,
            cones: None,
            unit: 1.0,
            job: None,
        }
    }

    fn update_bind_group(
        &mut self,
        settings: &VoxelConeTracingSettings,
        pipelines: &VctPipelines,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        self.cones = Some(settings.clone());
        let mut uniform = UniformBuffer::from(GpuCones::new(settings, self.unit));
        uniform.write_buffer(device, queue);
        self.bind_group = Some(device.create_bind_group(
            "gi/vct/cache",
            &cache.get_bind_group_layout(&pipelines.cache_layout),
            &BindGroupEntries::sequential((
                &uniform,
                &self.texture.create_view(&TextureViewDescriptor::default()),
                &self.sampler,
            )),
        ));
    }

    /// Decides what this frame does. Cells that are `rescaled` are in another unit than before.
    #[allow(clippy::too_many_arguments, reason = "what a frame depends on")]
    fn plan(
        &mut self,
        rescaled: bool,
        voxels: &SceneVoxels,
        content: Content,
        pipelines: &VctPipelines,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        self.job = None;
        let settings = &content.settings;
        let slices_per_frame = SLICES.div_ceil(settings.bounce_interval);
        let frames_per_bounce = SLICES.div_ceil(slices_per_frame);
        let before = self.content.as_ref();
        let captured = before.map(|c| c.voxels) != Some(content.voxels);
        let reset = before.map(|c| c.history) != Some(content.history);
        if before != Some(&content) {
            self.frames_left = settings.bounces * frames_per_bounce + 1;
        }
        if reset {
            self.frame = 0;
        }
        let relights = self.frames_left > 0;
        if !relights && !rescaled {
            return;
        }
        if captured {
            self.bounced = 1 - self.bounced;
        }

        let same_voxels = voxels.grid.voxel == voxels.previous_grid.voxel;
        let shift = (voxels.grid.origin - voxels.previous_grid.origin) / voxels.grid.voxel;
        let pass = |slice: u32| GpuVoxelPass {
            slice,
            shift: IVec3::from_array(shift.round().to_array().map(|x| x as i32)),
            carry: (same_voxels && before.is_some() && !reset).into(),
            dims: self.dims,
        };
        let [bounced, radiance] = [self.bounced, 1 - self.bounced].map(|i| &self.voxel_light[i]);
        let group = |slice: u32| {
            let mut uniform = UniformBuffer::from(pass(slice));
            uniform.write_buffer(device, queue);
            device.create_bind_group(
                "gi/vct/voxels",
                &cache.get_bind_group_layout(&pipelines.voxel_layout),
                &BindGroupEntries::sequential((
                    &uniform,
                    voxels.pool.as_entire_binding(),
                    voxels.brick_list.as_entire_binding(),
                    voxels.voxel_list.as_entire_binding(),
                    voxels.counters.as_entire_binding(),
                    bounced.as_entire_binding(),
                    radiance.as_entire_binding(),
                )),
            )
        };
        let carry = captured.then(|| {
            let mut uniform = UniformBuffer::from(pass(0));
            uniform.write_buffer(device, queue);
            device.create_bind_group(
                "gi/vct/carry",
                &cache.get_bind_group_layout(&pipelines.carry_layout),
                &BindGroupEntries::sequential((
                    &uniform,
                    voxels.pool.as_entire_binding(),
                    voxels.brick_list.as_entire_binding(),
                    voxels.voxel_list.as_entire_binding(),
                    voxels.counters.as_entire_binding(),
                    bounced.as_entire_binding(),
                    // Not radiance yet: the bounced light of before.
                    radiance.as_entire_binding(),
                    voxels.brick_maps[1 - voxels.current].as_entire_binding(),
                )),
            )
        });
        // The radiance that a reset leaves behind is not looked up: it is of the time before. Nor is that in
        // another unit; bounces wait for a frame.
        let bouncing = settings.bounces > 0 && !reset && !rescaled && relights;
        if relights && !rescaled {
            self.frames_left -= 1;
        }
        let mut bounce = Vec::new();
        if bouncing {
            let first = (self.frame % frames_per_bounce) * slices_per_frame;
            for slice in first..(first + slices_per_frame).min(SLICES) {
                bounce.push((slice, group(slice)));
            }
            self.frame = self.frame.wrapping_add(1);
        }

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
        let filter_voxels = device.create_bind_group(
            "gi/vct/filter_voxels",
            &cache.get_bind_group_layout(&pipelines.filter_voxels_layout),
            &BindGroupEntries::sequential((
                &mip(0),
                &level_view(0),
                voxels.brick_list.as_entire_binding(),
                voxels.pool.as_entire_binding(),
                radiance.as_entire_binding(),
                voxels.counters.as_entire_binding(),
            )),
        );
        let clear_cells = captured.then(|| {
            device.create_bind_group(
                "gi/vct/clear_cells",
                &cache.get_bind_group_layout(&pipelines.clear_cells_layout),
                &BindGroupEntries::sequential((&mip(0), &level_view(0))),
            )
        });
        let filter_cells = (1..cells.len())
            .map(|level| {
                device.create_bind_group(
                    "gi/vct/filter_cells",
                    &cache.get_bind_group_layout(&pipelines.filter_cells_layout),
                    &BindGroupEntries::sequential((
                        &mip(level),
                        &level_view(level as u32),
                        &level_view(level as u32 - 1),
                    )),
                )
            })
            .collect();
        self.job = Some(VctJob {
            relights,
            clear: (reset && !captured).then(|| bounced.clone()),
            carry,
            bounce,
            light: group(0),
            clear_cells,
            filter_voxels,
            filter_cells,
            cells,
        });
        self.content = Some(content);
    }
}
