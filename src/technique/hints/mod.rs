//! Radiance hints.
//!
//! Source: G. Papaioannou, *Real-time diffuse global illumination using radiance hints* (High Performance
//! Graphics 2011).
//!
//! # Idea
//!
//! Diffuse indirect light varies slowly in space, so a coarse lattice of points, the *hints*, is enough to
//! store it. Each hint stores the incident radiance as spherical harmonics, and a surface interpolates the
//! hints around it. The first bounce comes from reflective shadow maps; each further bounce comes from the
//! light that the hints have of the bounce before.
//!
//! The paper estimates visibility. Here it is traced: hints are the [probes](crate::scene::probes) of the
//! volume, and rays through the voxels decide which virtual point lights (VPLs) a hint sees, and which surface
//! lies in each direction. A surface reflects with its own colour.
//!
//! # Passes of a frame
//!
//! | pass | runs | does |
//! |---|---|---|
//! | `gi/hints/carry` | when the volume has moved | keeps the light of hints that stay in the volume |
//! | `gi/hints/albedo` | after a capture, if `gi/hints/exchange` runs | mean albedo of the surfaces around each hint |
//! | `gi/hints/lights` | while things change | light of lamps after one bounce, from VPLs |
//! | `gi/hints/bounce` | while things change | light of emissive surfaces and of the sky; light that surfaces reflect |
//! | `gi/hints/exchange` | while things change | second and later bounces from points around each hint, as in the paper, instead of from surfaces |
//! | `gi/hints/surfaces` | while things change | radiance of each voxel = albedo x (E / pi) of the hints around it |
//! | `gi/hints/sum` | while things change | the sum of all light, into the texture that is looked up |
//! | `gi/hints/export` | while things change | looks the hints up for forward-rendered objects |
//! | `gi/hints/gather` | per camera | looks the hints up for each gathered pixel |
//!
//! In a still scene only the gather runs.
//!
//! After a change, each hint samples a subset of the VPLs and traces one ray in each of a set of directions.
//! The following frames take the other VPLs and other rays, and accumulate the mean. The first frame therefore
//! has all of the light, with an approximation error; after
//! [`settle_frames`](RadianceHintsSettings::settle_frames), updates stop.
//!
//! # Memory
//!
//! For 24 x 24 x 24 hints: 27 coefficients as `Rgba16Float`, 0.8 MB; the same in full precision for each of
//! four slots, 8 MB; 64 rays per hint, 7 MB; depths, 11 MB.
//!
//! # Limits
//!
//! Objects smaller than a cell of the lattice cast no shadow of indirect light. Reflections are as blurred as
//! three bands of spherical harmonics.

mod cache;
mod debug;
mod passes;
mod pipelines;
mod plan;
mod settings;
mod types;
mod view;

pub use cache::HintsCache;
pub use pipelines::HintsPipelines;
pub use settings::{
    HintAlbedo, HintBounce, HintDepthTest, HintDisk, HintExchange, HintOcclusion,
    HintReconstruction, HintSampling, HintTaps, RadianceHints, RadianceHintsSettings, ShOrder,
};

pub use view::{HintView, RadianceHintsDebugSettings};

use bevy::{
    app::App,
    asset::{AssetServer, embedded_asset, load_embedded_asset},
    shader::load_shader_library,
};

use super::{LookupShader, NoCache, Technique};
use crate::{
    debug::DebugPlugin,
    gpu::{caps::DeviceNeeds, layout::GroupLayout},
    scene::{needs::SceneNeeds, volume::probe_set::MAX_PROBES},
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
    type Debug = RadianceHintsDebugSettings;
    type Pipelines = HintsPipelines;
    type Cache = HintsCache;
    type ViewCache = NoCache;

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
        if app.is_plugin_added::<DebugPlugin>() {
            app.add_plugins(debug::HintsViewPlugin);
        }
    }

    fn needs(settings: &RadianceHintsSettings) -> SceneNeeds {
        SceneNeeds {
            voxels: true,
            rsm: true,
            probes: true,
            // The light of all slots.
            probe_bytes: 16 * settings.order.coefficients() * cache::slot_count(settings),
            camera_depth: matches!(settings.occlusion, HintOcclusion::CameraDepth(_)),
            ..Default::default()
        }
    }

    fn cache_layout() -> GroupLayout {
        pipelines::cache_layout()
    }

    fn gather(server: &AssetServer) -> LookupShader {
        let shader = load_embedded_asset!(server, "gather.wgsl");
        LookupShader::new(shader, "gather_hints", pipelines::shader_defs())
    }

    fn export(server: &AssetServer) -> Option<LookupShader> {
        let shader = load_embedded_asset!(server, "export.wgsl");
        let shader = LookupShader::new(shader, "export_hints", pipelines::shader_defs());
        Some(shader)
    }
}
