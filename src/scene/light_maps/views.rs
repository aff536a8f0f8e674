//! What each light looks at: the projections of its maps, and the meshes in each.

use std::{
    f32::consts::{FRAC_PI_2, PI},
    hash::{BuildHasher, Hash, Hasher},
};

use bevy::{
    camera::Camera,
    ecs::prelude::*,
    math::{
        Mat4, UVec2, Vec3, Vec3A, Vec4,
        bounding::{Aabb3d, BoundingVolume},
    },
    platform::hash::FixedHasher,
    transform::components::{GlobalTransform, Transform},
};

use crate::{
    camera::GiCamera,
    scene::{
        bounds::{Beam, any_up, overlaps},
        views::WantedView,
        volume::{VolumeGrid, finest_first},
        world::{
            casters::{Caster, SceneCasters},
            lights::{LightKind, SceneLight},
        },
    },
};

/// Depth needs a near plane, metres.
const SMALLEST_NEAR: f32 = 1e-4;

/// Projection and view of one map.
#[derive(Clone, Debug)]
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

/// What all lights look at, and from where that is looked at.
pub(crate) struct LitScene<'a> {
    volumes: Vec<LitVolume>,
    casters: Vec<&'a Caster>,
    /// Whether maps show what is lit, and not only what casts shadows.
    ///
    /// As in Bevy, meshes that share no layer with a light are lit, and do not stand in its way. A map has room
    /// for one surface in each direction: it is one that does, unless there is none in all of the map's light.
    lit: bool,
    /// Where the GI cameras are, metres.
    cameras: Vec<Vec3>,
    /// A number that stands for the casters and the volumes.
    pub content: u64,
}

/// A volume whose surfaces are to be lit.
#[derive(Clone, Copy, Debug)]
struct LitVolume {
    entity: Entity,
    bounds: Aabb3d,
}

impl LitVolume {
    /// Half of its longest side, metres.
    fn radius(&self) -> f32 {
        self.bounds.half_size().max_element()
    }

    /// Distance to a point, 0 inside.
    fn distance(&self, p: Vec3) -> f32 {
        self.bounds.closest_point(p).distance(p.into())
    }
}

/// One map of a light, and what it sees.
#[derive(Clone, Debug)]
pub(crate) struct LightView {
    /// Which of the light's: the face of a cube, or the number of the volume's entity.
    pub face: u32,
    pub view: MapView,
    pub clip_from_world: Mat4,
    /// Surfaces outside of this box are none of the volume's business: they cast, but do not bounce.
    pub bounces: Aabb3d,
    /// Main-world meshes, sorted.
    meshes: Vec<Entity>,
    /// What they look like, see [`SceneCasters::content`].
    pub content: u64,
    /// Whether they stand in the light's way. If not, they are only lit by it.
    pub blocks: bool,
}

impl LightView {
    /// What draws the map.
    pub fn wanted(&self, owner: Entity, size: u32) -> WantedView {
        WantedView {
            owner,
            index: self.face,
            clip_from_view: self.view.clip_from_view,
            world_from_view: self.view.world_from_view,
            size: UVec2::splat(size),
            meshes: self.meshes.clone(),
        }
    }
}

impl<'a> LitScene<'a> {
    /// `None` without volumes: then nobody looks at a map. `lit`: whether maps show surfaces that light only falls on.
    pub fn new(
        grids: &Query<(Entity, &VolumeGrid)>,
        casters: &'a SceneCasters,
        cameras: &Query<(&Camera, &GlobalTransform), With<GiCamera>>,
        lit: bool,
    ) -> Option<Self> {
        let mut grids: Vec<_> = grids.iter().filter_map(|(e, g)| Some((e, g.0?))).collect();
        grids.sort_by(|(a, a_grid), (b, b_grid)| finest_first((a_grid, *a), (b_grid, *b)));
        let mut hasher = FixedHasher.build_hasher();
        casters.version.hash(&mut hasher);
        for (entity, grid) in &grids {
            entity.hash(&mut hasher);
            for number in grid
                .origin
                .to_array()
                .into_iter()
                .chain(grid.size().to_array())
            {
                number.to_bits().hash(&mut hasher);
            }
        }
        let volumes = grids.into_iter().map(|(entity, grid)| LitVolume {
            entity,
            bounds: grid.bounds(),
        });
        let active = cameras.iter().filter(|(camera, _)| camera.is_active);
        let scene = Self {
            volumes: volumes.collect(),
            // What casts no shadow for Bevy lets light through here too, and so does not catch it.
            casters: casters
                .casters
                .iter()
                .filter(|caster| caster.shadow)
                .collect(),
            lit,
            cameras: active
                .map(|(_, transform)| transform.translation())
                .collect(),
            content: hasher.finish(),
        };
        (!scene.volumes.is_empty()).then_some(scene)
    }

