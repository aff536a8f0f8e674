//! [`HintsCache`]: the hints of a volume.

use bevy::{
    ecs::prelude::*,
    math::{IVec3, UVec3},
    render::render_resource::*,
};

use super::{
    passes::{BounceFrom, BounceJob, CarryJob, HintsJob},
    pipelines::{HintsPipelines, cache_layout},
    plan::{Content, Plan, Progress, Sources},
    settings::{
        HintAlbedo, HintBounce, HintExchange, HintOcclusion, RadianceHints, RadianceHintsSettings,
    },
    types::{
        GpuCarry, GpuHints, GpuStage, SLOT_BOUNCES, SLOT_EMISSION, SLOT_LIGHTS, SLOT_SKY, blocks,
        slots_of,
    },
    view::RadianceHintsDebugSettings,
};
use crate::{
    gpu::{compute::Recorder, statistics::Tracked},
    scene::{
        probes::{GpuProbes, SceneProbes},
        voxels::{BRICK_VOXELS, SceneVoxels},
    },
    settings::GiSettings,
    technique::{Activity, Cache, Frame, Inputs, Settling},
};

/// The gather itself has no noise, and that of the hints is averaged there.
const SETTLING: Settling = Settling {
    history_frames: 2,
    blur: 0,
};

/// Cells between a hint and the nearest surface that it may light.
const SLEEP_BEYOND: f32 = 2.0;

/// A hint has hardly changed if its light did by less than that part of it.
const QUIET: f32 = 0.01;

/// The hints of a volume, see the [module](super).
#[derive(Component)]
pub struct HintsCache {
    shape: Shape,
    /// Of each slot: coefficients of radiance in nits at each hint; in the fourth components, what `slots.wgsl` says.
    pub(super) slot_light: Tracked<Buffer>,
    /// Of each hint: mean albedo of the surfaces around it.
    albedos: Tracked<Buffer>,
    /// The sum that is looked up.
    texture: Tracked<TextureView>,
    /// Of each voxel of the pool, front and back, packed as emission: what it reflects of a bounce.
    reflected: Tracked<Buffer>,
    /// The slots as they were before the volume moved; of volumes that do.
    carried: Option<Tracked<Buffer>>,
    progress: Progress,
    bind_group: Option<BindGroup>,
    job: Option<HintsJob>,
}

/// How large a cache is.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Shape {
    /// Hints along each axis.
    dims: UVec3,
    /// Bricks in the pool of voxels.
    capacity: u32,
    /// Coefficients of each colour.
    coefficients: u32,
    /// Kinds of light that are kept apart.
    slots: u32,
}

impl Shape {
    fn new(voxels: &SceneVoxels, probes: &SceneProbes, settings: &RadianceHintsSettings) -> Self {
        Self {
            dims: probes.dims(),
            capacity: voxels.capacity,
            coefficients: settings.order.coefficients(),
            slots: slot_count(settings),
        }
    }
}

/// Slots that the settings need.
pub(super) fn slot_count(settings: &RadianceHintsSettings) -> u32 {
    SLOT_BOUNCES + settings.bounces.saturating_sub(1)
}

/// The slots that light the picture, a bit each.
fn shown_slots(
    gi: &GiSettings,
    debug: &RadianceHintsDebugSettings,
    settings: &RadianceHintsSettings,
) -> u32 {
    let slots = slot_count(settings);
    let part = slots_of(debug.view, slots).filter(|_| debug.only_view);
    let shown = part.unwrap_or((1 << slots) - 1);
    match gi.replace_ambient {
        true => shown,
        false => shown & !(1 << SLOT_SKY),
    }
}

