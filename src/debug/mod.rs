//! Debug views: parts of the light, of the surfaces and of what techniques keep, in place of the
//! picture or inside of it.
//!
//! Views of the screen are drawn by the composite, views of voxels by `voxels.rs`, into which a technique
//! puts its own cells as a `VoxelView`, views from lights by `light_maps.rs`. What lies at points of space is
//! drawn inside of the picture: volumes and their cells as gizmos (`gizmos.rs`), everything else as spheres by
//! one instanced pass (`shapes.rs`), for which a technique puts its own points into a `DebugShapes`.

mod gizmos;
pub(crate) mod light_maps;
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
    render::{Render, RenderApp, RenderSystems, extract_resource::ExtractResource},
};
use serde::{Deserialize, Serialize};

pub(crate) use view::Painter;
pub use view::{GiSlice, GiView, HintView};

use crate::{
    camera::ExtractedGiCamera,
    settings::{Clamp, Clamped, FieldRange, SettingsResource, SettingsResourcePlugin},
};

/// What to show for debugging. The same for all GI cameras; those whose technique is off show their
/// picture.
#[derive(
    Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, Default, PartialEq,
)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GiDebugSettings {
    /// What GI cameras show. Default: the picture.
    pub view: GiView,
    /// Level of the voxel views: 0 are voxels, each further one has cells of twice the size. Range
    /// 0..=8, default 0; levels that a volume does not have show its coarsest. Radiance and opacity
    /// start at level 1, with cells of two voxels.
    pub voxel_level: u32,
    /// Shows voxels in a cut through the volume rather than as cubes. Default: no cut.
    pub slice: GiSlice,
    /// Where the cut is, from one side of the volume to the other. Range 0..=1, default 0.
    pub slice_at: f32,
    /// Draws the bounds of each volume, and its coarsest cells, with gizmos. Default `false`.
    pub show_volumes: bool,
    /// Draws the probes through which forward and transparent materials are lit, as spheres that show
    /// the light from all sides. Default `false`. Needs
    /// [`GiSettings::forward_light`](crate::GiSettings::forward_light).
    pub show_probes: bool,
    /// Draws the virtual point lights of the reflective shadow maps as small spheres that show what their
    /// patch of surface radiates. Default `false`.
    pub show_vpls: bool,
    /// Draws the hints of [radiance hints](crate::technique::hints), where they stand, as spheres that show the
    /// light from all sides. Default `false`. With a [`slice`](Self::slice), those of one layer.
    pub show_hints: bool,
    /// What those show. Default: all light.
    pub hint_view: HintView,
    /// The picture, too, is lit by just what [`hint_view`](Self::hint_view) names, if that is a part of the light:
    /// a single bounce, emission or, with [`GiSettings::replace_ambient`](crate::GiSettings::replace_ambient), the
    /// sky. Default `false`.
    pub only_hint_view: bool,
    /// Draws the point that is picked, the hint that lights it most, and the taps over it at which
    /// [`HintReconstruction::Taps`](crate::HintReconstruction) reads. Default `false`.
    pub show_taps: bool,
    /// Marks in views of reflective shadow maps where the picked hint takes its samples, and the disk that they lie
    /// in, if any. Default `false`.
    pub show_samples: bool,
    /// Where the line of sight starts that picks a surface: the first voxel on it. Metres, each
    /// -1000000..=1000000.
    pub pick_from: Vec3,
    /// A further point of it. The same point as the first picks that itself. Metres, each -1000000..=1000000.
    pub pick_to: Vec3,
}

impl GiDebugSettings {
    /// Ranges of the numeric fields.
    pub fn ranges() -> Vec<FieldRange> {
        Clamp::ranges::<Self>()
    }
}

impl Clamped for GiDebugSettings {
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

impl SettingsResource for GiDebugSettings {}

pub(crate) struct DebugPlugin;

impl Plugin for DebugPlugin {
    fn build(&self, app: &mut App) {
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.add_systems(
                Render,
                show_plain_values
                    .after(RenderSystems::ExtractCommands)
                    .before(check_views_need_specialization)
                    .run_if(|debug: Res<GiDebugSettings>| !debug.view.is_luminance()),
            );
        }
        app.add_plugins((
            SettingsResourcePlugin::<GiDebugSettings>::default(),
            gizmos::VolumeGizmosPlugin,
            shapes::ShapesPlugin,
            light_maps::LightMapsViewPlugin,
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
        check_ranges(&GiDebugSettings::default(), GiDebugSettings::ranges());
    }

    #[test]
    fn names_of_views_are_theirs_alone() {
        for view in GiView::ALL {
            assert_eq!(GiView::from_name(view.name()), Some(view));
            assert!(!view.legend().is_empty());
        }
        let numbers = GiView::ALL.map(|view| view as u32);
        assert!(numbers.iter().copied().eq(0..GiView::ALL.len() as u32));
    }
}
