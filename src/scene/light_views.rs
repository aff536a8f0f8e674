//! What each light looks at: the projections of its shadow maps and reflective shadow maps.

use std::f32::consts::{FRAC_PI_2, PI};

use bevy::{
    math::{
        Mat4, Vec3, Vec3A,
        bounding::{Aabb3d, BoundingVolume},
    },
    transform::components::Transform,
};

use super::{
    lights::{LightKind, SceneLight},
    visibility::corners,
};

/// Nearer to a point, rect or spot light than this, nothing is seen. Metres.
const NEAR: f32 = 0.02;

/// Projection and view of one map.
pub(crate) struct MapView {
    pub clip_from_view: Mat4,
    pub world_from_view: Transform,
}

impl MapView {
    pub fn clip_from_world(&self) -> Mat4 {
        self.clip_from_view * self.world_from_view.to_matrix().inverse()
    }
}

fn any_up(direction: Vec3) -> Vec3 {
    if direction.y.abs() > 0.9 {
        Vec3::Z
    } else {
        Vec3::Y
    }
}

/// An orthographic view of `volumes` along the light, deep enough for all `casters`.
fn directional_view(direction: Vec3, volumes: &Aabb3d, casters: &Aabb3d) -> MapView {
    let mut world_from_view = Transform::default().looking_to(direction, any_up(direction));
    world_from_view.translation = Vec3::from(volumes.center());
    let view_from_world = world_from_view.to_matrix().inverse();
    let bounds_of = |aabb: &Aabb3d| {
        let points = corners(aabb).map(|p| Vec3A::from(view_from_world.transform_point3(p)));
        Aabb3d::from_point_cloud(bevy::math::Isometry3d::IDENTITY, points.into_iter())
    };
    let (volumes, casters) = (bounds_of(volumes), bounds_of(casters));
    // The view looks along -z: what is nearest to the light has the largest z.
    let near = -(volumes.max.z.max(casters.max.z)) - 0.1;
    let far = -volumes.min.z + 0.1;
    MapView {
        // Reverse-Z: far and near are swapped.
        clip_from_view: Mat4::orthographic_rh(
            volumes.min.x,
            volumes.max.x,
            volumes.min.y,
            volumes.max.y,
            far,
            near,
        ),
        world_from_view,
    }
}

/// A perspective view from `position`.
fn perspective_view(position: Vec3, direction: Vec3, fov: f32) -> MapView {
    MapView {
        clip_from_view: Mat4::perspective_infinite_reverse_rh(fov, 1.0, NEAR),
        world_from_view: Transform::from_translation(position)
            .looking_to(direction, any_up(direction)),
    }
}

/// The views of a light's maps, in the order of `cube_face` in `lights.wgsl`.
pub(crate) fn light_views(light: &SceneLight, volumes: &Aabb3d, casters: &Aabb3d) -> Vec<MapView> {
    let gpu = &light.gpu;
    if gpu.kind == LightKind::Directional as u32 {
        return vec![directional_view(gpu.direction, volumes, casters)];
    }
    if gpu.kind == LightKind::Spot as u32 {
        let fov = (2.0 * gpu.cos_outer.acos() + 0.02).clamp(0.02, PI * 0.98);
        return vec![perspective_view(gpu.position, gpu.direction, fov)];
    }
    let axes = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    axes.map(|axis| perspective_view(gpu.position, axis, FRAC_PI_2))
        .into()
}