impl Cache<RadianceHints> for HintsCache {
    fn new(frame: &Frame<RadianceHints>) -> Option<Self> {
        let (voxels, probes) = (frame.voxels?, frame.probes?);
        if probes.version == 0 {
            return None;
        }
        let device = frame.device;
        let shape = Shape::new(voxels, probes, frame.settings);
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("gi/hints/coefficients"),
            size: Extent3d {
                width: shape.dims.x,
                height: shape.dims.y,
                depth_or_array_layers: shape.dims.z * blocks(frame.settings.order),
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D3,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let texture = frame.statistics.texture("hints/coefficients", texture);
        let usage = BufferUsages::COPY_SRC;
        let buffer = |name, words| frame.statistics.storage_buffer(device, name, words, usage);
        let hints = u64::from(probes.lattice.count());
        let lights = hints * u64::from(4 * shape.coefficients);
        let voxel_count = u64::from(voxels.capacity) * u64::from(BRICK_VOXELS);
        Some(Self {
            shape,
            slot_light: buffer("hints/slots", lights * u64::from(shape.slots)),
            texture: texture.map(|t| t.create_view(&TextureViewDescriptor::default())),
            albedos: buffer("hints/albedos", 4 * hints),
            reflected: buffer("hints/voxel_reflected", 2 * voxel_count),
            carried: None,
            progress: Progress::default(),
            bind_group: None,
            job: None,
        })
    }

    fn fits(&self, frame: &Frame<RadianceHints>) -> bool {
        match (frame.voxels, frame.probes) {
            (Some(voxels), Some(probes)) => {
                self.shape == Shape::new(voxels, probes, frame.settings)
            }
            _ => false,
        }
    }

    fn update(&mut self, frame: &Frame<RadianceHints>) -> Activity {
        self.job = None;
        let (Some(voxels), Some(probes)) = (frame.voxels, frame.probes) else {
            return Activity::default();
        };
        let settings = frame.settings;
        let by_depth = matches!(settings.occlusion, HintOcclusion::CameraDepth(_));
        let content = Content {
            sources: Sources {
                voxels: probes.version,
                probes: GpuProbes {
                    round: 0,
                    ..probes.gpu()
                },
                sky: frame.lighting.sky,
                settings: settings.without_lookup(),
                history: frame.history,
            },
            settings: settings.clone(),
            lighting: frame.lighting,
            rsm: frame.light_maps.rsm_version,
            reflected: frame.light_maps.content_version,
            shown: shown_slots(frame.gi, frame.debug, settings),
            share: frame.capture.light_share,
            vpls: frame.light_maps.vpls_of(frame.volume.main.id()),
            camera: frame.camera_depth.clip_from_world.filter(|_| by_depth),
        };
        let (shown, vpls) = (content.shown, content.vpls);
        let unit = frame.units.light();
        let Some(plan) = self.progress.step(content, unit, probes.looks()) else {
            return Activity::default();
        };
        self.bind_group = Some(self.lookup(&plan, vpls, unit, voxels, probes, frame));
        self.job = Some(self.job(&plan, shown, unit, voxels, probes, frame));
        Activity {
            // The same light in another unit is no reason to forget, nor to look again.
            settling: plan.relights.then_some(SETTLING),
            look_again: plan.look_again,
        }
    }

    fn record(&self, pipelines: &HintsPipelines, inputs: Inputs, recorder: &mut Recorder) {
        let (Some(job), Some(cache), Some(probes)) = (&self.job, &self.bind_group, inputs.probes)
        else {
            return;
        };
        job.record(pipelines, probes, &inputs, cache, recorder);
    }

    fn bind_group(&self) -> Option<&BindGroup> {
        self.bind_group.as_ref()
    }
}

impl HintsCache {
    /// Kinds of light that are kept apart.
    pub(super) fn slots(&self) -> u32 {
        self.shape.slots
    }

