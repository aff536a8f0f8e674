//! Handles of the selected item in the viewport: arrows that move it, and the sides of a volume.

use bevy::{
    camera::Camera,
    ecs::prelude::*,
    math::{Vec2, Vec3},
    transform::components::{GlobalTransform, Transform},
};
use bevy_egui::{EguiContext, PrimaryEguiContext, egui};

use super::GiInspector;
use crate::{GiVolume, PrimaryGiCamera};

/// Part of the distance to the camera that arrows are long.
const ARROW: f32 = 0.12;
/// Points across a handle.
const SIZE: f32 = 14.0;

const COLORS: [egui::Color32; 3] = [
    egui::Color32::from_rgb(235, 80, 70),
    egui::Color32::from_rgb(120, 200, 70),
    egui::Color32::from_rgb(80, 140, 245),
];

/// Where a camera shows points of the world.
struct Eye {
    camera: Camera,
    transform: GlobalTransform,
    /// Points of Egui in a logical pixel.
    zoom: f32,
    /// What docked panels leave of the window.
    visible: egui::Rect,
}

impl Eye {
    /// In points of Egui; `None` behind the camera.
    fn project(&self, world: Vec3) -> Option<egui::Pos2> {
        let Vec2 { x, y } = self.camera.world_to_viewport(&self.transform, world).ok()?;
        Some(egui::pos2(x, y) * self.zoom)
    }
}

pub(super) fn show(world: &mut World) {
    let Some(selected) = world.resource::<GiInspector>().selected else {
        return;
    };
    let mut contexts = world
        .query_filtered::<(&EguiContext, &Camera, &GlobalTransform), With<PrimaryEguiContext>>();
    let Ok((context, camera, transform)) = contexts.single(world) else {
        return;
    };
    let mut context = context.clone();
    let ctx = context.get_mut();
    // What has the panel may be a camera for a user interface alone.
    let (mut camera, mut transform) = (camera.clone(), *transform);
    let primary = world.resource::<PrimaryGiCamera>().0;
    let primary = primary.and_then(|entity| {
        let place = world.get::<GlobalTransform>(entity)?;
        Some((world.get::<Camera>(entity)?, place))
    });
    if let Some((first, place)) = primary {
        (camera, transform) = (first.clone(), *place);
    }
    let eye = Eye {
        camera,
        transform,
        #[allow(
            deprecated,
            reason = "the only way to know in a context that others draw into"
        )]
        visible: ctx.available_rect(),
        zoom: ctx.native_pixels_per_point().unwrap_or(1.0) / ctx.pixels_per_point(),
    };
    let place = (
        world.get::<GlobalTransform>(selected).copied(),
        world.get::<Transform>(selected).copied(),
    );
    // The camera has no handles in its own picture.
    let (Some(global), Some(local)) = place else {
        return;
    };
    if world.get::<Camera>(selected).is_some() {
        return;
    }
    let id = egui::Id::new(("gi_handles", selected));
    let layer = egui::LayerId::new(egui::Order::Background, id);
    let painter = ctx.layer_painter(layer).with_clip_rect(eye.visible);
    let center = global.translation();

    let mut moved = arrows(ctx, &painter, id, &eye, center);
    if let Some(volume) = world.get::<GiVolume>(selected).copied() {
        let size = volume.extent * global.scale().abs();
        outline(&painter, &eye, center, size);
        if let Some((grown, shift)) = sides(ctx, id, &eye, center, size) {
            moved += shift;
            if let Some(mut volume) = world.get_mut::<GiVolume>(selected) {
                volume.extent = (volume.extent
                    + grown / global.scale().abs().max(Vec3::splat(1e-6)))
                .max(Vec3::splat(0.01));
            }
        }
    }
    if moved != Vec3::ZERO {
        // The transform is seen from the parent.
        let parent = global.affine() * local.compute_affine().inverse();
        let moved = parent.inverse().transform_vector3(moved);
        if let Some(mut transform) = world.get_mut::<Transform>(selected)
            && moved.is_finite()
        {
            transform.translation += moved;
        }
    }
}

