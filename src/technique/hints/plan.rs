//! When the light of hints is computed anew, and what it counts for: the decision alone, without a GPU.

use bevy::math::{IVec3, Mat4};

use super::settings::{HintBounce, HintSampling, RadianceHintsSettings};
use crate::{
    scene::{bind_group::LightingVersion, probes::GpuProbes},
    settings::LightShare,
};

/// Frames after a change in which bounces follow each other as fast as they can, along the same rays; after
/// that, each is averaged over many rays.
const BOUNCING_FRAMES: u32 = 8;

/// Light that has changed in more frames in a row than this changes all the time.
const BUSY: u32 = 4;

/// Everything whose change makes the light of emissive surfaces and of the sky wrong.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sources {
    /// Version of the voxels that the probes have seen.
    pub voxels: u64,
    /// Where hints stand, whichever rays they trace.
    pub probes: GpuProbes,
    /// Version of the sky.
    pub sky: u64,
    /// But for what only matters where light is looked up.
    pub settings: RadianceHintsSettings,
    /// Number of resets of the history.
    pub history: u32,
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
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Content {
    pub sources: Sources,
    pub settings: RadianceHintsSettings,
    pub lighting: LightingVersion,
    /// Version of the reflective shadow maps and of the virtual point lights in them,
    pub rsm: u64,
    /// and of the light that they are samples of.
    pub reflected: u64,
    /// The slots that are looked up, a bit each.
    pub shown: u32,
    pub share: LightShare,
    /// The volume's virtual point lights: the first, and their number.
    pub vpls: (u32, u32),
    /// Where what the camera sees matters.
    pub camera: Option<Mat4>,
}

impl Content {
    /// Whether this is the same light in other samples: maps have been drawn in more or fewer texels.
    fn resamples(&self, before: &Self) -> bool {
        let same = Self {
            rsm: self.rsm,
            lighting: LightingVersion {
                shadows: self.lighting.shadows,
                ..before.lighting
            },
            ..before.clone()
        };
        *self == same && self != before
    }
}

/// How far the light of hints has settled.
#[derive(Default)]
pub(super) struct Progress {
    /// What the hints show; `None` at first.
    content: Option<Content>,
    /// Nits of a unit in which that is.
    unit: f32,
    /// Updates, up to 4096.
    frame: u32,
    /// Updates since any light changed.
    since: u32,
    /// Updates that the light of lamps counts for.
    frames: u32,
    /// Updates until each virtual point light of the present ones has been looked at.
    unseen: u32,
    /// Updates since the sources changed in which hints traced rays to them.
    source_frames: u32,
    /// Updates in a row in each of which something changed.
    busy: u32,
}

/// What a frame computes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    /// Whether light changes, and not only its unit.
    pub relights: bool,
    /// Cells by which hints have moved, if light moves along with them.
    pub shift: Option<IVec3>,
    /// Whether light of before may bounce once more.
    pub endless: bool,
    /// Whether rays are traced to emissive surfaces and to the sky.
    pub looks: bool,
    /// Whether the surfaces around hints are others than before.
    pub new_surfaces: bool,
    /// Whether hints that hardly change or light nothing have their turn in every fourth frame only.
    pub sleeps: bool,
    /// Counts updates.
    pub frame: u32,
    /// Virtual point lights, or other samples, that each hint looks at, and the first of them.
    pub samples: u32,
    pub first_sample: u32,
    /// Weights of this frame in the light of lamps, of sources, and of bounces.
    pub blend_lights: f32,
    pub blend_sources: f32,
    pub blend_bounces: f32,
    /// Whether probes are to trace other rays in the next frame.
    pub look_again: bool,
}