    /// Group 2 of whatever looks the hints up.
    fn lookup(
        &self,
        plan: &Plan,
        (first_vpl, vpls): (u32, u32),
        unit: f32,
        voxels: &SceneVoxels,
        probes: &SceneProbes,
        frame: &Frame<RadianceHints>,
    ) -> BindGroup {
        let settings = frame.settings;
        let cell = probes.lattice.cell;
        let diagonal = voxels.grid.size().length();
        let mut uniform = UniformBuffer::from(GpuHints {
            samples: plan.samples,
            first_sample: plan.first_sample,
            vpls,
            first_vpl,
            frame: plan.frame,
            blend_lights: plan.blend_lights,
            blend_sources: plan.blend_sources,
            blend_bounces: plan.blend_bounces,
            sleep_beyond: match plan.sleeps {
                true => SLEEP_BEYOND * cell,
                false => f32::MAX,
            },
            share: frame.capture.light_share as u32,
            quiet: if plan.sleeps { QUIET } else { 0.0 },
            unit,
            ..GpuHints::new(settings, diagonal, cell)
        });
        uniform.write_buffer(frame.device, frame.queue);
        cache_layout()
            .bind(frame.device, frame.cache)
            .with("probes", &probes.uniform(frame.device, frame.queue))
            .with("offsets", probes.offsets.as_entire_binding())
            .with("moments", &*probes.moments)
            .with("probe_sampler", &probes.sampler)
            .with("hints", &uniform)
            .with("coefficients", &*self.texture)
            .build()
    }

    /// The bind groups for what is planned.
    fn job(
        &mut self,
        plan: &Plan,
        shown: u32,
        unit: f32,
        voxels: &SceneVoxels,
        probes: &SceneProbes,
        frame: &Frame<RadianceHints>,
    ) -> HintsJob {
        let Frame {
            pipelines,
            cache,
            device,
            queue,
            settings,
            ..
        } = *frame;
        let carry = plan.shift.map(|shift| self.carry(shift, frame));
        let Shape {
            dims,
            coefficients,
            slots,
            ..
        } = self.shape;
        let stage = |slot: u32, mask: u32, [first_gain, later_gain]: [f32; 2]| {
            let mut uniform = UniformBuffer::from(GpuStage {
                slot,
                mask,
                slots,
                coefficients,
                dims,
                first_gain,
                later_gain,
                unit,
            });
            uniform.write_buffer(device, queue);
            uniform
        };
        // What bounces on is physical.
        const PHYSICAL: [f32; 2] = [1.0; 2];
        let sum = |mask: u32, gains| {
            pipelines
                .sum_layout
                .bind(device, cache)
                .with("stage", &stage(0, mask, gains))
                .with("target_", &*self.texture)
                .with("slots", self.slot_light.as_entire_binding())
                .with("albedos", self.albedos.as_entire_binding())
                .build()
        };
        let collect = |slot: u32| {
            pipelines
                .collect_layout
                .bind(device, cache)
                .with("stage", &stage(slot, 0, PHYSICAL))
                .with("pool", voxels.pool.as_entire_binding())
                .with("reflected", self.reflected.as_entire_binding())
                .with("hits", probes.hits.as_entire_binding())
                .with("slots", self.slot_light.as_entire_binding())
                .build()
        };
        let from_surfaces = |slot: u32| BounceFrom::Surfaces {
            light: pipelines
                .surfaces_layout
                .bind(device, cache)
                .with("pool", voxels.pool.as_entire_binding())
                .with("reflected", self.reflected.as_entire_binding())
                .with("brick_list", voxels.brick_list.as_entire_binding())
                .with("voxel_list", voxels.voxel_list.as_entire_binding())
                .with("counters", voxels.counters.as_entire_binding())
                .build(),
            collect: collect(slot),
        };
        let from_hints = |slot: u32| {
            BounceFrom::Hints(
                pipelines
                    .exchange_layout
                    .bind(device, cache)
                    .with("stage", &stage(slot, 0, PHYSICAL))
                    .with("slots", self.slot_light.as_entire_binding())
                    .build(),
            )
        };
        let sources = match plan.looks {
            true => vec![collect(SLOT_EMISSION), collect(SLOT_SKY)],
            false => Vec::new(),
        };
        let first = 1 << SLOT_LIGHTS | 1 << SLOT_EMISSION | 1 << SLOT_SKY;
        let bounces = (SLOT_BOUNCES..slots).map(|slot| {
            let before = match (slot, settings.bounce) {
                (SLOT_BOUNCES, _) => first,
                (_, HintBounce::HintsLiteral(_)) => (1 << slot) - 1,
                _ => 1 << (slot - 1),
            };
            if settings.bounce != HintBounce::Surfaces {
                return BounceJob {
                    sum: sum(before, PHYSICAL),
                    from: from_hints(slot),
                };
            }
            let itself = plan.endless && slot + 1 == slots;
            BounceJob {
                sum: sum(before | u32::from(itself) << slot, PHYSICAL),
                from: from_surfaces(slot),
            }
        });
        let slot_bytes = self.slot_light.size() / u64::from(slots);
        HintsJob {
            relights: plan.relights,
            carry,
            albedo: self.albedo(plan, voxels, probes, frame),
            lights: self.lights(voxels, frame),
            clear: (self.slot_light.clone(), slot_bytes),
            sources,
            bounces: bounces.collect(),
            sum: sum(shown, [settings.first_gain, settings.later_gain]),
        }
    }

