//! What each light looks at: the projections of its shadow maps and reflective shadow maps, and the meshes
//! in each.

use std::f32::consts::{FRAC_PI_2, PI};

use bevy::{
    ecs::entity::Entity,
    math::{
        Mat4, UVec2, Vec3, Vec3A, Vec4,
        bounding::{Aabb3d, BoundingVolume},
    },
    transform::components::Transform,
};

use super::{
    capture::WantedView,
    lights::{LightKind, SceneLight},
    visibility::{Caster, SceneCasters, corners, grid_bounds, overlaps},
    volume::VolumeGrid,
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

/// Half-spaces that a view lies in: what is wholly outside of one of them is not seen. Planes as
/// `normal . p + w >= 0`: four sides, the far plane (reverse-Z: at 0), and what is behind.
struct Sides([Vec4; 6]);

impl Sides {
    fn new(clip_from_world: &Mat4) -> Self {
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
        Self([w + x, w - x, w + y, w - y, z, w])
    }

    fn sees(&self, bounds: &Aabb3d) -> bool {
        let center = Vec3::from(bounds.center());
        let half = Vec3::from(bounds.half_size());
        let outside = |side: &Vec4| {
            let normal = side.truncate();
            normal.dot(center) + side.w + normal.abs().dot(half) < 0.0
        };
        !self.0.iter().any(outside)
    }
}

/// What all lights look at.
pub(crate) struct LitScene<'a> {
    volumes: Aabb3d,
    casters: Vec<&'a Caster>,
    /// Whether maps show what is lit, and not what casts shadows.
    lit: bool,
}

/// One map of a light, and what it sees.
pub(crate) struct LightView {
    pub face: u32,
    pub view: MapView,
    /// Main-world meshes, sorted.
    meshes: Vec<Entity>,
    /// What they look like, see [`SceneCasters::content`].
    pub content: u64,
}

impl LightView {
    /// What draws the map.
    pub fn wanted(self, owner: Entity, size: u32) -> WantedView {
        WantedView {
            owner,
            index: self.face,
            clip_from_view: self.view.clip_from_view,
            world_from_view: self.view.world_from_view,
            size: UVec2::splat(size),
            meshes: self.meshes,
        }
    }
}

impl<'a> LitScene<'a> {
    /// `None` without volumes: then nobody looks at a map.
    pub fn new<'g>(
        grids: impl Iterator<Item = &'g VolumeGrid>,
        casters: impl Iterator<Item = &'a Caster>,
    ) -> Option<Self> {
        let volumes = grids.filter_map(|grid| grid.0.as_ref().map(grid_bounds));
        Some(Self {
            volumes: volumes.reduce(|a, b| a.merge(&b))?,
            casters: casters.collect(),
            lit: false,
        })
    }

    /// The same for maps of what is lit.
    ///
    /// As in Bevy, meshes that share no layer with a light are lit, and do not stand in its way. A map has room
    /// for one surface in each direction: it is one that does, unless there is none in all of the map's light.
    pub fn of_lit(self) -> Self {
        Self { lit: true, ..self }
    }

    /// Whether a light gets to any volume.
    pub fn is_reached_by(&self, light: &SceneLight) -> bool {
        reach(light).is_none_or(|reach| overlaps(&reach, &self.volumes))
    }

    /// The maps of a light.
    pub fn views(&self, light: &SceneLight) -> Vec<LightView> {
        let reach = reach(light);
        let casters = self.casters.iter().copied();
        let mut reached: Vec<_> = casters
            .filter(|c| reach.is_none_or(|reach| overlaps(&c.bounds, &reach)))
            .collect();
        let shares_layer = |c: &&Caster| c.layers.intersects(&light.layers);
        if !self.lit || reached.iter().any(shares_layer) {
            reached.retain(shares_layer);
        }
        let views = light_views(light, &self.volumes, &reached);
        let views = views.into_iter().enumerate().map(|(face, view)| {
            let sides = Sides::new(&view.clip_from_world());
            let seen = || reached.iter().filter(|c| sides.sees(&c.bounds));
            LightView {
                face: face as u32,
                view,
                meshes: seen().map(|c| c.entity).collect(),
                content: SceneCasters::content(seen().copied()),
            }
        });
        views.collect()
    }
}

