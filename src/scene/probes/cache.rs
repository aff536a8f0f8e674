//! Memory and bind groups of the probes.

use bevy::{
    ecs::prelude::*,
    log::warn,
    math::{UVec3, Vec4},
    render::{
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    extract::ExtractedProbeSet,
    pipelines::{GpuProbePass, ProbePipelines},
    plan::{self, Content, Memory, Plan, Shape},
    types::GpuProbes,
};
use crate::{
    gpu::statistics::{GiStatistics, Tracked},
    scene::{
        needs::SceneNeeds,
        volume::{ExtractedVolume, Grid, Lattice, ProbeSet},
        voxels::SceneVoxels,
    },
};

/// On a volume's entity: whoever reads its probes wants them to look along other rays in the next frame.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct LookAgain;

/// The probes of a volume, in the render world. See the [module](super).
#[derive(Component)]
pub struct SceneProbes {
    set: ProbeSet,
    /// Where they stand,
    pub lattice: Lattice,
    /// but for those,
    pins: Vec<Vec4>,
    /// here on the GPU, where no buffer is empty.
    places: StorageBuffer<Vec<Vec4>>,
    /// Of each probe: metres from the middle of its cell; w is the distance to the nearest surface, 0
    /// inside of something.
    pub(crate) offsets: Tracked<Buffer>,
    /// Of each ray of each probe, two words: what it met, and how far away.
    pub(crate) hits: Tracked<Buffer>,
    pub(crate) moments: Tracked<TextureView>,
    pub(crate) sampler: Sampler,
    /// The voxels that they have seen, as [`SceneVoxels::version`].
    pub version: u64,
    /// Directions of the rays: grows while they look again.
    round: u32,
    pub(super) job: Option<ProbeJob>,
}

/// What a frame runs.
pub(super) struct ProbeJob {
    pub look: BindGroup,
    /// After a capture: probes are placed first, and get their depths.
    pub moments: Option<BindGroup>,
}

impl SceneProbes {
    /// Probes along each axis.
    pub fn dims(&self) -> UVec3 {
        self.lattice.dims
    }

    /// Four `f32` for each probe, x fastest: metres from the middle of its cell, and to the nearest surface;
    /// the latter is 0 inside of something.
    pub fn offsets(&self) -> &Buffer {
        &self.offsets
    }

    /// Rays of each probe.
    pub fn rays(&self) -> u32 {
        self.set.ray_side().pow(2)
    }

    /// Whether they look at the scene in this frame.
    pub(crate) fn looks(&self) -> bool {
        self.job.is_some()
    }

    /// As shaders see them.
    pub(crate) fn gpu(&self) -> GpuProbes {
        GpuProbes::new(&self.set, &self.lattice, self.round)
    }

    /// The same, on the GPU.
    pub(crate) fn uniform(
        &self,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> UniformBuffer<GpuProbes> {
        let mut uniform = UniformBuffer::from(self.gpu());
        uniform.write_buffer(device, queue);
        uniform
    }

    /// What decides the sizes of their buffers.
    fn shape(&self) -> Shape {
        Shape::new(&self.set, &self.lattice)
    }

    /// What they have seen.
    fn content(&self) -> Content<'_> {
        Content {
            voxels: self.version,
            set: self.set,
            lattice: self.lattice,
            pins: &self.pins,
        }
    }

    /// From now on they see `content`, along the rays of `round`.
    fn show(&mut self, content: &Content, round: u32, device: &RenderDevice, queue: &RenderQueue) {
        if self.pins != content.pins || self.places.buffer().is_none() {
            self.pins = content.pins.to_vec();
            let padded = match content.pins {
                [] => vec![Vec4::ZERO],
                pins => pins.to_vec(),
            };
            self.places.set(padded);
            self.places.write_buffer(device, queue);
        }
        self.version = content.voxels;
        self.set = content.set;
        self.lattice = content.lattice;
        self.round = round;
    }

    #[allow(clippy::too_many_arguments, reason = "what rays depend on")]
    fn job(
        &self,
        plan: Plan,
        volume: &ExtractedVolume,
        voxels: &SceneVoxels,
        pipelines: &ProbePipelines,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> ProbeJob {
        let mut uniform = UniformBuffer::from(GpuProbePass {
            volume: volume.gpu(),
            probes: self.gpu(),
            pins: self.pins.len() as u32,
        });
        uniform.write_buffer(device, queue);
        let look = pipelines
            .look_layout
            .bind(device, cache)
            .with("brick_map", voxels.brick_map().as_entire_binding())
            .with("occupancy", voxels.occupancy.as_entire_binding())
            .with("pool", voxels.pool.as_entire_binding())
            .with("pass_", &uniform)
            .with("offsets", self.offsets.as_entire_binding())
            .with("hits", self.hits.as_entire_binding())
            .with("pins", &self.places)
            .build();
        let moments = plan.places.then(|| {
            pipelines
                .moments_layout
                .bind(device, cache)
                .with("probes", &self.uniform(device, queue))
                .with("hits", self.hits.as_entire_binding())
                .with("moments", &*self.moments)
                .build()
        });
        ProbeJob { look, moments }
    }

    fn new(
        set: ProbeSet,
        lattice: Lattice,
        device: &RenderDevice,
        statistics: &GiStatistics,
    ) -> Self {
        let count = u64::from(lattice.count());
        let side = set.ray_side();
        let size = lattice.dims * UVec3::new(side + 2, side + 2, 1);
        let moments = device.create_texture(&TextureDescriptor {
            label: Some("gi/scene/probes/moments"),
            size: Extent3d {
                width: size.x,
                height: size.y,
                depth_or_array_layers: size.z,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let moments = statistics.texture("scene/probes/moments", moments);
        let moments = moments.map(|texture| {
            texture.create_view(&TextureViewDescriptor {
                dimension: Some(TextureViewDimension::D2Array),
                ..Default::default()
            })
        });
        let buffer =
            |name, words| statistics.storage_buffer(device, name, words, BufferUsages::COPY_SRC);
        Self {
            set,
            lattice,
            pins: Vec::new(),
            places: StorageBuffer::from(vec![Vec4::ZERO]),
            offsets: buffer("scene/probes/offsets", 4 * count),
            hits: buffer("scene/probes/hits", 2 * count * u64::from(side * side)),
            moments,
            sampler: device.create_sampler(&SamplerDescriptor {
                label: Some("gi/scene/probes"),
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                ..Default::default()
            }),
            version: 0,
            round: 0,
            job: None,
        }
    }
}

type VolumeData<'a> = (
    Entity,
    &'a ExtractedVolume,
    &'a ExtractedProbeSet,
    Option<&'a SceneVoxels>,
    Option<&'a mut SceneProbes>,
    Has<LookAgain>,
);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn prepare_probes(
    mut commands: Commands,
    mut volumes: Query<VolumeData>,
    needs: Res<SceneNeeds>,
    pipelines: Option<Res<ProbePipelines>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
) {
    let Some(pipelines) = pipelines else { return };
    let ready = pipelines.ready(&cache);
    let limits = device.limits();
    let largest = limits
        .max_storage_buffer_binding_size
        .min(limits.max_buffer_size);
    let mut count = 0;
    for (entity, volume, wanted, voxels, probes, again) in &mut volumes {
        let Some(voxels) = voxels.filter(|_| needs.probes) else {
            // Nobody looks: the memory is given back.
            commands.entity(entity).remove::<SceneProbes>();
            continue;
        };
        if again {
            // Whoever reads them asks in each frame.
            commands.entity(entity).remove::<LookAgain>();
        }
        let ExtractedProbeSet { placement, pins } = wanted;
        let set = placement.set;
        let most = placement.most(largest, needs.probe_bytes);
        let lattice = placement.lattice(&voxels.grid, most);
        let there = probes.as_deref().map(SceneProbes::shape);
        let shape = Shape::new(&set, &lattice);
        let memory = plan::memory(there, shape, ready && voxels.version > 0);
        let new = || SceneProbes::new(set, lattice, &device, &statistics);
        let Some(mut probes) = probes else {
            if memory == Memory::Allocate {
                commands.entity(entity).insert(new());
            }
            continue;
        };
        count += u64::from(lattice.count());
        if memory == Memory::Allocate {
            *probes = new();
            warn_of_coarseness(&statistics, &set, &lattice, &voxels.grid);
        }
        let now = Content {
            voxels: voxels.version,
            set,
            lattice,
            pins,
        };
        let plan = plan::plan(&probes.content(), &now, probes.round, again);
        probes.job = plan.map(|plan| {
            probes.show(&now, plan.round, &device, &queue);
            probes.job(plan, volume, voxels, &pipelines, &cache, &device, &queue)
        });
    }
    statistics.count("scene/probes", count);
}

/// There are fewer probes than wanted.
fn warn_of_coarseness(statistics: &GiStatistics, set: &ProbeSet, lattice: &Lattice, grid: &Grid) {
    let size = grid.size().max_element();
    if lattice.cell <= 1.001 * size / set.resolution as f32 {
        return;
    }
    let warning = format!(
        "{} probes along a volume are too many for a buffer of this device: there are {:.0}",
        set.resolution,
        size / lattice.cell
    );
    warn!("{warning}");
    statistics.warn(vec![warning]);
}
