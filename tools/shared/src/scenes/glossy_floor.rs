//! A polished floor that reflects what stands on it, lit by a strip light.

use bevy::prelude::*;
use bevy_gi::GiTechnique;

use super::{
    Content, Scene, SceneView,
    stage::{Stage, diffuse},
};

pub const SCENE: Scene = Scene {
    name: "glossy_floor",
    about: "a hall with a polished floor and a brushed column: specular light from all around",
    content: Content::Built(spawn),
    view,
    // Hints know no reflections in what is polished.
    technique: Some(GiTechnique::new("vct")),
    quick: true,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(0.3, 1.5, 4.4),
        look: Vec3::new(0.0, 0.75, -1.0),
        fov: 52.0,
        ev100: 5.6,
        speed: 2.5,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let wall = stage.paint([0.7, 0.68, 0.64]);
    let (min, max) = (Vec3::new(-3.5, 0.0, -3.5), Vec3::new(3.5, 3.2, 5.0));
    stage.room(min, max, 0.3, &wall);
    let polished = stage.material(StandardMaterial {
        perceptual_roughness: 0.3,
        reflectance: 0.8,
        ..diffuse([0.06, 0.055, 0.05])
    });
    stage.slab(min, Vec3::new(max.x, 0.06, max.z), &polished);
    let back = stage.paint([0.55, 0.12, 0.08]);
    stage.slab(
        Vec3::new(min.x, 0.06, min.z),
        Vec3::new(max.x, max.y, min.z + 0.08),
        &back,
    );
    let metal = stage.material(StandardMaterial {
        perceptual_roughness: 0.4,
        metallic: 1.0,
        reflectance: 0.5,
        ..diffuse([0.9, 0.7, 0.4])
    });
    let blue = stage.paint([0.1, 0.22, 0.55]);
    let white = stage.paint([0.8, 0.8, 0.78]);
    stage.mesh(
        Cylinder::new(0.45, 2.2).mesh().resolution(64),
        &metal,
        Transform::from_xyz(-1.7, 1.16, -1.2),
    );
    stage.block(Vec2::new(1.5, -1.3), Vec3::new(1.0, 1.5, 1.0), 25.0, &blue);
    stage.mesh(
        Sphere::new(0.45).mesh().uv(64, 32),
        &white,
        Transform::from_xyz(0.1, 0.51, 0.2),
    );
    stage.bulb(Vec3::new(0.6, 2.8, 1.0), 700.0);
    stage.volume(min - 0.3, max + 0.3);
}