/// How far a light gets; `None`: everywhere.
fn reach(light: &SceneLight) -> Option<Aabb3d> {
    let unbounded = light.gpu.kind == LightKind::Directional as u32;
    (!unbounded).then(|| Aabb3d::new(light.gpu.position, Vec3::splat(light.gpu.range)))
}

fn any_up(direction: Vec3) -> Vec3 {
    if direction.y.abs() > 0.9 {
        Vec3::Z
    } else {
        Vec3::Y
    }
}

/// An orthographic view of `volumes` along the light, from before all `casters` that stand in its way.
fn directional_view(direction: Vec3, volumes: &Aabb3d, casters: &[&Caster]) -> MapView {
    let mut world_from_view = Transform::default().looking_to(direction, any_up(direction));
    world_from_view.translation = Vec3::from(volumes.center());
    let view_from_world = world_from_view.to_matrix().inverse();
    let bounds_of = |aabb: &Aabb3d| {
        let points = corners(aabb).map(|p| Vec3A::from(view_from_world.transform_point3(p)));
        Aabb3d::from_point_cloud(bevy::math::Isometry3d::IDENTITY, points.into_iter())
    };
    let volumes = bounds_of(volumes);
    // The view looks along -z: what is nearest to the light has the largest z.
    let in_the_way = casters.iter().map(|caster| bounds_of(&caster.bounds));
    let in_the_way = in_the_way.filter(|c| {
        let beside = |axis| c.min[axis] > volumes.max[axis] || c.max[axis] < volumes.min[axis];
        !beside(0) && !beside(1)
    });
    let nearest = in_the_way.map(|c| c.max.z).fold(volumes.max.z, f32::max);
    let near = -nearest - 0.1;
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
fn light_views(light: &SceneLight, volumes: &Aabb3d, casters: &[&Caster]) -> Vec<MapView> {
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

#[cfg(test)]
mod tests {
    use bevy::camera::visibility::RenderLayers;

    use super::*;

    fn cube(center: Vec3) -> Aabb3d {
        Aabb3d::new(center, Vec3::splat(0.1))
    }

    #[test]
    fn a_spot_sees_what_is_before_it() {
        let view = perspective_view(Vec3::new(0.0, 2.0, 0.0), Vec3::NEG_Y, FRAC_PI_2);
        let sides = Sides::new(&view.clip_from_world());
        for (center, seen) in [
            (Vec3::ZERO, true),
            (Vec3::new(1.9, 0.0, 0.0), true),
            // Half in it.
            (Vec3::new(2.05, 0.0, 0.0), true),
            (Vec3::new(2.4, 0.0, 0.0), false),
            (Vec3::new(0.0, 0.0, -2.4), false),
            (Vec3::new(0.0, 2.5, 0.0), false),
        ] {
            assert_eq!(sides.sees(&cube(center)), seen, "{center}");
        }
    }

    #[test]
    fn the_sun_sees_what_is_above_the_volume() {
        let volume = Aabb3d::new(Vec3::ZERO, Vec3::splat(1.0));
        let caster = |center| Caster {
            entity: Entity::PLACEHOLDER,
            bounds: cube(center),
            shadow: true,
            layers: RenderLayers::default(),
            changed: 0,
        };
        let above = caster(Vec3::new(0.5, 8.0, 0.5));
        let view = directional_view(Vec3::NEG_Y, &volume, &[&above]);
        // What stands beside the volume's column does not change the view.
        let beside = caster(Vec3::new(5.0, 20.0, 0.0));
        let same = directional_view(Vec3::NEG_Y, &volume, &[&above, &beside]);
        assert_eq!(view.clip_from_world(), same.clip_from_world());
        let sides = Sides::new(&view.clip_from_world());
        for (center, seen) in [
            (Vec3::ZERO, true),
            (Vec3::new(0.5, 8.0, 0.5), true),
            (Vec3::new(0.0, -1.5, 0.0), false),
            (Vec3::new(1.5, 0.0, 0.0), false),
            (Vec3::new(0.0, 0.0, -1.5), false),
        ] {
            assert_eq!(sides.sees(&cube(center)), seen, "{center}");
        }
    }
}
