//! Bounds of volumes, and their cells, as gizmos.

use bevy::{
    app::{App, Plugin, PostUpdate},
    color::{
        Alpha,
        palettes::tailwind::{AMBER_300, SKY_400},
    },
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    gizmos::{
        AppGizmoBuilder, GizmoPlugin,
        config::{GizmoConfigGroup, GizmoConfigStore},
        gizmos::Gizmos,
    },
    math::Vec3,
    reflect::Reflect,
    transform::components::Transform,
};

use super::GiDebugSettings;
use crate::scene::volume::{VolumeGrid, update_grids};

/// Draws with Bevy's gizmos, where the app has them.
pub(super) struct VolumeGizmosPlugin;

/// Lines that are seen through walls: a room's volume is larger than the room.
#[derive(Default, Reflect, GizmoConfigGroup)]
struct VolumeGizmos;

impl Plugin for VolumeGizmosPlugin {
    fn build(&self, app: &mut App) {
        if app.is_plugin_added::<GizmoPlugin>() {
            app.init_gizmo_group::<VolumeGizmos>();
            let mut store = app.world_mut().resource_mut::<GizmoConfigStore>();
            store.config_mut::<VolumeGizmos>().0.depth_bias = -1.0;
            app.add_systems(
                PostUpdate,
                draw_volumes
                    .after(update_grids)
                    .run_if(|debug: Res<GiDebugSettings>| debug.show_volumes),
            );
        }
    }
}

fn draw_volumes(grids: Query<&VolumeGrid>, mut gizmos: Gizmos<VolumeGizmos>) {
    for grid in grids.iter().filter_map(|grid| grid.0) {
        let (center, size) = (grid.center(), grid.size());
        gizmos.cube(
            Transform::from_translation(center).with_scale(size),
            AMBER_300,
        );
        // Cells of the coarsest level, on the three faces with the smallest coordinates.
        let cell = (2 << (grid.levels - 1)) as f32 * grid.voxel;
        let count = (size / cell).round();
        let color = SKY_400.with_alpha(0.35);
        let mut line = |a: Vec3, b: Vec3| {
            gizmos.line(grid.origin + a, grid.origin + b, color);
        };
        for axis in 0..3 {
            let unit = |axis: usize| {
                let mut unit = Vec3::ZERO;
                unit[axis % 3] = 1.0;
                unit
            };
            let (u, v) = (axis, (axis + 1) % 3);
            for i in 1..count[u] as u32 {
                let at = unit(u) * (i as f32 * cell);
                line(at, at + unit(v) * size[v]);
            }
            for i in 1..count[v] as u32 {
                let at = unit(v) * (i as f32 * cell);
                line(at, at + unit(u) * size[u]);
            }
        }
    }
}