/// A knob that can be dragged along a line of the screen, from `from` to `to`, which stand for two points
/// `length` apart. How far it was dragged, in units of `length`.
fn knob(
    ctx: &egui::Context,
    id: egui::Id,
    [from, to]: [egui::Pos2; 2],
    length: f32,
    color: egui::Color32,
    round: bool,
) -> f32 {
    let response = egui::Area::new(id)
        .order(egui::Order::Middle)
        .fixed_pos(to - egui::Vec2::splat(SIZE / 2.0))
        .constrain(false)
        .movable(false)
        .show(ctx, |ui| {
            let size = egui::Vec2::splat(SIZE);
            let (rect, response) = ui.allocate_exact_size(size, egui::Sense::drag());
            let active = response.hovered() || response.dragged();
            let radius = if active { 6.0 } else { 4.5 };
            if round {
                ui.painter().circle_filled(rect.center(), radius, color);
            } else {
                let rect =
                    egui::Rect::from_center_size(rect.center(), egui::Vec2::splat(2.0 * radius));
                ui.painter().rect_filled(rect, 1.0, color);
            }
            response
        })
        .inner;
    let line = to - from;
    // An axis that points at the viewer cannot be dragged along.
    if !response.dragged() || line.length() < 3.0 {
        return 0.0;
    }
    length * response.drag_delta().dot(line) / line.length_sq()
}

/// Arrows along the axes of the world. How far they were dragged.
fn arrows(
    ctx: &egui::Context,
    painter: &egui::Painter,
    id: egui::Id,
    eye: &Eye,
    center: Vec3,
) -> Vec3 {
    let mut moved = Vec3::ZERO;
    let Some(from) = eye.project(center) else {
        return moved;
    };
    let length = ARROW * eye.transform.translation().distance(center);
    for (axis, unit) in Vec3::AXES.into_iter().enumerate() {
        let to = eye.project(center + length * unit);
        let Some(to) = to.filter(|to| eye.visible.contains(*to)) else {
            continue;
        };
        painter.line_segment([from, to], egui::Stroke::new(2.5, COLORS[axis]));
        let id = id.with(("arrow", axis));
        moved += unit * knob(ctx, id, [from, to], length, COLORS[axis], true);
    }
    moved
}

/// Knobs on the six sides of a box. How much it grew, and how far its centre went, where one was dragged.
fn sides(
    ctx: &egui::Context,
    id: egui::Id,
    eye: &Eye,
    center: Vec3,
    size: Vec3,
) -> Option<(Vec3, Vec3)> {
    let from = eye.project(center)?;
    let mut change = None;
    for (axis, unit) in Vec3::AXES.into_iter().enumerate() {
        for sign in [1.0, -1.0] {
            let half = 0.5 * size[axis];
            let to = eye.project(center + sign * half * unit);
            let Some(to) = to.filter(|to| eye.visible.contains(*to)) else {
                continue;
            };
            let id = id.with(("side", axis, sign > 0.0));
            let pulled = knob(ctx, id, [from, to], half, COLORS[axis], false);
            if pulled != 0.0 {
                change = Some((unit * pulled, unit * 0.5 * sign * pulled));
            }
        }
    }
    change
}

fn outline(painter: &egui::Painter, eye: &Eye, center: Vec3, size: Vec3) {
    let corner = |i: usize| {
        let sign = Vec3::new(
            if i & 1 == 0 { -0.5 } else { 0.5 },
            if i & 2 == 0 { -0.5 } else { 0.5 },
            if i & 4 == 0 { -0.5 } else { 0.5 },
        );
        eye.project(center + sign * size)
    };
    let stroke = egui::Stroke::new(1.0, egui::Color32::from_rgb(250, 200, 60));
    for i in 0..8 {
        for bit in [1, 2, 4] {
            if i & bit == 0
                && let (Some(a), Some(b)) = (corner(i), corner(i | bit))
            {
                painter.line_segment([a, b], stroke);
            }
        }
    }
}
