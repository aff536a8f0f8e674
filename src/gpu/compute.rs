//! Compute passes in one line each.

use bevy::{
    asset::Handle,
    math::UVec3,
    render::{
        diagnostic::{DiagnosticsRecorder, RecordDiagnostics},
        render_resource::{
            BindGroup, Buffer, CachedComputePipelineId, CommandEncoder, ComputePassDescriptor,
            ComputePipelineDescriptor, PipelineCache,
        },
    },
    shader::{Shader, ShaderDefVal},
};

use super::layout::GroupLayout;

/// The name of a technique's pass, `gi/TECHNIQUE/PASS`, for as long as the app runs: called once for each pass.
pub(crate) fn pass_name(technique: &str, pass: &str) -> &'static str {
    format!("gi/{technique}/{pass}").leak()
}

/// Threads of a workgroup for work in one long row.
pub(crate) const LANES: u32 = 64;

/// Workgroups along x of a long row; more go into y. WebGPU guarantees 65535.
pub(crate) const ROW: u32 = 32768;

/// Threads in a workgroup along each axis.
pub mod block {
    use bevy::math::UVec3;

    /// A single thread.
    pub const ONE: UVec3 = UVec3::ONE;
    /// A row.
    pub const LINE: UVec3 = UVec3::new(super::LANES, 1, 1);
    /// A square: pixels or texels.
    pub const TILE: UVec3 = UVec3::new(8, 8, 1);
    /// A cube: cells or probes.
    pub const CUBE: UVec3 = UVec3::splat(4);
}

/// A compute pass: its one name is label, debug group and diagnostics path.
#[derive(Clone, Copy, Debug)]
pub struct ComputePass {
    /// `gi/` and the part of the crate that it belongs to, and what it does.
    pub name: &'static str,
    /// Its pipeline, once that is compiled.
    pub pipeline: CachedComputePipelineId,
    /// Threads in a workgroup, as the shader says.
    pub block: UVec3,
}

impl ComputePass {
    /// Queues the pipeline of the entry point `entry` of `shader`, which has bind groups of these layouts and workgroups of
    /// that [`block`].
    pub fn new(
        cache: &PipelineCache,
        name: &'static str,
        block: UVec3,
        layouts: &[&GroupLayout],
        shader: Handle<Shader>,
        entry: &'static str,
        mut shader_defs: Vec<ShaderDefVal>,
    ) -> Self {
        // Constants of `row.wgsl`.
        let constants = [("LANES", LANES), ("ROW", ROW)];
        let constants = constants.map(|(name, value)| ShaderDefVal::UInt(name.into(), value));
        shader_defs.extend(constants);
        #[cfg(test)]
        super::layout::made::block(name, block);
        Self {
            name,
            pipeline: cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some(name.into()),
                layout: layouts.iter().map(|layout| layout.descriptor()).collect(),
                shader,
                shader_defs,
                entry_point: Some(entry.into()),
                ..Default::default()
            }),
            block,
        }
    }

    /// Whether the pipeline is compiled.
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        cache.get_compute_pipeline(self.pipeline).is_some()
    }
}

/// How much of a pass runs.
#[derive(Clone, Copy)]
pub enum Dispatch<'a> {
    /// At least so many threads along each axis, in whole workgroups.
    Threads(UVec3),
    /// At least so many threads in one row, which is folded where it is too long: `row_index` in `row.wgsl`.
    Row(u32),
    /// So many workgroups.
    Workgroups(UVec3),
    /// Workgroups along each axis: three `u32` at a byte offset of a buffer.
    Indirect(&'a Buffer, u64),
}

/// Records compute passes into one encoder, each timed under its name.
pub struct Recorder<'a> {
    /// What is recorded.
    pub encoder: &'a mut CommandEncoder,
    /// All pipelines of the app.
    pub cache: &'a PipelineCache,
    /// Where times go, if they are measured.
    pub diagnostics: Option<&'a DiagnosticsRecorder>,
}

impl Recorder<'_> {
    /// Runs a pass; does nothing while its pipeline is not compiled.
    pub fn run(&mut self, pass: &ComputePass, dispatch: Dispatch, bind_groups: &[&BindGroup]) {
        self.run_all(pass, None, [(dispatch, bind_groups)]);
    }

    /// Runs a pass several times, timed as one. `offset` is the dynamic offset of group 0, where it
    /// has one: the camera's, in passes per camera.
    pub fn run_all<'b, B: AsRef<[&'b BindGroup]>>(
        &mut self,
        pass: &ComputePass,
        offset: Option<u32>,
        runs: impl IntoIterator<Item = (Dispatch<'b>, B)>,
    ) {
        let Some(pipeline) = self.cache.get_compute_pipeline(pass.pipeline) else {
            return;
        };
        let mut compute = self.encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some(pass.name),
            timestamp_writes: None,
        });
        let span = self.diagnostics.pass_span(&mut compute, pass.name);
        compute.set_pipeline(pipeline);
        for (dispatch, bind_groups) in runs {
            for (i, group) in bind_groups.as_ref().iter().enumerate() {
                let offset = if i == 0 { offset.as_slice() } else { &[] };
                compute.set_bind_group(i as u32, Some(&***group), offset);
            }
            let block = pass.block;
            let groups = match dispatch {
                Dispatch::Threads(threads) => (threads + block - 1) / block,
                Dispatch::Row(threads) => {
                    let groups = threads.div_ceil(block.x);
                    UVec3::new(groups.min(ROW), groups.div_ceil(ROW), 1)
                }
                Dispatch::Workgroups(groups) => groups,
                Dispatch::Indirect(buffer, offset) => {
                    compute.dispatch_workgroups_indirect(buffer, offset);
                    continue;
                }
            };
            compute.dispatch_workgroups(groups.x, groups.y, groups.z);
        }
        span.end(&mut compute);
    }
}
