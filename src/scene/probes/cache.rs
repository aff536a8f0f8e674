//! Memory of the probes, and whether they must look at the scene again.

use bevy::{
    ecs::prelude::*,
    log::warn,
    math::{UVec3, Vec3, Vec4, bounding::BoundingVolume},
    render::{
        Extract,
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
        sync_world::RenderEntity,
    },
    transform::components::GlobalTransform,
};

use super::{
    pipelines::{GpuProbePass, ProbePipelines},
    types::GpuProbes,
};
use crate::scene::volume::probe_set::{Lattice, ProbePin, ProbePlacement, ProbeSet};
use crate::{
    gpu::statistics::{GiStatistics, Tracked},
    scene::{
        bounds::overlaps,
        needs::SceneNeeds,
        volume::{ExtractedVolume, GiVolume, Grid, VolumeGrid},
        voxels::SceneVoxels,
        world::casters::SceneCasters,
    },
};

/// Most probes of a volume that are placed by hand.
const MAX_PINS: usize = 256;

/// Where the probes of a volume stand, in the render world.
#[derive(Component, Clone)]
pub(crate) struct ExtractedProbeSet {
    set: ProbeSet,
    /// Of the volume.
    moves: bool,
    /// The box around all meshes, where only its cells have probes.
    around: Option<(Vec3, Vec3)>,
    /// Places by hand.
    pins: Vec<Vec4>,
}

impl ExtractedProbeSet {
    /// The lattice in a volume's grid: as fine as the set wants it, or as `most` probes allow.
    fn lattice(&self, grid: &Grid, most: u64) -> Lattice {
        let with = |resolution| {
            let set = self.set.with_resolution(resolution);
            let all = match self.moves {
                true => Lattice::moving(&set, grid),
                false => Lattice::new(&set, grid),
            };
            self.around.map_or(all, |(min, max)| all.around(min, max))
        };
        (1..=self.set.resolution)
            .rev()
            .map(with)
            .find(|lattice| u64::from(lattice.count()) <= most)
            .unwrap_or_else(|| with(1))
    }
}

type VolumeSet<'a> = (
    RenderEntity,
    &'a GiVolume,
    &'a VolumeGrid,
    Option<&'a ProbeSet>,
);

pub(super) fn extract_sets(
    mut commands: Commands,
    volumes: Extract<Query<VolumeSet>>,
    casters: Extract<Res<SceneCasters>>,
    pins: Extract<Query<&GlobalTransform, With<ProbePin>>>,
) {
    for (entity, volume, grid, set) in &volumes {
        let Some(grid) = grid.0 else { continue };
        let set = set.copied().unwrap_or_default();
        let bounds = grid.bounds();
        let around = (set.placement == ProbePlacement::Automatic).then(|| {
            let inside = casters.casters.iter().map(|caster| caster.bounds);
            let inside = inside.filter(|caster| overlaps(caster, &bounds));
            let all = inside.reduce(|a, b| a.merge(&b)).unwrap_or(bounds);
            (Vec3::from(all.min), Vec3::from(all.max))
        });
        let (min, max) = (Vec3::from(bounds.min), Vec3::from(bounds.max));
        let pins = pins.iter().map(GlobalTransform::translation);
        let pins = pins.filter(|pin| pin.cmpge(min).all() && pin.cmple(max).all());
        commands.entity(entity).insert(ExtractedProbeSet {
            set,
            moves: volume.follow_camera,
            around,
            pins: pins.take(MAX_PINS).map(|pin| pin.extend(0.0)).collect(),
        });
    }
}

/// On a volume's entity while whoever reads its probes wants them to look along other rays in each frame.
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
    for (entity, volume, set, voxels, probes, again) in &mut volumes {
        let Some(voxels) = voxels.filter(|_| needs.probes) else {
            // Nobody looks: the memory is given back.
            commands.entity(entity).remove::<SceneProbes>();
            continue;
        };
        let hits = 8 * set.set.ray_side().pow(2);
        let most = largest / u64::from(needs.probe_bytes.max(hits));
        let lattice = set.lattice(&voxels.grid, most);
        let ExtractedProbeSet { set, pins, .. } = set;
        let set = *set;
        let Some(mut probes) = probes else {
            if ready && voxels.version > 0 {
                let new = SceneProbes::new(set, lattice, &device, &statistics);
                commands.entity(entity).insert(new);
            }
            continue;
        };
        count += u64::from(lattice.count());
        let same = (probes.set.rays, probes.lattice.dims) == (set.rays, lattice.dims);
        if !same {
            *probes = SceneProbes::new(set, lattice, &device, &statistics);
            let size = voxels.grid.size().max_element();
            if lattice.cell > 1.001 * size / set.resolution as f32 {
                let warning = format!(
                    "{} probes along a volume are too many for a buffer of this device: there are {:.0}",
                    set.resolution,
                    size / lattice.cell
                );
                warn!("{warning}");
                statistics.warn(vec![warning]);
            }
        }
        let moved = (probes.set, probes.lattice, &probes.pins) != (set, lattice, pins);
        let captured = probes.version != voxels.version || moved;
        probes.set = set;
        probes.lattice = lattice;
        if probes.pins != *pins || probes.places.buffer().is_none() {
            probes.pins.clone_from(pins);
            let padded = match pins[..] {
                [] => vec![Vec4::ZERO],
                _ => pins.clone(),
            };
            probes.places.set(padded);
            probes.places.write_buffer(&device, &queue);
        }
        probes.job = None;
        if captured {
            probes.round = 0;
        } else if again {
            probes.round += 1;
        } else {
            continue;
        }
        probes.version = voxels.version;
        let mut uniform = UniformBuffer::from(GpuProbePass {
            volume: volume.gpu(),
            probes: probes.gpu(),
            pins: pins.len() as u32,
        });
        uniform.write_buffer(&device, &queue);
        let look = pipelines
            .look_layout
            .bind(&device, &cache)
            .with("brick_map", voxels.brick_map().as_entire_binding())
            .with("occupancy", voxels.occupancy.as_entire_binding())
            .with("pool", voxels.pool.as_entire_binding())
            .with("pass_", &uniform)
            .with("offsets", probes.offsets.as_entire_binding())
            .with("hits", probes.hits.as_entire_binding())
            .with("pins", &probes.places)
            .build();
        let moments = captured.then(|| {
            pipelines
                .moments_layout
                .bind(&device, &cache)
                .with("probes", &probes.uniform(&device, &queue))
                .with("hits", probes.hits.as_entire_binding())
                .with("moments", &*probes.moments)
                .build()
        });
        probes.job = Some(ProbeJob { look, moments });
    }
    statistics.count("scene/probes", count);
}
