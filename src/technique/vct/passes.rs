//! What one frame's update of a cache runs.

use bevy::{
    math::UVec3,
    render::render_resource::{BindGroup, Buffer},
};

use super::pipelines::VctPipelines;
use crate::{
    gpu::{
        compute::{Dispatch, Recorder},
        statistics::Tracked,
    },
    scene::voxels::{SceneVoxels, argument},
};

/// The passes of a frame, each with its group 0.
pub(super) struct VctJob {
    /// Bounced light that is forgotten first.
    pub clear: Option<Tracked<Buffer>>,
    /// After a capture.
    pub carry: Option<BindGroup>,
    /// Slices to trace.
    pub bounce: Vec<(u32, BindGroup)>,
    pub light: BindGroup,
    /// After a capture.
    pub clear_cells: Option<BindGroup>,
    pub filter_voxels: BindGroup,
    pub filter_cells: Vec<BindGroup>,
    /// Cells of each level.
    pub cells: Vec<UVec3>,
}

impl VctJob {
    /// Records them. `scene` is group 1, `cache` group 2 of what looks the cache up.
    pub fn record(
        &self,
        pipelines: &VctPipelines,
        voxels: &SceneVoxels,
        scene: &BindGroup,
        cache: &BindGroup,
        record: &mut Recorder,
    ) {
        let arguments = |word: u32| Dispatch::Indirect(&voxels.arguments, 4 * u64::from(word));
        if let Some(bounced) = &self.clear {
            record.encoder.clear_buffer(bounced, 0, None);
        }
        if let Some(carry) = &self.carry {
            record.run(&pipelines.carry, arguments(argument::VOXELS), &[carry]);
        }
        let bounce = self.bounce.iter().map(|(slice, group)| {
            let slice = arguments(argument::SLICE + 3 * slice);
            (slice, [group, scene, cache])
        });
        record.run_all(&pipelines.bounce, None, bounce);
        record.run(
            &pipelines.light,
            arguments(argument::VOXELS),
            &[&self.light, scene],
        );
        if let Some(clear) = &self.clear_cells {
            record.run(
                &pipelines.clear_cells,
                Dispatch::Threads(self.cells[0]),
                &[clear],
            );
        }
        record.run(
            &pipelines.filter_voxels,
            arguments(argument::CELLS),
            &[&self.filter_voxels],
        );
        let levels = self.filter_cells.iter().zip(&self.cells[1..]);
        let levels = levels.map(|(group, cells)| (Dispatch::Threads(*cells), [group]));
        record.run_all(&pipelines.filter_cells, None, levels);
    }
}
