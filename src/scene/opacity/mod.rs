//! `SceneOpacity`: how much of the light that travels through a volume its surfaces stop, as a pyramid.
//!
//! Cells of two voxels, and coarser and coarser ones above them, each twice as wide. A cell is seen from six sides
//! (Crassin 2011, section 7.3): along a direction, of two cells in a row the nearer covers the further one, and the
//! four rows are averaged. So a thin wall stays opaque at every level, and a surface that has one side only stops
//! light that meets it from its front.
//!
//! `lookup.wgsl` is the only door: `transmittance` of a cone, and what others need to march one themselves.
//!
//! # Layout
//!
//! One `Rgba8Unorm` 3D texture with a mip level for each level. Red, green and blue are the opacity along x, y and z, for
//! what travels in the positive directions; below it along z, for the negative ones. With 128 voxels along each side it
//! has 64 x 64 x 128 texels, 2.3 MiB with its levels.
//!
//! # Passes of a frame
//!
//! | pass | runs | does |
//! |---|---|---|
//! | `gi/scene/clear_opacity` | after a capture | nothing stops light where no brick is left |
//! | `gi/scene/opacity` | after a capture | builds the finest cells from voxels, and then each level from the finer one |

mod cache;
mod passes;
mod pipelines;
mod types;

pub(crate) use cache::OpacityTextures;
pub use cache::SceneOpacity;

use bevy::{
    app::{App, Plugin},
    asset::embedded_asset,
    ecs::prelude::*,
    render::{Render, RenderApp, RenderStartup, renderer::RenderGraph},
    shader::load_shader_library,
};

use super::{
    volume::with_volume,
    voxels::{prepare_voxels, voxelize},
};
use crate::{
    gpu::caps::supported,
    schedule::{GiPrepare, GiSystems},
};

pub(crate) struct OpacityPlugin;

impl Plugin for OpacityPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "cells.wgsl");
        load_shader_library!(app, "lookup.wgsl");
        embedded_asset!(app, "filter.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_observer(with_volume::<SceneOpacity>)
            .add_systems(
                RenderStartup,
                (cache::init_textures, pipelines::init_opacity_pipelines).run_if(supported),
            )
            .add_systems(
                Render,
                cache::prepare_opacity
                    .in_set(GiPrepare::Voxels)
                    .after(prepare_voxels)
                    .run_if(supported),
            )
            .add_systems(
                RenderGraph,
                passes::filter_opacity
                    .in_set(GiSystems::CaptureScene)
                    .after(voxelize),
            );
    }
}
