//! A court under an overcast sky, with an arcade along two sides.

use bevy::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "sky_court",
    about: "a court with arcades under an overcast sky: all light is the sky's",
    content: Content::Built(spawn),
    view,
    sky: Some([2600.0, 3000.0, 3600.0]),
    quick: true,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(4.9, 1.7, 4.6),
        look: Vec3::new(-2.6, 1.5, -3.0),
        fov: 60.0,
        ev100: 10.6,
        speed: 4.0,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let stone = stage.paint([0.62, 0.56, 0.46]);
    let paving = stage.paint([0.4, 0.38, 0.35]);
    let red = stage.paint([0.55, 0.12, 0.08]);
    let green = stage.paint([0.1, 0.28, 0.12]);
    let half = 5.5;
    let (height, w) = (4.2, 0.4);
    stage.slab(
        Vec3::new(-half - w, -0.4, -half - w),
        Vec3::new(half + w, 0.0, half + w),
        &paving,
    );
    for (min, max) in [
        ([-half - w, 0.0, -half - w], [half + w, height, -half]),
        ([-half - w, 0.0, half], [half + w, height, half + w]),
        ([-half - w, 0.0, -half], [-half, height, half]),
        ([half, 0.0, -half], [half + w, height, half]),
    ] {
        stage.slab(min.into(), max.into(), &stone);
    }
    // The arcade: a deck over the back and the left side, on pillars.
    let depth = 2.2;
    let (deck, thickness) = (2.7, 0.3);
    stage.slab(
        Vec3::new(-half, deck, -half),
        Vec3::new(half, deck + thickness, -half + depth),
        &stone,
    );
    stage.slab(
        Vec3::new(-half, deck, -half + depth),
        Vec3::new(-half + depth, deck + thickness, half),
        &stone,
    );
    let mut pillar = |x: f32, z: f32| {
        let r = 0.2;
        stage.slab(
            Vec3::new(x - r, 0.0, z - r),
            Vec3::new(x + r, deck, z + r),
            &stone,
        );
    };
    let inner = -half + depth - 0.25;
    for i in 0..4 {
        pillar(inner + i as f32 * 2.6, inner);
    }
    for i in 1..4 {
        pillar(inner, inner + i as f32 * 2.6);
    }
    // Doors at the back, a bench, a tree of two balls.
    stage.slab(
        Vec3::new(-0.9, 0.0, -half),
        Vec3::new(0.3, 2.1, -half + 0.08),
        &red,
    );
    stage.block(Vec2::new(0.6, -0.6), Vec3::new(1.8, 0.45, 0.5), 30.0, &red);
    stage.mesh(
        Cylinder::new(0.12, 1.2),
        &stone,
        Transform::from_xyz(2.9, 0.6, -1.6),
    );
    for (x, y, z, r) in [(2.9, 1.6, -1.6, 0.75), (3.2, 2.2, -1.4, 0.5)] {
        let ball = Sphere::new(r).mesh().uv(48, 24);
        stage.mesh(ball, &green, Transform::from_xyz(x, y, z));
    }
    let reach = half + w;
    stage.volume(
        Vec3::new(-reach, -0.4, -reach),
        Vec3::new(reach, height, reach),
    );
}
