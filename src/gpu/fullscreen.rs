//! Passes over the whole picture of a camera, for debug views.

use bevy::{
    asset::Handle,
    core_pipeline::FullscreenShader,
    render::render_resource::*,
    shader::{Shader, ShaderDefVal},
};

/// A pass that replaces a picture. One pipeline for each format of the target.
#[derive(Clone)]
pub(crate) struct FullscreenPass {
    pub layout: Vec<BindGroupLayoutDescriptor>,
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
            layout: self.layout.clone(),
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
