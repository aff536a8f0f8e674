//! What one frame's update of hints runs.

use bevy::{
    math::UVec3,
    render::render_resource::{BindGroup, Buffer},
};

use super::pipelines::HintsPipelines;
use crate::{
    gpu::{
        compute::{Dispatch, Recorder},
        statistics::Tracked,
    },
    scene::{probes::SceneProbes, voxels::argument},
    technique::Inputs,
};

/// The passes of a frame, each with its group 0.
pub(super) struct HintsJob {
    /// Whether light changes, and not only the unit of the sum.
    pub relights: bool,
    pub carry: Option<CarryJob>,
    /// Where light bounces from hint to hint: after a capture.
    pub albedo: Option<BindGroup>,
    /// Without lamps, their slot is emptied instead.
    pub lights: Option<BindGroup>,
    /// The slot of the lamps, and its bytes.
    pub clear: (Tracked<Buffer>, u64),
    /// Emission and sky, where the probes have traced other rays.
    pub sources: Vec<BindGroup>,
    pub bounces: Vec<BounceJob>,
    /// What is looked up.
    pub sum: BindGroup,
}

/// Light that moves along with the hints.
pub(super) struct CarryJob {
    /// From where to where the slots are copied first.
    pub copy: (Tracked<Buffer>, Tracked<Buffer>),
    pub group: BindGroup,
}

/// One bounce.
pub(super) struct BounceJob {
    /// Sums up the light that bounces.
    pub sum: BindGroup,
    pub from: BounceFrom,
}

/// Where light bounces.
pub(super) enum BounceFrom {
    /// At other hints.
    Hints(BindGroup),
    /// At surfaces: they are lit, and then looked at.
    Surfaces {
        light: BindGroup,
        collect: BindGroup,
    },
}

impl HintsJob {
    /// Records them. `cache` is group 2 of what looks the hints up.
    pub fn record(
        &self,
        pipelines: &HintsPipelines,
        probes: &SceneProbes,
        inputs: &Inputs,
        cache: &BindGroup,
        record: &mut Recorder,
    ) {
        let scene = inputs.scene;
        let per_hint = Dispatch::Threads(UVec3::new(probes.lattice.count(), 1, 1));
        let per_cell = Dispatch::Threads(probes.dims());

        if !self.relights {
            record.run(&pipelines.sum, per_cell, &[&self.sum]);
            return;
        }
        if let Some(carry) = &self.carry {
            let (slots, before) = &carry.copy;
            let encoder = &mut record.encoder;
            encoder.copy_buffer_to_buffer(slots, 0, before, 0, slots.size());
            record.run(&pipelines.carry, per_hint, &[&carry.group]);
        }
        if let Some(albedo) = &self.albedo {
            record.run(&pipelines.albedo, per_hint, &[albedo, scene, cache]);
        }
        match (&self.lights, &inputs.light_maps.rsm_bind_group) {
            (Some(lights), Some(rsm)) => {
                record.run(&pipelines.lights, per_hint, &[lights, scene, cache, rsm]);
            }
            _ => {
                let (slots, bytes) = &self.clear;
                record.encoder.clear_buffer(slots, 0, Some(*bytes));
            }
        }
        let sources = self.sources.iter();
        let sources = sources.map(|group| (per_hint, [group, scene, cache]));
        if !self.sources.is_empty() {
            record.run_all(&pipelines.bounce, None, sources);
        }
        for bounce in &self.bounces {
            record.run(&pipelines.sum, per_cell, &[&bounce.sum]);
            match (&bounce.from, inputs.voxels) {
                (BounceFrom::Hints(exchange), _) => {
                    record.run(&pipelines.exchange, per_hint, &[exchange, scene, cache]);
                }
                (BounceFrom::Surfaces { light, collect }, Some(voxels)) => {
                    let per_voxel =
                        Dispatch::Indirect(&voxels.arguments, 4 * u64::from(argument::VOXELS));
                    record.run(&pipelines.surfaces, per_voxel, &[light, scene, cache]);
                    record.run(&pipelines.bounce, per_hint, &[collect, scene, cache]);
                }
                // No surface, no bounce.
                (BounceFrom::Surfaces { .. }, None) => {}
            }
        }
        record.run(&pipelines.sum, per_cell, &[&self.sum]);
    }
}