    /// A scene without a world.
    #[cfg(test)]
    pub fn of(volume: (Entity, Aabb3d), casters: &'a [Caster], lit: bool) -> Self {
        let (entity, bounds) = volume;
        Self {
            volumes: vec![LitVolume { entity, bounds }],
            casters: casters.iter().collect(),
            lit,
            cameras: vec![bounds.center().into()],
            content: SceneCasters::content(casters),
        }
    }

    /// Meshes that a light's maps show, of those that it reaches, and whether they block it.
    fn shown(&self, light: &SceneLight, reach: Option<&Aabb3d>) -> (Vec<&'a Caster>, bool) {
        let casters = self.casters.iter().copied();
        let mut shown: Vec<_> = casters
            .filter(|c| reach.is_none_or(|reach| overlaps(&c.bounds, reach)))
            .collect();
        let shares_layer = |c: &&Caster| c.layers.intersects(&light.layers);
        let blocks = shown.iter().any(shares_layer);
        if blocks || !self.lit {
            shown.retain(shares_layer);
        }
        (shown, blocks)
    }

    /// The maps of a light; none if it gets to no volume.
    pub fn views(&self, light: &SceneLight) -> Vec<LightView> {
        let Some(reach) = light.reach() else {
            let (casters, blocks) = self.shown(light, None);
            // Where the maps of volumes overlap, light is counted in the finest: the others must know where that is.
            let mut finer = FixedHasher.build_hasher();
            let views = self.volumes.iter().map(|volume| {
                let around = volume.bounds.grow(Vec3A::splat(2.0 * volume.radius()));
                let view = directional_view(light.gpu.direction, &volume.bounds, &casters);
                let mut view =
                    LightView::new(volume.entity.index_u32(), view, around, &casters, blocks);
                view.content ^= finer.finish();
                view.clip_from_world
                    .to_cols_array()
                    .map(f32::to_bits)
                    .hash(&mut finer);
                view
            });
            return views.collect();
        };
        if !self.volumes.iter().any(|v| overlaps(&reach, &v.bounds)) {
            return Vec::new();
        }
        let (reached, blocks) = self.shown(light, Some(&reach));
        let views = lamp_views(light).into_iter().zip(0..);
        let views = views.map(|(view, face)| LightView::new(face, view, reach, &reached, blocks));
        views.collect()
    }

    /// What a map is worth: about the illuminance that its light makes where a camera is, lux.
    pub fn importance(&self, light: &SceneLight, face: u32) -> f32 {
        let volume = self.volume_of(light, face);
        // Nearer than that, distance says nothing.
        let radii = self.volumes.iter().map(LitVolume::radius);
        let near = match volume {
            Some(volume) => volume.radius(),
            None => 0.5 * radii.fold(f32::MAX, f32::min),
        };
        let distances = self.cameras.iter().map(|camera| match volume {
            Some(volume) => volume.distance(*camera),
            None => light.gpu.position.distance(*camera),
        });
        // Without a camera, all are as far away.
        let distance = distances.reduce(f32::min).unwrap_or(0.0).max(near);
        let lumens = match volume {
            Some(volume) => light.power() * volume.radius().powi(2),
            None => light.power(),
        };
        lumens / (distance * distance).max(1e-12)
    }

