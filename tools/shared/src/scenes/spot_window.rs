//! A dark room into which a spot, as strong as evening sun, shines through a window.

use bevy::prelude::*;

use super::{Content, Scene, SceneView, stage::Stage};

pub const SCENE: Scene = Scene {
    name: "spot_window",
    about: "a dark room with a window, and a spot outside: a patch of light feeds all of it",
    content: Content::Built(spawn),
    view,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(-2.6, 1.65, 1.9),
        look: Vec3::new(1.6, 1.0, -0.9),
        fov: 62.0,
        ev100: 5.4,
        speed: 2.0,
    }
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let plaster = stage.paint([0.72, 0.7, 0.66]);
    let boards = stage.paint([0.5, 0.32, 0.18]);
    let green = stage.paint([0.2, 0.34, 0.22]);
    let (min, max) = (Vec3::new(-3.0, 0.0, -2.2), Vec3::new(3.0, 2.7, 2.2));
    let w = 0.3;
    let (lo, hi) = (min - w, max + w);
    let mut wall = |a: [f32; 3], b: [f32; 3], paint| {
        stage.slab(a.into(), b.into(), paint);
    };
    wall(lo.into(), [hi.x, 0.0, hi.z], &boards);
    wall([lo.x, max.y, lo.z], hi.into(), &plaster);
    wall([lo.x, 0.0, lo.z], [hi.x, max.y, min.z], &plaster);
    wall([lo.x, 0.0, max.z], [hi.x, max.y, hi.z], &plaster);
    wall([lo.x, 0.0, min.z], [min.x, max.y, max.z], &green);
    // The wall with the window.
    let (sill, lintel, left, right) = (0.9, 2.2, -0.8, 0.9);
    wall([max.x, 0.0, min.z], [hi.x, max.y, left], &plaster);
    wall([max.x, 0.0, right], [hi.x, max.y, max.z], &plaster);
    wall([max.x, 0.0, left], [hi.x, sill, right], &plaster);
    wall([max.x, lintel, left], [hi.x, max.y, right], &plaster);
    // Its cross.
    wall(
        [max.x + 0.1, sill, 0.01],
        [max.x + 0.18, lintel, 0.09],
        &plaster,
    );

    let table = Vec3::new(1.3, 0.06, 0.7);
    let at = Vec3::new(0.2, 0.74, -1.2);
    stage.slab(at - 0.5 * table, at + 0.5 * table, &boards);
    for (x, z) in [(-0.55, -0.28), (0.55, -0.28), (-0.55, 0.28), (0.55, 0.28)] {
        let foot = Vec3::new(at.x + x, 0.0, at.z + z);
        stage.slab(
            foot - Vec3::new(0.04, 0.0, 0.04),
            foot + Vec3::new(0.04, at.y, 0.04),
            &boards,
        );
    }
    stage.mesh(
        Sphere::new(0.18).mesh().uv(48, 24),
        &plaster,
        Transform::from_xyz(0.0, 0.95, -1.2),
    );
    stage.block(Vec2::new(2.3, -1.7), Vec3::new(0.8, 1.9, 0.5), 0.0, &green);

    let lamp = Transform::from_xyz(7.5, 4.9, 1.3).looking_at(Vec3::new(0.6, 0.0, -0.2), Vec3::Y);
    stage.0.spawn((
        SpotLight {
            intensity: 60_000.0 * 4.0 * std::f32::consts::PI,
            range: 1000.0,
            shadow_maps_enabled: true,
            inner_angle: 0.3,
            outer_angle: 0.4,
            ..default()
        },
        lamp,
    ));
    stage.volume(lo, hi);
}
