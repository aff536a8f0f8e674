//! When the light of a cache is computed anew: the decision alone, without a GPU.

use std::ops::Range;

use super::settings::VoxelConeTracingSettings;
use crate::scene::{bind_group::LightingVersion, voxels::SLICES};

/// Everything whose change makes the cache wrong.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Content {
    /// Version of the voxels.
    pub voxels: u64,
    pub lighting: LightingVersion,
    pub settings: VoxelConeTracingSettings,
    /// Number of resets of the history.
    pub history: u32,
}

/// How far the light of a cache has settled.
#[derive(Default)]
pub(super) struct Progress {
    /// What the cache shows; `None` at first.
    content: Option<Content>,
    /// Frames of bouncing that are left until the light has settled.
    frames_left: u32,
    /// Counts frames of bouncing.
    frame: u32,
}

/// What a frame computes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Plan {
    /// Whether light changes, and not only its unit.
    pub relights: bool,
    /// Whether the voxels are others than before.
    pub captured: bool,
    /// Whether bounced light of before counts on, if the voxels are where they were.
    pub keeps: bool,
    /// Bounced light is forgotten.
    pub forgets: bool,
    /// Slices of the voxels from which cones are traced.
    pub slices: Range<u32>,
}

impl Progress {
    /// Whether the cache shows anything yet.
    pub fn has_content(&self) -> bool {
        self.content.is_some()
    }

    /// What the next frame computes, so that the cache shows `now`; `None` where it does. Of a cache that is `rescaled`, the
    /// cells are in another unit than before.
    pub fn step(&mut self, now: Content, rescaled: bool) -> Option<Plan> {
        let settings = &now.settings;
        let slices_per_frame = SLICES.div_ceil(settings.bounce_interval);
        let frames_per_bounce = SLICES.div_ceil(slices_per_frame);
        let before = self.content.as_ref();
        let captured = before.map(|c| c.voxels) != Some(now.voxels);
        let reset = before.map(|c| c.history) != Some(now.history);
        let keeps = before.is_some() && !reset;
        if before != Some(&now) {
            self.frames_left = settings.bounces * frames_per_bounce + 1;
        }
        if reset {
            self.frame = 0;
        }
        let relights = self.frames_left > 0;
        if !relights && !rescaled {
            return None;
        }
        // The radiance that a reset leaves behind is not looked up: it is of the time before. Nor is that in
        // another unit; bounces wait for a frame.
        let bounces = settings.bounces > 0 && !reset && !rescaled && relights;
        if relights && !rescaled {
            self.frames_left -= 1;
        }
        let mut slices = 0..0;
        if bounces {
            let first = (self.frame % frames_per_bounce) * slices_per_frame;
            slices = first..(first + slices_per_frame).min(SLICES);
            self.frame = self.frame.wrapping_add(1);
        }
        self.content = Some(now);
        Some(Plan {
            relights,
            captured,
            keeps,
            forgets: reset && !captured,
            slices,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn content(voxels: u64, lights: u64, history: u32) -> Content {
        Content {
            voxels,
            lighting: LightingVersion {
                lights,
                ..Default::default()
            },
            settings: VoxelConeTracingSettings::default(),
            history,
        }
    }

    /// Steps until it rests; the slices of each.
    fn settle(progress: &mut Progress, content: &Content) -> Vec<Range<u32>> {
        let steps = std::iter::from_fn(|| progress.step(content.clone(), false));
        steps.map(|plan| plan.slices).take(1000).collect()
    }

    #[test]
    fn each_bounce_reaches_every_slice_once_and_then_it_rests() {
        let content = content(1, 1, 0);
        let mut progress = Progress::default();
        let steps = settle(&mut progress, &content);
        let settings = &content.settings;
        // The first frame has nothing yet from which light could bounce.
        assert_eq!(steps[0], 0..0);
        let mut times = [0; SLICES as usize];
        for slice in steps.iter().cloned().flatten() {
            times[slice as usize] += 1;
        }
        assert_eq!(times, [settings.bounces; SLICES as usize]);
        assert!(progress.step(content, false).is_none());
    }

    #[test]
    fn what_changes_decides_what_is_kept() {
        let first = content(1, 1, 0);
        // What changes, and whether that is captured, kept, forgotten.
        let cases = [
            ("a lamp", content(1, 2, 0), [false, true, false]),
            ("a mesh", content(2, 1, 0), [true, true, false]),
            ("a reset", content(1, 1, 1), [false, false, true]),
            ("a reset and a mesh", content(2, 1, 1), [true, false, false]),
        ];
        for (what, now, expected) in cases {
            let mut progress = Progress::default();
            let plan = progress.step(first.clone(), false).unwrap();
            assert_eq!([plan.captured, plan.keeps], [true, false]);
            settle(&mut progress, &first);
            let plan = progress.step(now, false).expect(what);
            assert!(plan.relights, "{what}");
            assert_eq!(
                [plan.captured, plan.keeps, plan.forgets],
                expected,
                "{what}"
            );
        }
    }

    #[test]
    fn a_lamp_that_never_rests_still_bounces_everywhere() {
        let mut progress = Progress::default();
        let mut times = [0; SLICES as usize];
        for frame in 0..1000 {
            let plan = progress.step(content(1, frame, 0), false).unwrap();
            for slice in plan.slices {
                times[slice as usize] += 1;
            }
        }
        let (least, most) = (times.iter().min().unwrap(), times.iter().max().unwrap());
        assert!(*least > 0 && most - least <= 1, "{times:?}");
    }

    #[test]
    fn another_unit_costs_one_frame_without_bounces() {
        let content = content(1, 1, 0);
        let mut progress = Progress::default();
        settle(&mut progress, &content);
        let plan = progress.step(content.clone(), true).unwrap();
        assert!(!plan.relights && plan.slices.is_empty() && !plan.captured);
        assert!(progress.step(content.clone(), false).is_none());
        // In the middle of bounces, none is lost.
        let mut progress = Progress::default();
        progress.step(content.clone(), false);
        let plan = progress.step(content.clone(), true).unwrap();
        assert!(plan.relights && plan.slices.is_empty());
        let left = settle(&mut progress, &content);
        let bounced: usize = left.into_iter().map(|slices| slices.len()).sum();
        assert_eq!(bounced, (content.settings.bounces * SLICES) as usize);
    }
}
