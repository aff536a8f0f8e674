//! Voxel cone tracing.
//!
//! Sources: S. Freed, *Real-time global illumination with voxel cone tracing* (MSc thesis, Cal Poly, 2018), for
//! the frame; C. Crassin et al., *Interactive indirect illumination using voxel cone tracing* (2011), for
//! anisotropic cells.
//!
//! # Idea
//!
//! The [voxels](crate::scene::voxels) of all surfaces are lit, and filtered into coarser and coarser cells of
//! radiance and opacity. A single cone then represents a bundle of light paths: it marches away from a surface
//! and reads, at each step, the level whose cells are as wide as the cone.
//!
//! # Passes of a frame
//!
//! | pass | runs | does |
//! |---|---|---|
//! | `gi/vct/carry` | after a capture | finds each voxel's bounced light in the previous capture |
//! | `gi/vct/bounce` | while things change | traces diffuse cones from a part of the voxels, through the radiance of the last frame: second and later bounces, and the sky |
//! | `gi/vct/light` | while things change | radiance = emission + albedo / pi x (direct + bounced irradiance) |
//! | `gi/vct/filter_voxels`, `gi/vct/filter_cells` | while things change | builds the cells |
//! | `gi/vct/export` | while things change | traces diffuse cones from each probe, for forward-rendered objects |
//! | `gi/vct/gather` | per camera | traces diffuse and specular cones for each gathered pixel |
//!
//! In a still scene only the gather runs.
//!
//! # Memory
//!
//! The cache is one `Rgba16Float` 3D texture with premultiplied radiance and opacity of cells of 2 voxels. It
//! holds the six directions of travel, stacked along z, and `levels` mip levels. With 128 voxels along each
//! side it has 64 x 64 x 384 texels, 14 MiB. Opacity of surfaces that are met from behind is read from the
//! scene's [opacity](crate::scene::opacity).
//!
//! # Limits
//!
//! Objects thinner than a cell appear thicker to a cone, increasingly with distance. Mirrors show cells. Two
//! surfaces less than two voxels apart can exchange light through each other's gaps.

mod cache;
mod debug;
mod passes;
mod pipelines;
mod plan;
mod settings;
mod types;

pub use cache::VctCache;
pub use pipelines::VctPipelines;
pub use settings::{ConeLayout, VoxelConeTracing, VoxelConeTracingSettings};

use bevy::{
    app::App,
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    shader::load_shader_library,
};

use super::{LookupShader, NoCache, NoDebug, Technique, TechniqueView};
use crate::{
    debug::DebugPlugin,
    gpu::{caps::DeviceNeeds, layout::GroupLayout},
    scene::{needs::SceneNeeds, volume::MAX_RESOLUTION},
};

impl Technique for VoxelConeTracing {
    const NAME: &'static str = "vct";
    const TITLE: &'static str = "Voxel cone tracing";
    const DEVICE: DeviceNeeds = DeviceNeeds {
        storage_buffers: 8,
        storage_textures: 2,
        texture_3d: MAX_RESOLUTION / 2 * types::DIRECTIONS,
    };
    const VIEWS: &'static [TechniqueView] = &debug::VIEWS;
    type Settings = VoxelConeTracingSettings;
    type Debug = NoDebug;
    type Pipelines = VctPipelines;
    type Cache = VctCache;
    type ViewCache = NoCache;

    fn build(app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "bindings.wgsl");
        load_shader_library!(app, "lookup.wgsl");
        embedded_asset!(app, "light.wgsl");
        embedded_asset!(app, "filter.wgsl");
        embedded_asset!(app, "gather.wgsl");
        embedded_asset!(app, "export.wgsl");
        if app.is_plugin_added::<DebugPlugin>() {
            app.add_plugins(debug::CellsViewPlugin);
        }
    }

    fn needs(_: &VoxelConeTracingSettings) -> SceneNeeds {
        SceneNeeds {
            voxels: true,
            opacity: true,
            shadows: true,
            ..Default::default()
        }
    }

    fn cache_layout() -> GroupLayout {
        pipelines::cache_layout()
    }

    fn gather(server: &AssetServer) -> LookupShader {
        let shader = load_embedded_asset!(server, "gather.wgsl");
        LookupShader::new(shader, "gather_vct", pipelines::shader_defs())
    }

    fn export(server: &AssetServer) -> Option<LookupShader> {
        let shader = load_embedded_asset!(server, "export.wgsl");
        let shader = LookupShader::new(shader, "export_vct", pipelines::shader_defs());
        Some(shader)
    }
}
