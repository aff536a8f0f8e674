//! Voxel cone tracing.
//!
//! Sources: S. Freed, *Real-time global illumination with voxel cone tracing* (MSc thesis, Cal
//! Poly, 2018), for the frame; C. Crassin et al., *Interactive indirect illumination using voxel
//! cone tracing* (2011), for cells that look different from each side.
//!
//! # Idea
//!
//! The [voxels](crate::scene::voxels) of all surfaces are lit, and filtered into ever coarser cells
//! of radiance and opacity. A bundle of light paths is then a single cone: it marches away from a
//! surface and reads, at each step, the level whose cells are as wide as the cone.
//!
//! # A frame
//!
//! | pass | runs | does |
//! |---|---|---|
//! | `gi/vct/carry` | after a capture | finds each voxel's bounced light in the previous capture |
//! | `gi/vct/bounce` | while things change | traces diffuse cones from a part of the voxels, through the radiance of the last frame: second and later bounces, and the sky |
//! | `gi/vct/light` | while things change | radiance = emission + albedo / pi x (direct + bounced irradiance) |
//! | `gi/vct/filter_voxels`, `gi/vct/filter_cells` | while things change | builds the cells |
//! | `gi/vct/export` | while things change | diffuse cones of each probe, for what is drawn forward |
//! | `gi/vct/gather` | per camera | diffuse and specular cones of each gathered pixel |
//!
//! In a still scene only the gather runs.
//!
//! # Memory
//!
//! The cache is one `Rgba16Float` 3D texture: premultiplied radiance and opacity of cells of 2
//! voxels, for the six directions of travel, stacked along z; `levels` mip levels. 128 voxels along
//! each side: 64 x 64 x 384 texels, 14 MiB.
//!
//! # Limits
//!
//! Things thinner than a cell look fatter to a cone, the more so the further away they are; mirrors
//! show cells. Two surfaces nearer to each other than two voxels can exchange light through each
//! other's gaps.

mod debug;
mod node;
mod prepare;
mod settings;
mod types;

pub use prepare::VctCache;
pub use settings::{ConeLayout, VoxelConeTracingSettings};

use bevy::{
    app::{App, Plugin},
    asset::{AssetServer, Handle, embedded_asset, load_embedded_asset},
    ecs::prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        render_resource::BindGroupLayoutDescriptor, renderer::RenderGraph,
    },
    shader::{Shader, ShaderDefVal, load_shader_library},
};

use super::{Technique, possible};
use crate::{
    gpu::caps::DeviceNeeds,
    scene::{bind_group::init_scene_layout, needs::SceneNeeds, volume::MAX_RESOLUTION},
    schedule::GiSystems,
    settings::{GiTechnique, SettingsResourcePlugin},
};

/// Voxel cone tracing, as a [`Technique`].
pub(crate) struct VoxelConeTracing;

impl Technique for VoxelConeTracing {
    const TECHNIQUE: GiTechnique = GiTechnique::VoxelConeTracing;
    const GATHER: &'static str = "gi/vct/gather";
    const GATHER_ENTRY: &'static str = "gather_vct";
    const EXPORT: &'static str = "gi/vct/export";
    const EXPORT_ENTRY: &'static str = "export_vct";
    const NEEDS: SceneNeeds = SceneNeeds {
        voxels: true,
        shadows: true,
        rsm: false,
        probes: false,
        probe_bytes: 0,
    };
    const DEVICE: DeviceNeeds = DeviceNeeds {
        storage_buffers: 8,
        storage_textures: 2,
        texture_3d: MAX_RESOLUTION / 2 * types::DIRECTIONS,
    };
    type Cache = VctCache;

    fn cache_layout() -> BindGroupLayoutDescriptor {
        node::cache_layout()
    }

    fn gather_shader(server: &AssetServer) -> (Handle<Shader>, Vec<ShaderDefVal>) {
        (
            load_embedded_asset!(server, "gather.wgsl"),
            node::shader_defs(),
        )
    }

    fn export_shader(server: &AssetServer) -> (Handle<Shader>, Vec<ShaderDefVal>) {
        (
            load_embedded_asset!(server, "export.wgsl"),
            node::shader_defs(),
        )
    }
}

pub(crate) struct VoxelConeTracingPlugin;

impl Plugin for VoxelConeTracingPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "bindings.wgsl");
        load_shader_library!(app, "lookup.wgsl");
        embedded_asset!(app, "light.wgsl");
        embedded_asset!(app, "filter.wgsl");
        embedded_asset!(app, "gather.wgsl");
        embedded_asset!(app, "export.wgsl");
        app.add_plugins((
            SettingsResourcePlugin::<VoxelConeTracingSettings>::default(),
            debug::CellsViewPlugin,
        ));
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(
                RenderStartup,
                node::init_vct_pipelines
                    .after(init_scene_layout)
                    .run_if(possible::<VoxelConeTracing>),
            )
            .add_systems(
                Render,
                prepare::prepare_vct
                    .in_set(RenderSystems::PrepareBindGroups)
                    .run_if(possible::<VoxelConeTracing>),
            )
            .add_systems(
                RenderGraph,
                node::update_vct.in_set(GiSystems::UpdateCaches),
            );
    }
}