impl Progress {
    /// What the next frame computes, so that the hints show `now` in `unit`; `None` where they do. `probes_look` says
    /// whether the probes have traced rays in this frame.
    pub fn step(&mut self, now: Content, unit: f32, probes_look: bool) -> Option<Plan> {
        let settings = &now.settings;
        let before = self.content.as_ref();
        self.busy = match before {
            Some(before) if *before != now => self.busy.saturating_add(1),
            _ => 0,
        };
        let (_, vpls) = now.vpls;
        let (samples, looks) = match settings.sampling {
            HintSampling::VirtualPointLights => {
                let samples = settings.samples.min(vpls);
                (samples, vpls.div_ceil(samples.max(1)))
            }
            _ => (settings.samples, 0),
        };
        // Hints do not rest before they have looked at each virtual point light.
        let settles = settings.settle_frames.max(looks);
        match before.filter(|before| **before != now) {
            // What is known counts on, as much as two looks at everything: where a camera walks past many lamps, maps are
            // resized all the time.
            Some(before) if now.resamples(before) => {
                self.frames = self.frames.min(2 * settles);
                self.since = self.since.min(settles);
                self.unseen = settles;
            }
            // It counts on for a while where only things move, or light would flicker; not where a lamp is switched.
            Some(before) => {
                let lamps = |content: &Content| (content.lighting.lights, content.lighting.sky);
                let switched = lamps(before) != lamps(&now);
                let most = if switched { 1 } else { u32::MAX };
                self.frames = self.frames.min(memory(settings)).min(most);
                self.since = 0;
            }
            None => {}
        }
        let moved = before.and_then(|before| now.sources.moved_from(&before.sources));
        if moved.is_none() {
            self.since = 0;
            self.frames = 0;
            self.frame = 0;
        }
        if before.map(|c| &c.sources) != Some(&now.sources) {
            self.source_frames = 0;
        }
        let relights = self.since < settles || self.unseen > 0;
        if !relights && self.unit == unit {
            return None;
        }
        self.unit = unit;
        let fresh = before.is_none_or(|c| c.sources.history != now.sources.history);
        let sleeps = now.sources.probes.sleeping != 0
            && self.busy > BUSY
            && moved.is_some()
            && settings.bounce == HintBounce::Surfaces;
        // Hints that sleep have their turn in every fourth frame: each time with other virtual point lights.
        let turn = match sleeps {
            true => self.frame + self.frame / 4,
            false => self.frame,
        };
        let mut plan = Plan {
            relights,
            shift: moved.filter(|cells| *cells != IVec3::ZERO),
            endless: settings.endless && !fresh,
            looks: self.source_frames == 0 || probes_look,
            new_surfaces: self.source_frames == 0,
            sleeps,
            frame: self.frame,
            samples,
            first_sample: (turn * samples) % vpls.max(1),
            // The first frames are rough, and soon count for nothing.
            blend_lights: 2.0 / (self.frames + 2) as f32,
            blend_sources: 1.0 / (self.source_frames + 1) as f32,
            blend_bounces: match self.since.checked_sub(BOUNCING_FRAMES) {
                None => 1.0,
                // What was bounced of incomplete light counts less and less.
                Some(averaged) => 2.0 / (averaged + 2) as f32,
            },
            look_again: false,
        };
        if relights {
            self.content = Some(now);
            self.frame = self.frame.wrapping_add(1) % 4096;
            self.since += 1;
            self.frames += 1;
            self.unseen = self.unseen.saturating_sub(1);
            self.source_frames += u32::from(plan.looks);
            plan.look_again = self.since >= BOUNCING_FRAMES;
        }
        Some(plan)
    }
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

#[cfg(test)]
mod tests {
    use bevy::math::{UVec3, Vec3};

    use super::*;

    fn content() -> Content {
        let settings = RadianceHintsSettings::default();
        Content {
            sources: Sources {
                voxels: 1,
                probes: GpuProbes {
                    cell: 1.0,
                    dims: UVec3::splat(8),
                    sleeping: 1,
                    ..Default::default()
                },
                sky: 0,
                settings: settings.clone(),
                history: 0,
            },
            settings,
            lighting: LightingVersion::default(),
            rsm: 1,
            reflected: 1,
            shown: 0b1111,
            share: LightShare::Power,
            vpls: (0, 1024),
            camera: None,
        }
    }

    /// Steps until it rests; the plans of all of them.
    fn settle(progress: &mut Progress, content: &Content) -> Vec<Plan> {
        std::iter::from_fn(|| progress.step(content.clone(), 1.0, false))
            .take(10_000)
            .collect()
    }