    /// What collects the light of lamps, if there are any.
    fn lights(&self, voxels: &SceneVoxels, frame: &Frame<RadianceHints>) -> Option<BindGroup> {
        let wanted = frame.light_maps.rsm_bind_group.is_some() && frame.settings.bounces > 0;
        let layout = &frame.pipelines.lights_layout;
        wanted.then(|| {
            layout
                .bind(frame.device, frame.cache)
                .with("brick_map", voxels.brick_map().as_entire_binding())
                .with("occupancy", voxels.occupancy.as_entire_binding())
                .with("slots", self.slot_light.as_entire_binding())
                .with("camera_depth", &*frame.camera_depth.texture)
                .with("camera", frame.camera_depth.camera.as_entire_binding())
                .build()
        })
    }

    /// What averages the colour of surfaces, if a bounce needs it.
    fn albedo(
        &self,
        plan: &Plan,
        voxels: &SceneVoxels,
        probes: &SceneProbes,
        frame: &Frame<RadianceHints>,
    ) -> Option<BindGroup> {
        let settings = frame.settings;
        let coloured = match settings.bounce {
            HintBounce::Surfaces => false,
            HintBounce::Hints(HintExchange { albedo, .. })
            | HintBounce::HintsLiteral(HintExchange { albedo, .. }) => {
                albedo == HintAlbedo::Surfaces
            }
        };
        let layout = &frame.pipelines.albedo_layout;
        (coloured && plan.new_surfaces).then(|| {
            layout
                .bind(frame.device, frame.cache)
                .with("pool", voxels.pool.as_entire_binding())
                .with("hits", probes.hits.as_entire_binding())
                .with("albedos", self.albedos.as_entire_binding())
                .build()
        })
    }

    /// What moves light along with the hints.
    fn carry(&mut self, shift: IVec3, frame: &Frame<RadianceHints>) -> CarryJob {
        let (device, statistics) = (frame.device, frame.statistics);
        let before = self.carried.get_or_insert_with(|| {
            let words = self.slot_light.size() / 4;
            let usage = BufferUsages::empty();
            statistics.storage_buffer(device, "hints/slots_before", words, usage)
        });
        let mut uniform = UniformBuffer::from(GpuCarry {
            shift,
            blocks: self.shape.slots * self.shape.coefficients,
            dims: self.shape.dims,
        });
        uniform.write_buffer(device, frame.queue);
        CarryJob {
            copy: (self.slot_light.clone(), before.clone()),
            group: frame
                .pipelines
                .carry_layout
                .bind(device, frame.cache)
                .with("carry_", &uniform)
                .with("before", before.as_entire_binding())
                .with("slots", self.slot_light.as_entire_binding())
                .build(),
        }
    }
}
