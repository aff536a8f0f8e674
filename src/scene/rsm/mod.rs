//! `SceneRsm`: reflective shadow maps (Dachsbacher and Stamminger 2005), what each light lights first.
//!
//! A G-buffer of the scene as each light sees it: Bevy's deferred prepass drawn from the light, with the
//! real materials (textures, alpha masks, skins). Each texel is a patch of surface that has caught a
//! known part of the light, and sends it on.
//!
//! # Maps
//!
//! A tile of a texture array's page a map: a directional light has one for each volume, orthographic; a
//! spot one perspective; a point or rect light the six faces of a cube. Which maps there are, how large they are and
//! when they are drawn is in `light_maps`. A light that merely changes its colour or strength costs
//! nothing: texels hold the light that they pass on per unit of the light's.
//!
//! Where maps of a directional light overlap, since volumes do, light is counted in that of the finest volume. Surfaces far
//! outside of the volume cast, but do not bounce.
//!
//! # Texel
//!
//! `Rgba32Uint`:
//!
//! | word | content |
//! |---|---|
//! | 0 | albedo times the part of the light that arrives, over `flux_scale`, `rgb9e5` |
//! | 1 | normal, octahedral 2 x 12 bit; 1 in the top byte where there is a surface |
//! | 2 | depth, as the map's matrix has it, `f32` |
//! | 3 | albedo, `rgba8unorm` |
//!
//! The flux that a texel reflects is `albedo * Phi_T` (Papaioannou 2011, section 4): for a directional
//! light `Phi_T = E A / M`, its illuminance times the area of a texel across the light; for the others
//! `Phi_T = I(w) dw`, the intensity times the texel's solid angle. No cosine at the surface: the texel's
//! area has it already (the paper counts it twice).
//!
//! # Sampling
//!
//! The luminous flux of all texels is summed up into a mip chain, down to one texel a map. From its top,
//! each virtual point light finds a texel with a probability in proportion to its flux (hierarchical
//! sample warping, Clarberg et al. 2005): all of them carry the same luminous flux, dark and unlit
//! texels get none. Each volume has virtual point lights of its own: light that is caught `d` metres away is chosen with
//! a weight of `1 / (1 + (d / r)^2)`, where `r` is half of the volume's longest side, and carries so much more. With [`LightShare::Even`](crate::LightShare::Even), each light gets the same number first.

mod cache;
mod extract;
mod passes;
mod pipelines;
mod types;

pub use cache::SceneRsm;
pub(crate) use pipelines::{rsm_layout, shader_defs};

use bevy::{
    app::{App, Plugin},
    asset::embedded_asset,
    ecs::prelude::*,
    pbr::DrawPrepass,
    render::{ExtractSchedule, Render, RenderApp, RenderStartup, renderer::RenderGraph},
    shader::load_shader_library,
};

use super::{
    capture::{CaptureKindPlugin, preprocess_captures},
    lights::extract_lights,
};
use crate::{
    gpu::caps::supported,
    schedule::{GiPrepare, GiSystems},
};

pub(crate) struct RsmPlugin;

impl Plugin for RsmPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "lookup.wgsl");
        embedded_asset!(app, "resolve.wgsl");
        embedded_asset!(app, "sum.wgsl");
        embedded_asset!(app, "vpls.wgsl");
        app.add_plugins(CaptureKindPlugin::<pipelines::RsmCapture, DrawPrepass>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SceneRsm>()
            .add_systems(RenderStartup, pipelines::init_rsm.run_if(supported))
            .add_systems(
                ExtractSchedule,
                extract::extract_rsm_views
                    .after(extract_lights)
                    .after(super::needs::NeedsKnown),
            )
            .add_systems(
                Render,
                (
                    cache::prepare_maps.in_set(GiPrepare::ReflectiveMaps),
                    cache::prepare_bind_groups.in_set(GiPrepare::Bindings),
                )
                    .run_if(supported),
            )
            .add_systems(
                RenderGraph,
                passes::draw_rsm
                    .in_set(GiSystems::CaptureScene)
                    .after(preprocess_captures),
            );
    }
}
