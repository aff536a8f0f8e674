//! What a camera sees: group 0 of every per-camera pass.
//!
//! Bevy's G-buffer, depth and motion vectors, with `load_surface` in `surface.wgsl` to unpack them.

pub(crate) mod depth;

use bevy::{
    app::{App, Plugin},
    core_pipeline::prepass::ViewPrepassTextures,
    ecs::prelude::*,
    math::UVec2,
    render::{
        Render, RenderApp,
        camera::ExtractedCamera,
        render_resource::{binding_types::*, *},
        renderer::RenderDevice,
        view::{ViewUniform, ViewUniforms},
    },
    shader::load_shader_library,
};

use crate::{
    camera::ExtractedGiCamera,
    gpu::{
        caps::supported,
        layout::{GroupLayout, dynamic_uniform, loaded},
    },
    schedule::GiPrepare,
    settings::GiTechnique,
};

/// Group 0 of a camera that shows global illumination this frame.
#[derive(Component)]
pub(crate) struct ViewSurface {
    pub bind_group: BindGroup,
    /// Pixels of the viewport.
    pub size: UVec2,
    pub technique: GiTechnique,
}

/// What cameras see: bind group 0 of every pass per camera.
#[derive(Default)]
pub struct SurfacePlugin;

impl Plugin for SurfacePlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "reflectance.wgsl");
        load_shader_library!(app, "surface.wgsl");
        app.add_plugins(depth::CameraDepthPlugin);
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.add_systems(
            Render,
            prepare_surfaces
                .in_set(GiPrepare::Bindings)
                .run_if(supported),
        );
    }
}

/// Layout of group 0 of passes per camera: what the camera sees. Its WGSL module is `bevy_gi::surface`.
pub fn surface_layout() -> GroupLayout {
    GroupLayout::new(
        "gi/surface",
        ShaderStages::COMPUTE | ShaderStages::VERTEX_FRAGMENT,
    )
    .with("view", dynamic_uniform::<ViewUniform>())
    .with("depth_texture", texture_2d(TextureSampleType::Depth))
    .with("deferred_texture", texture_2d(TextureSampleType::Uint))
    .with("motion_texture", texture_2d(loaded()))
}

/// Cameras that showed global illumination and do not any more.
type SwitchedOff = (
    With<ViewSurface>,
    Or<(Without<ExtractedGiCamera>, Without<ExtractedCamera>)>,
);

pub(crate) fn prepare_surfaces(
    mut commands: Commands,
    views: Query<(
        Entity,
        &ExtractedGiCamera,
        &ExtractedCamera,
        Option<&ViewPrepassTextures>,
    )>,
    left: Query<Entity, SwitchedOff>,
    uniforms: Res<ViewUniforms>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
) {
    // What they remember would be old when they are on again.
    for entity in &left {
        commands.entity(entity).remove::<ViewSurface>();
    }
    let Some(uniforms) = uniforms.uniforms.binding() else {
        return;
    };
    let layout = surface_layout();
    for (entity, gi, camera, textures) in &views {
        let technique = gi.technique;
        let prepass = textures.and_then(|t| {
            Some((
                t.depth_view()?,
                t.deferred_view()?,
                t.motion_vectors_view()?,
            ))
        });
        let (Some((depth, deferred, motion)), Some(size)) =
            (prepass, camera.physical_viewport_size)
        else {
            commands.entity(entity).remove::<ViewSurface>();
            continue;
        };
        if technique.is_off() {
            commands.entity(entity).remove::<ViewSurface>();
            continue;
        }
        let bind_group = layout
            .bind(&device, &cache)
            .with("view", uniforms.clone())
            .with("depth_texture", depth)
            .with("deferred_texture", deferred)
            .with("motion_texture", motion)
            .build();
        commands.entity(entity).insert(ViewSurface {
            bind_group,
            size,
            technique,
        });
    }
}