    #[test]
    fn every_virtual_point_light_is_looked_at_before_hints_rest() {
        let content = content();
        let plans = settle(&mut Progress::default(), &content);
        let samples = plans[0].samples;
        assert_eq!(samples, content.settings.samples.min(1024));
        let frames = content.settings.settle_frames.max(1024 / samples);
        assert_eq!(plans.len(), frames as usize);
        let mut looked = vec![false; 1024];
        for plan in &plans {
            for sample in plan.first_sample..plan.first_sample + plan.samples {
                looked[sample as usize % 1024] = true;
            }
        }
        assert!(looked.iter().all(|looked| *looked));
        // All of the light at first, then a mean: later frames count for less.
        assert_eq!(plans[0].blend_lights, 1.0);
        assert!(plans.is_sorted_by(|a, b| a.blend_lights > b.blend_lights));
    }

    #[test]
    fn what_changes_decides_what_is_kept() {
        let first = content();
        type Change = fn(&mut Content);
        // What changes; whether sources are looked at anew, the weight of this frame in the light of lamps, and the
        // shift. Two frames of before count on where things move, one where a lamp is switched, none after a reset.
        let cases: [(&str, Change, bool, f32, Option<IVec3>); 7] = [
            ("a lamp", |c| c.lighting.lights += 1, false, 2.0 / 3.0, None),
            (
                "what a lamp lights",
                |c| (c.rsm, c.reflected, c.lighting.shadows) = (2, 2, 2),
                false,
                0.5,
                None,
            ),
            // All 32 frames before.
            (
                "maps of another size",
                |c| (c.rsm, c.lighting.shadows) = (2, 2),
                false,
                2.0 / 34.0,
                None,
            ),
            ("a mesh", |c| c.sources.voxels += 1, true, 0.5, None),
            ("a reset", |c| c.sources.history += 1, true, 1.0, None),
            (
                "a cell",
                |c| c.sources.probes.origin = Vec3::X,
                true,
                0.5,
                Some(IVec3::X),
            ),
            (
                "half a cell",
                |c| c.sources.probes.origin = 0.5 * Vec3::X,
                true,
                1.0,
                None,
            ),
        ];
        for (what, change, sources, weight, shift) in cases {
            let mut progress = Progress::default();
            settle(&mut progress, &first);
            let mut now = first.clone();
            change(&mut now);
            let plan = progress.step(now, 1.0, false).expect(what);
            assert!(plan.relights, "{what}");
            assert_eq!(plan.new_surfaces, sources, "{what}");
            assert_eq!(plan.blend_lights, weight, "{what}");
            assert_eq!(plan.shift, shift, "{what}");
            // Only a reset forbids that light of before bounces on.
            assert_eq!(plan.endless, what != "a reset", "{what}");
        }
    }

    #[test]
    fn virtual_point_lights_of_resized_maps_are_all_looked_at() {
        let mut now = content();
        now.vpls = (0, 8192);
        let mut progress = Progress::default();
        let frames = settle(&mut progress, &now).len();
        now.rsm += 1;
        let plans = settle(&mut progress, &now);
        assert_eq!(plans.len(), frames);
        // Bounces go on being averaged.
        assert!(plans.iter().all(|plan| plan.blend_bounces < 0.1));
    }

    #[test]
    fn hints_sleep_only_while_light_changes_all_the_time() {
        let mut progress = Progress::default();
        let mut now = content();
        settle(&mut progress, &now);
        for frame in 1..12 {
            now.rsm += 1;
            let plan = progress.step(now.clone(), 1.0, false).unwrap();
            assert_eq!(plan.sleeps, frame > BUSY, "frame {frame}");
        }
        let plan = progress.step(now.clone(), 1.0, false).unwrap();
        assert!(!plan.sleeps, "it has stopped changing");
    }

    #[test]
    fn another_unit_costs_one_frame_and_changes_no_light() {
        let content = content();
        let mut progress = Progress::default();
        settle(&mut progress, &content);
        let plan = progress.step(content.clone(), 2.0, false).unwrap();
        assert!(!plan.relights && !plan.look_again);
        assert_eq!(progress.step(content, 2.0, false), None);
    }

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
