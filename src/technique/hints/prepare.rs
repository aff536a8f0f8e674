//! Memory of the hints, their bind groups, and what is left to do.

use bevy::{
    ecs::prelude::*,
    math::{IVec3, Mat4, UVec3},
    render::{
        Extract,
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    node::HintsPipelines,
    settings::{HintBounce, HintOcclusion, HintSampling, RadianceHintsSettings},
    types::{
        GpuCarry, GpuHints, GpuStage, SLOT_BOUNCES, SLOT_EMISSION, SLOT_LIGHTS, SLOT_SKY, blocks,
        slots_of,
    },
};
use crate::{
    camera::ExtractedGiCamera,
    debug::GiDebugSettings,
    gpu::statistics::{GiStatistics, Tracked},
    scene::{
        bind_group::LightingVersion,
        needs::SceneNeeds,
        probes::{GpuProbes, LookAgain, SceneProbes},
        rsm::SceneRsm,
        units::LightUnits,
        volume::ExtractedVolume,
        voxels::{BRICK_VOXELS, SceneVoxels},
    },
    settings::{GiHistory, GiSettings, GiTechnique, LightShare},
    surface::depth::CameraDepth,
    technique::{Settling, TechniqueCache},
};

/// The gather itself has no noise, and that of the hints is averaged there.
const SETTLING: Settling = Settling {
    history_frames: 2,
    blur: 0,
};

/// Frames after a change in which bounces follow each other as fast as they can, along the same rays; after
/// that, each is averaged over many rays.
const BOUNCING_FRAMES: u32 = 8;

/// Light that has changed in so many frames in a row changes all the time.
const BUSY: u32 = 4;

/// Cells between a hint and the nearest surface that it may light.
const SLEEP_BEYOND: f32 = 2.0;

/// A hint has hardly changed if its light did by less than that part of it.
const QUIET: f32 = 0.01;

/// Everything whose change makes the light of emissive surfaces and of the sky wrong.
#[derive(Clone, PartialEq)]
struct Sources {
    voxels: u64,
    probes: GpuProbes,
    sky: u64,
    /// But for what only matters where light is looked up.
    settings: RadianceHintsSettings,
    history: u32,
}

impl Sources {
    /// Cells by which the hints have moved since; `None` if the light of before has nothing to do with that of
    /// now.
    fn moved_from(&self, before: &Self) -> Option<IVec3> {
        let same = (&self.settings, self.history) == (&before.settings, before.history);
        self.probes.moved_from(&before.probes).filter(|_| same)
    }
}

/// Everything whose change makes any light wrong.
#[derive(Clone, PartialEq)]
struct Content {
    sources: Sources,
    settings: RadianceHintsSettings,
    lighting: LightingVersion,
    rsm: u64,
    /// The slots that are looked up, a bit each.
    shown: u32,
    share: LightShare,
    /// The volume's virtual point lights: the first, and their number.
    vpls: (u32, u32),
    /// Where what the camera sees matters.
    camera: Option<Mat4>,
}

/// The hints of a volume, see the [module](super).
#[derive(Component)]
pub struct HintsCache {
    dims: UVec3,
    capacity: u32,
    coefficients: u32,
    pub(super) slots: u32,
    /// Of each slot: coefficients of radiance in nits at each hint; in the fourth components, what `slots.wgsl` says.
    pub(super) slot_light: Tracked<Buffer>,
    /// Of each hint: mean albedo of the surfaces around it.
    albedos: Tracked<Buffer>,
    /// The sum that is looked up.
    texture: Tracked<TextureView>,
    /// Of each voxel of the pool, front and back, packed as emission: what it reflects of a bounce.
    reflected: Tracked<Buffer>,
    content: Option<Content>,
    /// Counts updates.
    frame: u32,
    /// Updates since any light changed,
    since: u32,
    /// updates that the light of lamps counts for, and looks at the sources since those changed.
    frames: u32,
    source_frames: u32,
    /// Updates in a row in each of which something changed.
    busy: u32,
    /// The slots as they were before the volume moved; of volumes that do.
    carried: Option<Tracked<Buffer>>,
    bind_group: Option<BindGroup>,
    /// Nits of a unit of the texture.
    unit: f32,
    pub(crate) job: Option<HintsJob>,
}

impl TechniqueCache for HintsCache {
    fn bind_group(&self) -> Option<&BindGroup> {
        self.bind_group.as_ref()
    }
}

/// What one frame's update runs.
pub(crate) struct HintsJob {
    /// Whether light changes, and not only the unit of the sum.
    pub relights: bool,
    pub carry: Option<CarryJob>,
    /// Where light bounces from hint to hint: after a capture.
    pub albedo: Option<BindGroup>,
    /// Without lamps, their slot is emptied instead.
    pub lights: Option<BindGroup>,
    /// The slot of the lamps, and its bytes.
    pub clear: (Tracked<Buffer>, u64),
    /// Emission and sky, where the probes have looked along other rays.
    pub sources: Vec<BindGroup>,
    pub bounces: Vec<BounceJob>,
    /// What is looked up.
    pub sum: BindGroup,
}

/// Light that moves along with the hints.
pub(crate) struct CarryJob {
    /// From where to where the slots are copied first.
    pub copy: (Tracked<Buffer>, Tracked<Buffer>),
    pub group: BindGroup,
}

/// One bounce.
pub(crate) struct BounceJob {
    /// Sums up the light that bounces.
    pub sum: BindGroup,
    pub from: BounceFrom,
}

/// Where light bounces.
pub(crate) enum BounceFrom {
    /// At other hints.
    Hints(BindGroup),
    /// At surfaces: they are lit, and then looked at.
    Surfaces { light: BindGroup, gather: BindGroup },
}

type VolumeData<'a> = (
    Entity,
    &'a ExtractedVolume,
    Option<&'a SceneVoxels>,
    Option<&'a SceneProbes>,
    Option<&'a mut HintsCache>,
);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(crate) fn prepare_hints(
    mut commands: Commands,
    mut volumes: Query<VolumeData>,
    cameras: Query<&ExtractedGiCamera>,
    gi: Res<GiSettings>,
    settings: Res<RadianceHintsSettings>,
    debug: Res<GiDebugSettings>,
    history: Res<GiHistory>,
    (lighting, units): (Res<LightingVersion>, Res<LightUnits>),
    rsm: Res<SceneRsm>,
    camera: Option<ResMut<CameraDepth>>,
    pipelines: Res<HintsPipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
) {
    let wanted = cameras
        .iter()
        .any(|camera| camera.technique == GiTechnique::RadianceHints);
    let Some(mut camera) = camera else { return };
    camera.wanted = wanted && settings.occlusion == HintOcclusion::CameraDepth;
    let ready = pipelines.ready(&cache);
    for (entity, volume, voxels, probes, hints) in &mut volumes {
        let (Some(voxels), Some(probes), true) = (voxels, probes, wanted) else {
            // Nobody looks: the memory is given back.
            commands.entity(entity).remove::<HintsCache>();
            continue;
        };
        let Some(mut hints) = hints else {
            if ready && probes.version > 0 {
                let new = HintsCache::new(voxels, probes, &settings, &device, &statistics);
                commands.entity(entity).insert(new);
            }
            continue;
        };
        let size = (
            probes.dims(),
            voxels.capacity,
            settings.order.coefficients(),
            slot_count(&settings),
        );
        if (hints.dims, hints.capacity, hints.coefficients, hints.slots) != size {
            *hints = HintsCache::new(voxels, probes, &settings, &device, &statistics);
        }
        let content = Content {
            sources: Sources {
                voxels: probes.version,
                probes: GpuProbes {
                    round: 0,
                    ..probes.gpu()
                },
                sky: lighting.0[2],
                settings: settings.without_lookup(),
                history: history.epoch(),
            },
            settings: settings.clone(),
            lighting: *lighting,
            rsm: rsm.version,
            shown: shown_slots(&gi, &debug, &settings),
            share: gi.light_share,
            vpls: rsm.vpls_of(volume.main.id()),
            camera: camera.clip_from_world.filter(|_| camera.wanted),
        };
        hints.plan(
            voxels,
            probes,
            &rsm,
            &camera,
            content,
            units.light(),
            &pipelines,
            &cache,
            &device,
            &queue,
            &statistics,
        );
        let mut volume = commands.entity(entity);
        // The same light in another unit is no reason to forget, nor to look again.
        let relights = hints.job.as_ref().is_some_and(|job| job.relights);
        match relights {
            true => volume.insert(SETTLING),
            false => volume.remove::<Settling>(),
        };
        match relights && hints.since >= BOUNCING_FRAMES {
            true => volume.insert(LookAgain),
            false => volume.remove::<LookAgain>(),
        };
    }
}

