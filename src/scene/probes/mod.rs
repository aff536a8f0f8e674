//! `SceneProbes`: points of a lattice in each volume, and what each of them sees through the voxels.
//!
//! Techniques that keep light at points share this: where the points stand ([`ProbeSet`]), which voxel each
//! ray from a point meets, and which points light a given surface.
//!
//! # A capture
//!
//! | pass | does |
//! |---|---|
//! | `gi/scene/place_probes` | moves probes out of geometry, and finds those that are inside of something |
//! | `gi/scene/trace_probes` | one ray for each texel of an octahedral map around each probe: which voxel is there, how far |
//! | `gi/scene/probe_moments` | mean and mean square of the distances, by direction |
//!
//! Nothing runs while nothing changes. While a cache settles, the rays are traced again in other
//! directions each frame, so that what it accumulates has seen everything.
//!
//! # Weights
//!
//! A point is lit by the eight probes around it. Each counts by its trilinear share, by how far in front of
//! the surface it is, and by whether it sees the point: Chebyshev's inequality bounds the part of
//! its view that is farther than the point (Majercik et al. 2019, section 5.2, for probes of
//! irradiance; Donnelly and Lauritzen 2006 for the bound). Probes inside of something do not count.

mod cache;
mod extract;
mod passes;
mod pipelines;
mod plan;
mod types;

pub use super::volume::Lattice;
pub(crate) use cache::LookAgain;
pub use cache::SceneProbes;
pub(crate) use pipelines::{cache_layout, shader_defs};
pub(crate) use types::GpuProbes;

use bevy::{
    app::{App, Plugin},
    asset::embedded_asset,
    ecs::prelude::*,
    render::{ExtractSchedule, Render, RenderApp, RenderStartup, renderer::RenderGraph},
    shader::load_shader_library,
};

use super::{
    volume::{GiVolume, ProbeSet, with_volume},
    voxels::voxelize,
};
use crate::{
    gpu::caps::supported,
    schedule::{GiPrepare, GiSystems},
    settings::SettingsComponentPlugin,
};

pub(crate) struct ProbesPlugin;

impl Plugin for ProbesPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "bindings.wgsl");
        load_shader_library!(app, "lookup.wgsl");
        embedded_asset!(app, "place.wgsl");
        embedded_asset!(app, "moments.wgsl");
        app.register_required_components::<GiVolume, ProbeSet>()
            .add_plugins(SettingsComponentPlugin::<ProbeSet>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_observer(with_volume::<(SceneProbes, extract::ExtractedProbeSet, LookAgain)>)
            .add_systems(
                RenderStartup,
                pipelines::init_probe_pipelines.run_if(supported),
            )
            .add_systems(ExtractSchedule, extract::extract_sets)
            .add_systems(
                Render,
                cache::prepare_probes
                    .in_set(GiPrepare::Probes)
                    .run_if(supported),
            )
            .add_systems(
                RenderGraph,
                passes::look_at_scene
                    .in_set(GiSystems::CaptureScene)
                    .after(voxelize),
            );
    }
}
