//! From a plan to a world.

use bevy::prelude::*;
use bevy_gi::prelude::*;

use super::{
    Variant,
    finish::{Finish, Surface},
    lamps::{Lamp, Source},
    plan::Plan,
    solid::Shape,
};
use crate::scenes::{
    foliage::leaves,
    stage::{Stage, shining},
};

/// Voxels along the volume of a random scene.
const RESOLUTION: u32 = 128;

/// Builds a scene, with its volume and its lights.
pub fn spawn(world: &mut World, plan: &Plan) {
    let mut stage = Stage(world);
    // Materials that have been made, by what they are made of.
    let mut made: Vec<(Finish, Handle<StandardMaterial>)> = Vec::new();
    for piece in &plan.pieces {
        let found = made.iter().find(|(finish, _)| *finish == piece.finish);
        let material = match found {
            Some((_, material)) => material.clone(),
            None => {
                let material = material(&mut stage, &piece.finish, plan);
                made.push((piece.finish, material.clone()));
                material
            }
        };
        stage.mesh(mesh(piece.shape), &material, plan.transform(piece));
    }
    for lamp in &plan.lamps {
        light(&mut stage, lamp, &plan.place);
    }
    let (min, max) = plan.bounds();
    stage.0.spawn(GiVolume::around(min, max, RESOLUTION));
}

fn mesh(shape: Shape) -> Mesh {
    match shape {
        Shape::Box(size) => Cuboid::from_size(size).into(),
        Shape::Cylinder { radius, height } => {
            Cylinder::new(radius, height).mesh().resolution(40).build()
        }
        Shape::Sphere(radius) => Sphere::new(radius).mesh().uv(48, 24),
        Shape::Card(size) => Rectangle::from_size(size).into(),
    }
}

fn material(stage: &mut Stage, finish: &Finish, plan: &Plan) -> Handle<StandardMaterial> {
    let [r, g, b] = finish.color;
    let mut material = StandardMaterial {
        base_color: Color::linear_rgb(r, g, b),
        perceptual_roughness: finish.roughness,
        metallic: finish.metallic,
        reflectance: finish.reflectance,
        ..shining(finish.nits, plan.ev100)
    };
    if finish.surface == Surface::Leaves {
        let mut image = leaves();
        if plan.scene.variant == Variant::Furnace {
            whiten(&mut image);
        }
        let image = stage.0.resource_mut::<Assets<Image>>().add(image);
        material.base_color_texture = Some(image);
        material.alpha_mode = AlphaMode::Mask(0.5);
        material.cull_mode = None;
        material.double_sided = true;
    }
    stage.material(material)
}

/// Leaves only what is cut out of a texture: in a furnace, all reflect the same.
fn whiten(image: &mut Image) {
    for texel in image
        .data
        .iter_mut()
        .flat_map(|data| data.chunks_exact_mut(4))
    {
        texel[..3].fill(255);
    }
}

/// How far lights reach, metres: beyond the scene.
const RANGE: f32 = 1000.0;

fn light(stage: &mut Stage, lamp: &Lamp, place: &Transform) {
    let [r, g, b] = lamp.color;
    let color = Color::linear_rgb(r, g, b);
    let at = Transform::from_translation(lamp.at);
    let aimed = |toward: Vec3| {
        let up = if toward.y.abs() > 0.99 {
            Vec3::X
        } else {
            Vec3::Y
        };
        *place * at.looking_to(toward, up)
    };
    match lamp.source {
        Source::Bulb { lumens } => {
            let light = PointLight {
                color,
                intensity: lumens,
                range: RANGE,
                shadow_maps_enabled: true,
                ..default()
            };
            stage.0.spawn((light, *place * at));
        }
        Source::Spot {
            lumens,
            inner,
            outer,
            toward,
        } => {
            let light = SpotLight {
                color,
                intensity: lumens,
                range: RANGE,
                shadow_maps_enabled: true,
                inner_angle: inner,
                outer_angle: outer,
                ..default()
            };
            stage.0.spawn((light, aimed(toward)));
        }
        Source::Rect {
            lumens,
            size,
            toward,
        } => {
            let light = RectLight {
                color,
                intensity: lumens,
                range: RANGE,
                width: size.x,
                height: size.y,
            };
            stage.0.spawn((light, aimed(toward)));
        }
        Source::Sun { lux, toward } => {
            let light = DirectionalLight {
                color,
                illuminance: lux,
                shadow_maps_enabled: true,
                ..default()
            };
            stage.0.spawn((light, aimed(toward)));
        }
    }
}