/// Says how much light a hint holds, of all slots.
pub(super) fn extract_probe_bytes(
    settings: Extract<Res<RadianceHintsSettings>>,
    mut needs: ResMut<SceneNeeds>,
) {
    let bytes = 16 * settings.order.coefficients() * slot_count(&settings);
    needs.probe_bytes = needs.probe_bytes.max(bytes);
}

/// Slots that the settings need.
fn slot_count(settings: &RadianceHintsSettings) -> u32 {
    SLOT_BOUNCES + settings.bounces.saturating_sub(1)
}

/// Updates that light counts for at most when something has moved: as the settings want it, but so few that no more
/// than a fiftieth of the light of before is left when hints come to rest. From `a` updates on, `s` more with a share
/// of `2 / (n + 2)` each leave `a (a + 1) / (a + s) (a + s + 1)`.
fn memory(settings: &RadianceHintsSettings) -> u32 {
    let wanted = (2.0 / settings.temporal_blend - 2.0).round() as u32;
    let s = settings.settle_frames;
    let fades = |a: &u32| 50 * a * (a + 1) <= (a + s) * (a + s + 1);
    (0..=wanted).rev().find(fades).unwrap_or(0)
}

/// The slots that light the picture, a bit each.
fn shown_slots(gi: &GiSettings, debug: &GiDebugSettings, settings: &RadianceHintsSettings) -> u32 {
    let slots = slot_count(settings);
    let part = slots_of(debug.hint_view, slots).filter(|_| debug.only_hint_view);
    let shown = part.unwrap_or((1 << slots) - 1);
    match gi.replace_ambient {
        true => shown,
        false => shown & !(1 << SLOT_SKY),
    }
}

