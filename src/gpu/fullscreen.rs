//! Passes over the picture of a camera.

use bevy::{
    asset::Handle,
    core_pipeline::FullscreenShader,
    render::{
        camera::ExtractedCamera, diagnostic::RecordDiagnostics, render_phase::TrackedRenderPass,
        render_resource::*, renderer::RenderContext,
    },
    shader::{Shader, ShaderDefVal},
};

use super::layout::GroupLayout;

/// A pass that replaces a picture. One pipeline for each format of the target.
#[derive(Clone)]
pub(crate) struct FullscreenPass {
    pub layouts: Vec<GroupLayout>,
    pub fullscreen: FullscreenShader,
    /// Its entry point is `fragment`.
    pub shader: Handle<Shader>,
    pub shader_defs: Vec<ShaderDefVal>,
    /// Format of a depth buffer that the shader writes, where there is one: what is larger is kept.
    pub depth: Option<TextureFormat>,
}

/// Name of the pass, format of the target.
pub(crate) type FullscreenKey = (&'static str, TextureFormat);

impl SpecializedRenderPipeline for FullscreenPass {
    type Key = FullscreenKey;

    fn specialize(&self, (name, format): Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some(name.into()),
            layout: self.layouts.iter().map(GroupLayout::descriptor).collect(),
            vertex: self.fullscreen.to_vertex_state(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: self.shader_defs.clone(),
                entry_point: Some("fragment".into()),
                targets: vec![Some(ColorTargetState {
                    format,
                    blend: None,
                    write_mask: ColorWrites::ALL,
                })],
            }),
            depth_stencil: self.depth.map(|format| DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(CompareFunction::Greater),
                stencil: StencilState::default(),
                bias: DepthBiasState::default(),
            }),
            ..Default::default()
        }
    }
}

/// Records a pass over a camera's viewport, timed under its name.
pub(crate) fn camera_pass<'a>(
    ctx: &'a mut RenderContext,
    name: &'static str,
    camera: &ExtractedCamera,
    color: RenderPassColorAttachment,
    depth: Option<RenderPassDepthStencilAttachment>,
    draw: impl FnOnce(&mut TrackedRenderPass<'a>),
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some(name),
        color_attachments: &[Some(color)],
        depth_stencil_attachment: depth,
        ..Default::default()
    });
    let span = diagnostics.pass_span(&mut pass, name);
    if let Some(viewport) = &camera.viewport {
        pass.set_camera_viewport(viewport);
    }
    draw(&mut pass);
    span.end(&mut pass);
}
