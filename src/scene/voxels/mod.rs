//! `SceneVoxels`: albedo, normal, emission and sidedness of all surfaces in a volume.
//!
//! # How
//!
//! Meshes are drawn along the three axes, each triangle in the views that it faces, with Bevy's own
//! vertex and material shaders (so skins, morph targets, textures and alpha masks just work), and
//! the fragment shader sums surface attributes into voxels with integer atomics: the sums commute,
//! so the result is the same bits every time, whatever the order of fragments.
//!
//! Storage is sparse: the volume is divided into *bricks* of 4x4x4 voxels. A first draw marks the
//! bricks that hold a surface, a compute pass gives each a slot in the *pool*, a second draw sums.
//! The pool starts small; a few words come back from the GPU some frames later, and where slots
//! were missing, it grows to what is needed and an eighth more.
//!
//! A volume is captured anew only when its grid, a mesh that takes part, or the unit of emission has changed (`plan.rs`).
//!
//! # Holes
//!
//! Each axis is drawn at twice the voxel resolution ([`SUPERSAMPLING`]), so that a column of voxels
//! is met at 2x2 points, and a triangle is drawn in *every* view whose axis makes less than 60
//! degrees with its normal, so that neighbours which face different axes overlap by more than a
//! sample. The result is 6-separating: no path from voxel to face-adjacent voxel crosses a closed
//! surface. `tests/gpu/voxels.rs` holds it against the exact triangle/box overlap.
//!
//! # Record of a voxel
//!
//! While drawing, [`WORDS`] sums per voxel; afterwards, in place, the first three words:
//!
//! | word | content |
//! |---|---|
//! | 0 | albedo: the part of light from everywhere that is reflected, as `pack_color` in `gpu/pack.wgsl` has it |
//! | 1 | normal, octahedral 2 x 12 bit; flags in the top byte: 1 = surface, 2 = two-sided, from 4 on faces along +x +y +z -x -y -z |
//! | 2 | emission, nits, as `pack_radiance` in `gpu/pack.wgsl` has it |
//!
//! Emission is summed in fixed point, in a unit of each brick's own: the first draw finds the exponent of
//! its brightest emission. So a filament takes nothing from what shines elsewhere, and sums neither overflow
//! nor vanish.
//!
//! A second buffer has a bit per voxel of the pool, for rays ([`trace.wgsl`](self)).
//!
//! Both sides of a wall thinner than a voxel fall into the same voxel; it is then *two-sided*, and
//! lit on each side by itself.

mod cache;
mod passes;
mod pipelines;
mod plan;
mod types;
mod views;

pub use cache::SceneVoxels;
pub(crate) use cache::prepare_voxels;
pub(crate) use passes::voxelize;
pub(crate) use types::{BRICK_VOXELS, SLICES, argument, shader_defs};
pub use types::{SUPERSAMPLING, WORDS};

use bevy::{
    app::{App, Plugin},
    asset::embedded_asset,
    core_pipeline::schedule::camera_driver,
    ecs::prelude::*,
    render::{
        ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems, renderer::RenderGraph,
    },
    shader::load_shader_library,
};

use super::{
    views::{CaptureKindPlugin, preprocess_captures},
    volume::with_volume,
};
use crate::{
    gpu::caps::supported,
    schedule::{GiPrepare, GiSystems},
};

pub(crate) struct VoxelsPlugin;

impl Plugin for VoxelsPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "splat.wgsl");
        load_shader_library!(app, "pool.wgsl");
        load_shader_library!(app, "trace.wgsl");
        embedded_asset!(app, "voxelize.wgsl");
        embedded_asset!(app, "voxelize_unknown.wgsl");
        embedded_asset!(app, "allocate.wgsl");
        embedded_asset!(app, "resolve.wgsl");
        app.add_plugins(CaptureKindPlugin::<
            pipelines::VoxelCapture,
            pipelines::DrawVoxelize,
        >::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_observer(with_volume::<SceneVoxels>)
            .init_resource::<SpecializedMeshPipelinesOf>()
            .add_systems(
                RenderStartup,
                pipelines::init_voxel_pipelines.run_if(supported),
            )
            .add_systems(
                ExtractSchedule,
                views::extract_voxel_views.after(super::needs::NeedsKnown),
            )
            .add_systems(
                Render,
                prepare_voxels.in_set(GiPrepare::Voxels).run_if(supported),
            )
            .add_systems(Render, cache::read_counts.in_set(RenderSystems::Cleanup))
            .add_systems(
                RenderGraph,
                voxelize
                    .in_set(GiSystems::CaptureScene)
                    .after(preprocess_captures)
                    .before(camera_driver),
            );
    }
}

type SpecializedMeshPipelinesOf =
    bevy::render::render_resource::SpecializedMeshPipelines<pipelines::VoxelSpecializer>;
