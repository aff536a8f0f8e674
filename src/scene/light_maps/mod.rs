//! `SceneLightMaps`: what each light sees, drawn once.
//!
//! A light has a map for each direction or place that it looks at: a directional light one for each volume,
//! orthographic, along the volume's own extent; a spot light one, perspective; a point or rect light the six
//! faces of a cube. Each map is a square tile in the pages of texture arrays, with up to two products:
//!
//! - *depth*, always: shadow maps (Williams 1978). Shadows of the screen's own maps would miss what is not
//!   seen, and belong to one camera.
//! - *surfaces*, where a technique reads them: reflective shadow maps (Dachsbacher and Stamminger 2005). Bevy's
//!   deferred prepass is drawn from the light with the real materials (textures, alpha masks, skins), and each texel
//!   is a patch of surface that has caught a known part of the light, and sends it on.
//!
//! # Which maps are drawn
//!
//! Any number of lights has maps. While they all fit, each tile is as large as the settings say; where they
//! do not, texels are shared by importance: the light that a lamp sends out, over the square of its distance
//! from the nearest GI camera. A tile that stays is never moved, also when other lights come and go. A map is drawn
//! again only when its light or something in its view has changed, the longest waiting first; new ones by
//! importance, so many a frame. Until it is drawn, a map lets no light through. A light that merely changes its
//! colour or strength costs nothing: texels hold the light that they pass on per unit of the light's.
//!
//! Views (`scene::capture`) exist only for maps that are drawn: a map at rest costs nothing.
//!
//! Where depth and surfaces are both read, and depth is finer, a surface is what depth shows in one of the texels
//! that it covers.
//!
//! Where maps of a directional light overlap, since volumes do, light is counted in that of the finest volume. Surfaces
//! far outside of the volume cast, but do not bounce.
//!
//! # Surfaces
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
//! a weight of `1 / (1 + (d / r)^2)`, where `r` is half of the volume's longest side, and carries so much more. With
//! [`LightShare::Even`](crate::LightShare::Even), each light gets the same number first.

mod atlas;
mod cache;
mod choice;
mod extract;
mod passes;
mod pipelines;
mod textures;
mod types;
mod views;

pub use cache::SceneLightMaps;
pub(crate) use cache::prepare_bind_groups;
pub(crate) use pipelines::{rsm_layout, shader_defs};
pub(crate) use types::GpuLightMaps;

use bevy::{
    app::{App, Plugin},
    asset::embedded_asset,
    ecs::prelude::*,
    pbr::{DrawDepthOnlyPrepass, DrawPrepass},
    render::{
        ExtractSchedule, Render, RenderApp, RenderStartup, render_phase::AddRenderCommand,
        renderer::RenderGraph,
    },
    shader::load_shader_library,
};

use self::pipelines::{DepthCapture, SurfaceCapture};
use super::{
    needs::NeedsKnown,
    views::{CaptureKindPlugin, CapturePhase, preprocess_captures},
    world::lights::extract_lights,
};
use crate::{
    gpu::caps::supported,
    schedule::{GiPrepare, GiSystems},
};

pub(crate) struct LightMapsPlugin;

impl Plugin for LightMapsPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "lookup.wgsl");
        embedded_asset!(app, "clear.wgsl");
        embedded_asset!(app, "resolve.wgsl");
        embedded_asset!(app, "sum.wgsl");
        embedded_asset!(app, "vpls.wgsl");
        app.add_plugins((
            CaptureKindPlugin::<DepthCapture, DrawPrepass>::default(),
            CaptureKindPlugin::<SurfaceCapture, DrawPrepass>::default(),
        ));
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SceneLightMaps>()
            .add_render_command::<CapturePhase<DepthCapture>, DrawDepthOnlyPrepass>()
            .add_systems(RenderStartup, pipelines::init_pipelines.run_if(supported))
            .add_systems(
                ExtractSchedule,
                extract::extract_views
                    .after(extract_lights)
                    .after(NeedsKnown),
            )
            .add_systems(
                Render,
                (
                    cache::prepare_maps.in_set(GiPrepare::LightMaps),
                    prepare_bind_groups
                        .in_set(GiPrepare::Bindings)
                        .run_if(supported),
                ),
            )
            .add_systems(
                RenderGraph,
                (passes::draw_depth, passes::draw_surfaces)
                    .chain()
                    .in_set(GiSystems::CaptureScene)
                    .after(preprocess_captures),
            );
    }
}