impl HintsCache {
    fn new(
        voxels: &SceneVoxels,
        probes: &SceneProbes,
        settings: &RadianceHintsSettings,
        device: &RenderDevice,
        statistics: &GiStatistics,
    ) -> Self {
        let dims = probes.dims();
        let coefficients = settings.order.coefficients();
        let slots = slot_count(settings);
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("gi/hints/coefficients"),
            size: Extent3d {
                width: dims.x,
                height: dims.y,
                depth_or_array_layers: dims.z * blocks(settings.order),
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D3,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let texture = statistics.texture("hints/coefficients", texture);
        let buffer =
            |name, words| statistics.storage_buffer(device, name, words, BufferUsages::COPY_SRC);
        let lights = u64::from(probes.lattice.count()) * u64::from(4 * coefficients);
        let voxel_count = u64::from(voxels.capacity) * u64::from(BRICK_VOXELS);
        Self {
            dims,
            capacity: voxels.capacity,
            coefficients,
            slots,
            slot_light: buffer("hints/slots", lights * u64::from(slots)),
            texture: texture.map(|t| t.create_view(&TextureViewDescriptor::default())),
            albedos: buffer("hints/albedos", 4 * u64::from(probes.lattice.count())),
            reflected: buffer("hints/voxel_reflected", 2 * voxel_count),
            content: None,
            frame: 0,
            since: 0,
            frames: 0,
            source_frames: 0,
            busy: 0,
            carried: None,
            bind_group: None,
            unit: 1.0,
            job: None,
        }
    }

    /// Decides what this frame does.
    #[allow(clippy::too_many_arguments, reason = "what a frame depends on")]
    fn plan(
        &mut self,
        voxels: &SceneVoxels,
        probes: &SceneProbes,
        rsm: &SceneRsm,
        camera: &CameraDepth,
        content: Content,
        unit: f32,
        pipelines: &HintsPipelines,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
        statistics: &GiStatistics,
    ) {
        self.job = None;
        let settings = content.settings.clone();
        let before = self.content.as_ref();
        self.busy = match before {
            Some(before) if *before != content => self.busy.saturating_add(1),
            _ => 0,
        };
        if let Some(before) = before.filter(|before| **before != content) {
            // What is known counts on for a while where only things move, or light would flicker; not where
            // a lamp is switched.
            let switched = before.lighting != content.lighting;
            let most = if switched { 1 } else { u32::MAX };
            self.frames = self.frames.min(memory(&settings)).min(most);
            self.since = 0;
        }
        let moved = before.and_then(|before| content.sources.moved_from(&before.sources));
        if moved.is_none() {
            self.since = 0;
            self.frames = 0;
            self.frame = 0;
        }
        if before.map(|c| &c.sources) != Some(&content.sources) {
            self.source_frames = 0;
        }
        let (first_vpl, vpls) = content.vpls;
        let samples = match settings.sampling {
            HintSampling::VirtualPointLights => settings.samples.min(vpls),
            _ => settings.samples,
        };
        // Hints do not rest before they have looked at each virtual point light.
        let looks = match settings.sampling {
            HintSampling::VirtualPointLights => vpls.div_ceil(samples.max(1)),
            _ => 0,
        };
        let relights = self.since < settings.settle_frames.max(looks);
        if !relights && self.unit == unit {
            return;
        }
        self.unit = unit;
        let fresh = before.is_none_or(|c| c.sources.history != content.sources.history);

        let sleeps = probes.gpu().sleeping != 0
            && self.busy > BUSY
            && moved.is_some()
            && settings.bounce == HintBounce::Surfaces;
        // Hints that sleep have their turn in every fourth frame: each time with other virtual point lights.
        let turn = match sleeps {
            true => self.frame + self.frame / 4,
            false => self.frame,
        };
        let mut uniform = UniformBuffer::from(GpuHints {
            coefficients: self.coefficients,
            samples,
            first_sample: (turn * samples) % vpls.max(1),
            vpls,
            first_vpl,
            frame: self.frame,
            // The first frames are rough, and soon count for nothing.
            blend_lights: 2.0 / (self.frames + 2) as f32,
            blend_sources: 1.0 / (self.source_frames + 1) as f32,
            blend_bounces: match self.since.checked_sub(BOUNCING_FRAMES) {
                None => 1.0,
                // What was bounced of incomplete light counts less and less.
                Some(averaged) => 2.0 / (averaged + 2) as f32,
            },
            specular: settings.specular.into(),
            sampling: settings.sampling as u32,
            occlusion: settings.occlusion as u32,
            bounce: settings.bounce as u32,
            spread: settings.spread,
            bounce_samples: settings.bounce_samples,
            reach: settings.reach * voxels.grid.size().length(),
            average_albedo: settings.average_albedo,
            reconstruction: settings.reconstruction as u32,
            tap_distance: settings.tap_distance * probes.lattice.cell,
            sleep_beyond: if sleeps {
                SLEEP_BEYOND * probes.lattice.cell
            } else {
                f32::MAX
            },
            share: content.share as u32,
            coloured: settings.coloured_bounces.into(),
            occlusion_points: settings.occlusion_points,
            occlusion_left: 1.0 - settings.occlusion_factor,
            min_distance: settings.min_distance * probes.lattice.cell,
            guess_visibility: settings.guess_visibility.into(),
            taps: settings.taps,
            ring_cos: settings.ring_angle.to_radians().cos(),
            quiet: if sleeps { QUIET } else { 0.0 },
            unit,
        });
        uniform.write_buffer(device, queue);
        let cache_group = device.create_bind_group(
            "gi/hints/cache",
            &cache.get_bind_group_layout(&pipelines.cache_layout),
            &BindGroupEntries::sequential((
                &probes.uniform(device, queue),
                probes.offsets.as_entire_binding(),
                &*probes.moments,
                &probes.sampler,
                &uniform,
                &*self.texture,
            )),
        );
        let stage = |slot: u32, mask: u32, [first_gain, later_gain]: [f32; 2]| {
            let mut uniform = UniformBuffer::from(GpuStage {
                slot,
                mask,
                slots: self.slots,
                coefficients: self.coefficients,
                dims: self.dims,
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
            device.create_bind_group(
                "gi/hints/sum",
                &cache.get_bind_group_layout(&pipelines.sum_layout),
                &BindGroupEntries::with_indices((
                    (0, &stage(0, mask, gains)),
                    (1, &*self.texture),
                    (4, self.slot_light.as_entire_binding()),
                    (6, self.albedos.as_entire_binding()),
                )),
            )
        };
        let gather = |slot: u32| {
            device.create_bind_group(
                "gi/hints/bounce",
                &cache.get_bind_group_layout(&pipelines.gather_layout),
                &BindGroupEntries::sequential((
                    &stage(slot, 0, PHYSICAL),
                    voxels.pool.as_entire_binding(),
                    self.reflected.as_entire_binding(),
                    probes.hits.as_entire_binding(),
                    self.slot_light.as_entire_binding(),
                )),
            )
        };
        let from_surfaces = |slot: u32| BounceFrom::Surfaces {
            light: device.create_bind_group(
                "gi/hints/surfaces",
                &cache.get_bind_group_layout(&pipelines.surfaces_layout),
                &BindGroupEntries::sequential((
                    &stage(slot, 0, PHYSICAL),
                    voxels.pool.as_entire_binding(),
                    self.reflected.as_entire_binding(),
                    voxels.brick_list.as_entire_binding(),
                    voxels.voxel_list.as_entire_binding(),
                    voxels.counters.as_entire_binding(),
                )),
            ),
            gather: gather(slot),
        };
        let from_hints = |slot: u32| {
            BounceFrom::Hints(device.create_bind_group(
                "gi/hints/exchange",
                &cache.get_bind_group_layout(&pipelines.exchange_layout),
                &BindGroupEntries::with_indices((
                    (0, &stage(slot, 0, PHYSICAL)),
                    (4, self.slot_light.as_entire_binding()),
                )),
            ))
        };
        let look = self.source_frames == 0 || probes.looks();
        let sources = match look {
            true => vec![gather(SLOT_EMISSION), gather(SLOT_SKY)],
            false => Vec::new(),
        };
        let first = 1 << SLOT_LIGHTS | 1 << SLOT_EMISSION | 1 << SLOT_SKY;
        let bounces = (SLOT_BOUNCES..self.slots)
            .map(|slot| {
                let before = match (slot, settings.bounce) {
                    (SLOT_BOUNCES, _) => first,
                    (_, HintBounce::HintsLiteral) => (1 << slot) - 1,
                    _ => 1 << (slot - 1),
                };
                if settings.bounce != HintBounce::Surfaces {
                    return BounceJob {
                        sum: sum(before, PHYSICAL),
                        from: from_hints(slot),
                    };
                }
                let itself = settings.endless && slot + 1 == self.slots && !fresh;
                BounceJob {
                    sum: sum(before | u32::from(itself) << slot, PHYSICAL),
                    from: from_surfaces(slot),
                }
            })
            .collect();
        let bounces_at_all = settings.bounces > 0;
        let lights = (rsm.bind_group.is_some() && bounces_at_all).then(|| {
            device.create_bind_group(
                "gi/hints/lights",
                &cache.get_bind_group_layout(&pipelines.lights_layout),
                &BindGroupEntries::with_indices((
                    (0, voxels.brick_map().as_entire_binding()),
                    (1, voxels.occupancy.as_entire_binding()),
                    (4, self.slot_light.as_entire_binding()),
                    (6, &*camera.texture),
                    (7, camera.camera.as_entire_binding()),
                )),
            )
        });
        let carry = moved.filter(|cells| *cells != IVec3::ZERO).map(|shift| {
            let before = self.carried.get_or_insert_with(|| {
                let words = self.slot_light.size() / 4;
                let usage = BufferUsages::empty();
                statistics.storage_buffer(device, "hints/slots_before", words, usage)
            });
            let mut uniform = UniformBuffer::from(GpuCarry {
                shift,
                blocks: self.slots * self.coefficients,
                dims: self.dims,
            });
            uniform.write_buffer(device, queue);
            CarryJob {
                copy: (self.slot_light.clone(), before.clone()),
                group: device.create_bind_group(
                    "gi/hints/carry",
                    &cache.get_bind_group_layout(&pipelines.carry_layout),
                    &BindGroupEntries::with_indices((
                        (0, &uniform),
                        (1, before.as_entire_binding()),
                        (4, self.slot_light.as_entire_binding()),
                    )),
                ),
            }
        });
        let coloured = settings.bounce != HintBounce::Surfaces && settings.coloured_bounces;
        let albedo = (coloured && self.source_frames == 0).then(|| {
            device.create_bind_group(
                "gi/hints/albedo",
                &cache.get_bind_group_layout(&pipelines.albedo_layout),
                &BindGroupEntries::with_indices((
                    (1, voxels.pool.as_entire_binding()),
                    (3, probes.hits.as_entire_binding()),
                    (6, self.albedos.as_entire_binding()),
                )),
            )
        });
        let slot_bytes = self.slot_light.size() / u64::from(self.slots);
        self.job = Some(HintsJob {
            relights,
            carry,
            albedo,
            lights,
            clear: (self.slot_light.clone(), slot_bytes),
            sources,
            bounces,
            sum: sum(content.shown, [settings.first_gain, settings.later_gain]),
        });
        self.bind_group = Some(cache_group);
        if !relights {
            return;
        }
        self.content = Some(content);
        self.frame = self.frame.wrapping_add(1) % 4096;
        self.since += 1;
        self.frames += 1;
        self.source_frames += u32::from(look);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_light_of_before_is_left_when_hints_rest() {
        for (settle_frames, temporal_blend) in [
            (1, 0.5),
            (2, 0.5),
            (16, 0.5),
            (32, 0.5),
            (32, 0.05),
            (128, 0.05),
        ] {
            let settings = RadianceHintsSettings {
                settle_frames,
                temporal_blend,
                ..Default::default()
            };
            let memory = memory(&settings);
            let shares = (memory..memory + settle_frames).map(|n| 2.0 / (n + 2) as f32);
            let left: f32 = shares.map(|share| 1.0 - share).product();
            assert!(
                left <= 0.02 + 1e-6,
                "{settle_frames}, {temporal_blend}: {left}"
            );
        }
        assert_eq!(memory(&RadianceHintsSettings::default()), 2);
        assert_eq!(memory(&RadianceHintsSettings::paper()), 0);
    }
}
