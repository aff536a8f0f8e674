//! Compute passes in one line each.

use bevy::{
    asset::Handle,
    math::UVec3,
    render::{
        diagnostic::{DiagnosticsRecorder, RecordDiagnostics},
        render_resource::{
            BindGroup, BindGroupLayoutDescriptor, Buffer, CachedComputePipelineId, CommandEncoder,
            ComputePassDescriptor, ComputePipelineDescriptor, PipelineCache,
        },
    },
    shader::{Shader, ShaderDefVal},
};

/// The name of a technique's pass, `gi/TECHNIQUE/PASS`, for as long as the app runs: called once for each pass.
pub(crate) fn pass_name(technique: &str, pass: &str) -> &'static str {
    format!("gi/{technique}/{pass}").leak()
}

/// A compute pass: its one name is label, debug group and diagnostics path.
#[derive(Clone, Copy, Debug)]
pub struct ComputePass {
    /// `gi/` and the part of the crate that it belongs to, and what it does.
    pub name: &'static str,
    /// Its pipeline, once that is compiled.
    pub pipeline: CachedComputePipelineId,
}

impl ComputePass {
    /// Queues the pipeline of the entry point `entry` of `shader`.
    pub fn new(
        cache: &PipelineCache,
        name: &'static str,
        layout: &[&BindGroupLayoutDescriptor],
        shader: Handle<Shader>,
        entry: &'static str,
        shader_defs: Vec<ShaderDefVal>,
    ) -> Self {
        Self {
            name,
            pipeline: cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some(name.into()),
                layout: layout.iter().map(|l| (*l).clone()).collect(),
                shader,
                shader_defs,
                entry_point: Some(entry.into()),
                ..Default::default()
            }),
        }
    }

    /// Whether the pipeline is compiled.
    pub fn ready(&self, cache: &PipelineCache) -> bool {
        cache.get_compute_pipeline(self.pipeline).is_some()
    }
}

/// How many workgroups run.
pub enum Groups<'a> {
    /// Fixed numbers.
    Direct(UVec3),
    /// Three `u32` at a byte offset of a buffer.
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
    pub fn run(&mut self, pass: &ComputePass, groups: Groups, bind_groups: &[&BindGroup]) {
        self.run_all(pass, None, [(groups, bind_groups)]);
    }

    /// Runs a pass several times, timed as one. `offset` is the dynamic offset of group 0, where it
    /// has one: the camera's, in passes per camera.
    pub fn run_all<'b, B: AsRef<[&'b BindGroup]>>(
        &mut self,
        pass: &ComputePass,
        offset: Option<u32>,
        runs: impl IntoIterator<Item = (Groups<'b>, B)>,
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
        for (groups, bind_groups) in runs {
            for (i, group) in bind_groups.as_ref().iter().enumerate() {
                let offset = if i == 0 { offset.as_slice() } else { &[] };
                compute.set_bind_group(i as u32, Some(&***group), offset);
            }
            match groups {
                Groups::Direct(n) => compute.dispatch_workgroups(n.x, n.y, n.z),
                Groups::Indirect(buffer, offset) => {
                    compute.dispatch_workgroups_indirect(buffer, offset);
                }
            }
        }
        span.end(&mut compute);
    }
}

/// Workgroups of `size` threads that cover `threads`.
pub fn groups(threads: UVec3, size: UVec3) -> Groups<'static> {
    Groups::Direct((threads + size - 1) / size)
}