    /// How much the light that a map catches matters to each volume, finest first: as much as light from a source so far
    /// away, 1 inside.
    pub fn relevance(&self, light: &SceneLight, face: u32) -> impl Iterator<Item = f32> {
        let of = self.volume_of(light, face).copied();
        let position = light.gpu.position;
        self.volumes.iter().map(move |volume| {
            let distance = match of {
                Some(of) => {
                    let gap =
                        (volume.bounds.min - of.bounds.max).max(of.bounds.min - volume.bounds.max);
                    gap.max(Vec3A::ZERO).length()
                }
                None => volume.distance(position),
            };
            let radius = volume.radius().max(1e-6);
            1.0 / (1.0 + (distance / radius).powi(2))
        })
    }

    /// Volumes, finest first.
    pub fn volumes(&self) -> impl Iterator<Item = Entity> {
        self.volumes.iter().map(|volume| volume.entity)
    }

    /// The volume that a directional light's map is for.
    fn volume_of(&self, light: &SceneLight, face: u32) -> Option<&LitVolume> {
        let is_for = |volume: &&LitVolume| volume.entity.index_u32() == face;
        let volumes = light.gpu.is_directional().then_some(&self.volumes);
        volumes?.iter().find(is_for)
    }
}

impl LightView {
    fn new(face: u32, view: MapView, bounces: Aabb3d, casters: &[&Caster], blocks: bool) -> Self {
        let clip_from_world = view.clip_from_world();
        let sides = Sides::new(&clip_from_world);
        let seen = || casters.iter().copied().filter(|c| sides.sees(&c.bounds));
        Self {
            face,
            view,
            clip_from_world,
            bounces,
            meshes: seen().map(|c| c.entity).collect(),
            content: SceneCasters::content(seen()),
            blocks,
        }
    }
}

/// How far before a volume the view of a directional light begins at most, metres: farther than anything stands,
/// and so near that depth is still told apart.
const FARTHEST_CASTER: f32 = 1e6;

/// An orthographic view of `volume` along the light, from before all `casters` that stand in its way, however far away.
fn directional_view(direction: Vec3, volume: &Aabb3d, casters: &[&Caster]) -> MapView {
    let mut world_from_view = Transform::default().looking_to(direction, any_up(direction));
    let beam = Beam::new(direction);
    let lit = beam.bounds(volume);
    let in_the_way = casters.iter().map(|caster| beam.bounds(&caster.bounds));
    let in_the_way = in_the_way.filter(|caster| Beam::casts(caster, &lit));
    let nearest = in_the_way.map(|c| c.max.z).fold(lit.max.z, f32::max);
    let nearest = nearest.min(lit.max.z + FARTHEST_CASTER);
    // The view's origin is that of the volume: large coordinates lose digits.
    let center = lit.center();
    world_from_view.translation = Vec3::from(volume.center());
    let margin = 1e-3 * (nearest - lit.min.z) + 1e-6;
    let half = lit.half_size();
    MapView {
        // Reverse-Z: far and near are swapped.
        clip_from_view: Mat4::orthographic_rh(
            -half.x,
            half.x,
            -half.y,
            half.y,
            half.z + margin,
            -(nearest - center.z) - margin,
        ),
        world_from_view,
    }
}

/// A perspective view from `position`, from `near` metres on.
fn perspective_view(position: Vec3, direction: Vec3, fov: f32, near: f32) -> MapView {
    MapView {
        clip_from_view: Mat4::perspective_infinite_reverse_rh(fov, 1.0, near),
        world_from_view: Transform::from_translation(position)
            .looking_to(direction, any_up(direction)),
    }
}

/// Views of a lamp's maps, in the order of `cube_face` in `lights.wgsl`.
fn lamp_views(light: &SceneLight) -> Vec<MapView> {
    let gpu = &light.gpu;
    let near = gpu.near.max(SMALLEST_NEAR);
    if gpu.kind == LightKind::Spot as u32 {
        let fov = (2.0 * gpu.cos_outer.acos() + 0.02).clamp(0.02, PI * 0.98);
        return vec![perspective_view(gpu.position, gpu.direction, fov, near)];
    }
    let axes = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    axes.map(|axis| perspective_view(gpu.position, axis, FRAC_PI_2, near))
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
        let view = perspective_view(Vec3::new(0.0, 2.0, 0.0), Vec3::NEG_Y, FRAC_PI_2, 0.02);
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
