//! A room without lamps: panels, tubes and a ball that shine.

use bevy::prelude::*;

use super::{
    Content, Scene, SceneView,
    stage::{Stage, shining},
};

pub const SCENE: Scene = Scene {
    name: "emissive",
    about: "a room lit by surfaces that shine alone, large and small",
    content: Content::Built(spawn),
    view,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(2.7, 1.7, 2.7),
        look: Vec3::new(-0.8, 1.0, -1.2),
        fov: 60.0,
        ev100: 4.4,
        speed: 2.0,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let wall = stage.paint([0.6, 0.6, 0.62]);
    let floor = stage.paint([0.3, 0.3, 0.32]);
    let white = stage.paint([0.8, 0.8, 0.8]);
    let (min, max) = (Vec3::new(-3.0, 0.0, -3.0), Vec3::new(3.0, 2.8, 3.0));
    stage.room(min, max, 0.3, &wall);
    stage.slab(min, Vec3::new(max.x, 0.04, max.z), &floor);

    let magenta = stage.material(shining([260.0, 20.0, 150.0], view().ev100));
    let cyan = stage.material(shining([10.0, 170.0, 230.0], view().ev100));
    let warm = stage.material(shining([600.0, 380.0, 160.0], view().ev100));
    // A panel on the back wall, a tube along the left one, a ball on the floor.
    stage.slab(
        Vec3::new(-1.9, 0.9, -3.0),
        Vec3::new(-0.3, 1.9, -2.92),
        &magenta,
    );
    stage.slab(
        Vec3::new(-3.0, 2.45, -2.4),
        Vec3::new(-2.88, 2.57, 2.4),
        &cyan,
    );
    stage.mesh(
        Sphere::new(0.22).mesh().uv(48, 24),
        &warm,
        Transform::from_xyz(1.0, 0.26, -1.3),
    );

    stage.block(
        Vec2::new(-1.7, -1.0),
        Vec3::new(0.9, 1.1, 0.9),
        24.0,
        &white,
    );
    stage.block(
        Vec2::new(1.9, -2.1),
        Vec3::new(0.7, 1.8, 0.7),
        -12.0,
        &white,
    );
    stage.mesh(
        Sphere::new(0.5).mesh().uv(48, 24),
        &white,
        Transform::from_xyz(0.0, 0.54, 0.3),
    );
    stage.volume(min - 0.3, max + 0.3);
}
