//! Radiance hints.
//!
//! Source: G. Papaioannou, *Real-time diffuse global illumination using radiance hints* (High
//! Performance Graphics 2011).
//!
//! # Idea
//!
//! Diffuse indirect light varies slowly in space: a coarse lattice of points, the *hints*, is enough to
//! hold it. Each keeps the radiance that arrives at it as spherical harmonics, and a surface is lit by the
//! hints around it. The first bounce comes from reflective shadow maps; further ones from what the hints
//! have of the bounce before.
//!
//! Where the paper guesses what stands in between, here it is known: hints are the
//! [probes](crate::scene::probes) of the volume, and rays through the voxels decide what a hint sees of a
//! virtual point light, and which surface lies in each direction. A surface reflects with its own colour.
//!
//! # A frame
//!
//! | pass | runs | does |
//! |---|---|---|
//! | `gi/hints/carry` | where the volume has moved | hints that stay where they are keep their light |
//! | `gi/hints/albedo` | after a capture, for the next but one | mean albedo of the surfaces around each hint |
//! | `gi/hints/lights` | while things change | light of lamps after their first bounce, from virtual point lights |
//! | `gi/hints/bounce` | while things change | light of emissive surfaces and of the sky; what surfaces reflect |
//! | `gi/hints/exchange` | while things change | in place of both: light from places around each hint, as in the paper |
//! | `gi/hints/surfaces` | while things change | radiance of each voxel = albedo x (E / pi) of the hints around it |
//! | `gi/hints/sum` | while things change | all of it into the texture that is looked up |
//! | `gi/hints/export` | while things change | looks the hints up for what is drawn forward |
//! | `gi/hints/gather` | per camera | looks the hints up for each gathered pixel |
//!
//! In a still scene only the gather runs.
//!
//! After a change, a hint looks at a few virtual point lights and has one ray in each of some directions. Over the
//! frames that follow it looks at the others, and along other rays, and takes the mean: its light is
//! complete at once, and exact soon. Then it rests.
//!
//! # Memory
//!
//! 24 x 24 x 24 hints: 27 coefficients as `Rgba16Float`, 0.8 MB, and in full precision for each of four slots,
//! 8 MB; 64 rays, 7 MB; depths, 11 MB.
//!
//! # Limits
//!
//! What is smaller than a cell of the lattice casts no shadow of indirect light. Reflections are as soft as
//! three bands of spherical harmonics.

mod cache;
mod debug;
mod passes;
mod pipelines;
mod plan;
mod settings;
mod types;

pub use cache::HintsCache;
pub use pipelines::HintsPipelines;
pub use settings::{
    HintBounce, HintOcclusion, HintReconstruction, HintSampling, RadianceHints,
    RadianceHintsSettings, ShOrder,
};

use bevy::{
    app::App,
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    render::render_resource::BindGroupLayoutDescriptor,
    shader::load_shader_library,
};

use super::{LookupShader, Technique};
use crate::{
    gpu::caps::DeviceNeeds,
    scene::{needs::SceneNeeds, probes::MAX_PROBES},
};

impl Technique for RadianceHints {
    const NAME: &'static str = "hints";
    const TITLE: &'static str = "Radiance hints";
    const DEVICE: DeviceNeeds = DeviceNeeds {
        storage_buffers: 8,
        storage_textures: 2,
        texture_3d: MAX_PROBES * types::blocks(ShOrder::Three),
    };
    type Settings = RadianceHintsSettings;
    type Pipelines = HintsPipelines;
    type Cache = HintsCache;

    fn build(app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "bindings.wgsl");
        load_shader_library!(app, "guess.wgsl");
        load_shader_library!(app, "lookup.wgsl");
        load_shader_library!(app, "slots.wgsl");
        load_shader_library!(app, "accumulate.wgsl");
        load_shader_library!(app, "disk.wgsl");
        embedded_asset!(app, "albedo.wgsl");
        embedded_asset!(app, "carry.wgsl");
        embedded_asset!(app, "lights.wgsl");
        embedded_asset!(app, "bounce.wgsl");
        embedded_asset!(app, "exchange.wgsl");
        embedded_asset!(app, "sum.wgsl");
        embedded_asset!(app, "gather.wgsl");
        embedded_asset!(app, "export.wgsl");
        app.add_plugins(debug::HintsViewPlugin);
    }

    fn needs(settings: &RadianceHintsSettings) -> SceneNeeds {
        SceneNeeds {
            voxels: true,
            rsm: true,
            probes: true,
            // The light of all slots.
            probe_bytes: 16 * settings.order.coefficients() * cache::slot_count(settings),
            camera_depth: settings.occlusion == HintOcclusion::CameraDepth,
            ..Default::default()
        }
    }

    fn cache_layout() -> BindGroupLayoutDescriptor {
        pipelines::cache_layout()
    }

    fn gather(server: &AssetServer) -> LookupShader {
        let shader = load_embedded_asset!(server, "gather.wgsl");
        LookupShader::new(shader, "gather_hints", pipelines::shader_defs())
    }

    fn export(server: &AssetServer) -> LookupShader {
        let shader = load_embedded_asset!(server, "export.wgsl");
        LookupShader::new(shader, "export_hints", pipelines::shader_defs())
    }
}
