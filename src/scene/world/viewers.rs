//! What the GI cameras see, wherever they look: which render layers, and which level of detail.
//!
//! Light is computed once, for all cameras: what it meets does not depend on who looks. So a mesh or a light
//! takes part if *some* active [`GiCamera`](crate::GiCamera) would see it if it looked there, and of a chain
//! of levels of detail the one that the primary camera would see: the primary one. Cameras
//! whose layers differ share the light of all of their layers.

use bevy::{
    camera::{
        Camera,
        visibility::{RenderLayers, VisibilityRange},
    },
    ecs::prelude::*,
    math::Vec3A,
    transform::components::GlobalTransform,
};

use crate::camera::PrimaryGiCamera;

/// What is asked of each GI camera.
pub(crate) type Viewer = (
    Entity,
    &'static Camera,
    &'static GlobalTransform,
    Option<&'static RenderLayers>,
);

/// What all active GI cameras see together.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub(crate) struct Viewers {
    /// Their layers; without a camera those of one that has no layers of its own.
    layers: RenderLayers,
    /// Where the primary camera stands.
    eye: Option<Vec3A>,
}

impl Viewers {
    pub fn new<'a>(
        primary: PrimaryGiCamera,
        cameras: impl Iterator<
            Item = (
                Entity,
                &'a Camera,
                &'a GlobalTransform,
                Option<&'a RenderLayers>,
            ),
        >,
    ) -> Self {
        let mut seen: Option<RenderLayers> = None;
        let mut eye = None;
        for (entity, _, transform, layers) in cameras.filter(|(_, camera, ..)| camera.is_active) {
            let layers = layers.unwrap_or_default();
            seen = Some(seen.map_or_else(|| layers.clone(), |seen| seen.union(layers)));
            if primary.0 == Some(entity) {
                eye = Some(transform.translation_vec3a());
            }
        }
        Self {
            layers: seen.unwrap_or_default(),
            eye,
        }
    }

    /// Whether something on these layers is seen.
    pub fn see(&self, layers: &RenderLayers) -> bool {
        self.layers.intersects(layers)
    }

    /// Whether a level of detail at `position` is the one that is seen.
    ///
    /// Levels change in the middle of the margins over which Bevy fades one into the next, so that of each
    /// chain there is always exactly one.
    pub fn see_level(&self, range: &VisibilityRange, position: Vec3A) -> bool {
        let middle = |margin: &std::ops::Range<f32>| 0.5 * margin.start + 0.5 * margin.end;
        let distance = self.eye.map_or(0.0, |eye| eye.distance(position));
        (middle(&range.start_margin)..middle(&range.end_margin)).contains(&distance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn viewers<const N: usize>(cameras: [(isize, bool, f32, Option<usize>); N]) -> Viewers {
        let mut index = 0;
        let cameras = cameras.map(|(order, is_active, x, layer)| {
            index += 1;
            let entity = Entity::from_raw_u32(index).unwrap();
            let camera = Camera {
                order,
                is_active,
                ..Default::default()
            };
            let layers = layer.map(RenderLayers::layer);
            let transform = GlobalTransform::from_xyz(x, 0.0, 0.0);
            (entity, camera, transform, layers)
        });
        let primary = PrimaryGiCamera::of(cameras.iter().map(|(e, c, ..)| (*e, c)));
        let cameras = cameras.iter();
        Viewers::new(primary, cameras.map(|(e, c, t, l)| (*e, c, t, l.as_ref())))
    }

    #[test]
    fn layers_are_those_of_all_active_cameras() {
        let viewers = viewers([
            (0, true, 0.0, Some(2)),
            (1, true, 0.0, None),
            (2, false, 0.0, Some(4)),
        ]);
        for (layer, seen) in [(0, true), (2, true), (1, false), (4, false)] {
            assert_eq!(viewers.see(&RenderLayers::layer(layer)), seen, "{layer}");
        }
        assert!(!viewers.see(&RenderLayers::none()));
        assert!(Viewers::default().see(&RenderLayers::default()));
    }

    #[test]
    fn of_each_chain_one_level_is_seen_from_the_primary_camera() {
        let chain = [(0.0, 0.0, 4.0, 6.0), (4.0, 6.0, 20.0, f32::INFINITY)];
        let chain = chain.map(|(a, b, c, d)| VisibilityRange {
            start_margin: a..b,
            end_margin: c..d,
            use_aabb: false,
        });
        for distance in [0.0, 3.9, 4.5, 5.0, 5.5, 7.0, 1e6] {
            let viewers = viewers([(1, true, 0.0, None), (0, true, distance, None)]);
            let seen = chain.each_ref().map(|l| viewers.see_level(l, Vec3A::ZERO));
            assert_eq!(seen, [distance < 5.0, distance >= 5.0], "{distance}");
        }
    }
}
