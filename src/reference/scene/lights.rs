//! Lights of the world.

use std::f32::consts::PI;

use bevy::{
    camera::visibility::{InheritedVisibility, RenderLayers},
    color::{Color, ColorToComponents},
    ecs::prelude::*,
    light::{DirectionalLight, PointLight, RectLight, SpotLight},
    math::Vec3,
    transform::components::GlobalTransform,
};

use crate::{reference::lights::Light, scene::world::viewers::Viewers};

/// Lights of all kinds, with their render layers.
pub(super) fn lights(world: &mut World, viewers: &Viewers) -> Vec<(Light, RenderLayers)> {
    let linear = |color: Color| color.to_linear().to_vec3();
    // Bevy divides the lumens of points and spots alike by the whole sphere.
    let candela = |color, lumens: f32| linear(color) * lumens / (4.0 * PI);
    let mut lights = Vec::new();
    collect(
        world,
        viewers,
        &mut lights,
        |light: &DirectionalLight, transform| Light::Directional {
            lux: linear(light.color) * light.illuminance,
            direction: transform.forward().into(),
        },
    );
    collect(
        world,
        viewers,
        &mut lights,
        |light: &PointLight, transform| Light::Point {
            position: transform.translation(),
            candela: candela(light.color, light.intensity),
            range: light.range,
            spot: None,
        },
    );
    collect(
        world,
        viewers,
        &mut lights,
        |light: &SpotLight, transform| Light::Point {
            position: transform.translation(),
            candela: candela(light.color, light.intensity),
            range: light.range,
            spot: Some((
                transform.forward().into(),
                light.inner_angle.cos(),
                light.outer_angle.cos(),
            )),
        },
    );
    collect(
        world,
        viewers,
        &mut lights,
        |light: &RectLight, transform| {
            let matrix = transform.affine().matrix3;
            let half = [
                Vec3::from(matrix.x_axis) * light.width * 0.5,
                Vec3::from(matrix.y_axis) * light.height * 0.5,
            ];
            let area = 4.0 * half[0].length() * half[1].length();
            Light::Rect {
                center: transform.translation(),
                half,
                normal: transform.forward().into(),
                nits: linear(light.color) * light.intensity / (PI * area.max(1e-12)),
                range: light.range,
            }
        },
    );
    lights
}

/// The lights of one of Bevy's kinds that are seen.
fn collect<L: Component>(
    world: &mut World,
    viewers: &Viewers,
    lights: &mut Vec<(Light, RenderLayers)>,
    convert: impl Fn(&L, &GlobalTransform) -> Light,
) {
    type Seen<'a, L> = (
        &'a L,
        &'a GlobalTransform,
        &'a InheritedVisibility,
        Option<&'a RenderLayers>,
    );
    let mut query = world.query::<Seen<L>>();
    for (light, transform, visible, layers) in query.iter(world) {
        let layers = layers.unwrap_or_default();
        if visible.get() && viewers.see(layers) {
            lights.push((convert(light, transform), layers.clone()));
        }
    }
}
