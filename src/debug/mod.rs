//! Debug views: components of the light, surfaces, and the data of techniques, instead of the picture or inside
//! it.
//!
//! The composite draws views of the screen. `voxels.rs` draws views of voxels; a technique adds its own cells
//! as a `VoxelView`. `opacity.rs` draws ambient occlusion by cones, `light_maps.rs` views from lights. Objects at
//! points in space are drawn inside the picture: volumes and their cells as gizmos (`gizmos.rs`), everything
//! else as spheres in one instanced pass (`shapes.rs`); a technique adds its own points as `DebugShapes`.

pub(crate) mod fill;
mod gizmos;
pub(crate) mod light_maps;
mod opacity;
pub(crate) mod shapes;
mod view;
pub(crate) mod voxels;
mod vpls;

use bevy::{
    app::{App, Plugin},
    core_pipeline::tonemapping::Tonemapping,
    ecs::prelude::*,
    math::Vec3,
    pbr::check_views_need_specialization,
    reflect::prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        extract_resource::{ExtractResource, ExtractResourcePlugin},
    },
};
use serde::{Deserialize, Serialize};

pub(crate) use view::{GATHERED, Painter, ShownView, paints};
pub use view::{GiSlice, GiView, GiViews, ViewEntry};

use crate::{
    camera::ExtractedGiCamera,
    settings::{Clamp, Parameters, SettingsResourcePlugin},
};

/// Debug views. The same for all GI cameras; cameras whose technique is off show their picture.
#[derive(
    Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, Default, PartialEq,
)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GiDebugSettings {
    /// What GI cameras show. Default [`GiView::Full`], the picture.
    pub view: GiView,
    /// Mip level of the voxel views. Level 0 shows voxels; each further level has cells of twice the size.
    /// Radiance and opacity start at level 1, with cells of two voxels. A level that a volume does not have
    /// shows its coarsest. Range 0..=8, default 0.
    pub voxel_level: u32,
    /// Axis of the slice through the volume in which voxel views show voxels. Default [`GiSlice::None`]: voxels
    /// are shown as cubes.
    pub slice: GiSlice,
    /// Position of the slice, from one side of the volume to the other. Range 0..=1, default 0.
    pub slice_at: f32,
    /// Draws the bounds of each volume and its coarsest cells with gizmos. Default `false`.
    pub show_volumes: bool,
    /// Draws the ambient cubes that light forward-rendered objects, as spheres that show the light from all sides.
    /// Needs [`GiSettings::forward_light`](crate::GiSettings::forward_light). Default `false`.
    pub show_ambient_cubes: bool,
    /// Draws the virtual point lights of the reflective shadow maps, as small spheres that show the light that
    /// their patch of surface reflects. Default `false`.
    pub show_vpls: bool,
    /// Shows what lights the picked point, if the technique has something to show: spheres in the picture, and
    /// marks in views of light maps. Default `false`.
    pub show_picked: bool,
    /// Start of the ray that picks a surface, which is the first voxel on the ray. Metres, each
    /// -1000000..=1000000, default 0.
    pub pick_from: Vec3,
    /// A second point on the ray that picks a surface. If it equals `pick_from`, that point itself is picked.
    /// Metres, each -1000000..=1000000, default 0.
    pub pick_to: Vec3,
}

impl Parameters for GiDebugSettings {
    fn clamp(&mut self, c: &mut Clamp) {
        c.int("voxel_level", &mut self.voxel_level, 0, 8);
        c.float("slice_at", &mut self.slice_at, 0.0, 1.0);
        c.point(
            ["pick_from.x", "pick_from.y", "pick_from.z"],
            &mut self.pick_from,
        );
        c.point(["pick_to.x", "pick_to.y", "pick_to.z"], &mut self.pick_to);
    }
}

/// Debug views, and the parameters that choose them. Without it, [`GiDebugSettings`] has no effect.
#[derive(Default)]
pub struct DebugPlugin;

impl Plugin for DebugPlugin {
    fn build(&self, app: &mut App) {
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.add_systems(
                Render,
                show_plain_values
                    .after(RenderSystems::ExtractCommands)
                    .before(check_views_need_specialization)
                    .run_if(|shown: ShownView| !shown.entry().is_luminance),
            );
        }
        app.add_plugins((
            SettingsResourcePlugin::<GiDebugSettings>::debug(None),
            ExtractResourcePlugin::<GiViews>::default(),
            gizmos::VolumeGizmosPlugin,
            shapes::ShapesPlugin,
            light_maps::LightMapsViewPlugin,
            opacity::OpacityViewPlugin,
            voxels::VoxelViewPlugin,
            vpls::VplsViewPlugin,
        ));
    }
}

/// Numbers are shown as they are, not tone-mapped. Runs in the render world, where the camera's own choice
/// arrives anew in every frame.
fn show_plain_values(mut commands: Commands, views: Query<(Entity, &ExtractedGiCamera)>) {
    for (view, camera) in &views {
        if !camera.technique.is_off() {
            commands.entity(view).insert(Tonemapping::None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::check_ranges;

    #[test]
    fn every_number_has_a_range() {
        check_ranges::<GiDebugSettings>();
    }

    #[test]
    fn names_of_views_are_theirs_alone() {
        for view in GiView::ALL {
            let views = GiViews::default();
            assert_eq!(views.find(view.name()), Ok(view));
            assert!(!views.get(view).legend.is_empty());
        }
        let numbers = GiView::ALL.map(GiView::number);
        assert!(numbers.iter().copied().eq(0..GiView::ALL.len() as u32));
    }
}
