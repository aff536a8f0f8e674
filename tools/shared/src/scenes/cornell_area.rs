//! The Cornell box lit as the original is: by a patch of the ceiling that shines.

use bevy::prelude::*;

use super::{
    Content, Scene, SceneView, cornell,
    stage::{Stage, shining},
};

pub const SCENE: Scene = Scene {
    name: "cornell_area",
    about: "the Cornell box under a patch that shines: all light on its walls is indirect",
    content: Content::Built(spawn),
    view,
    quick: true,
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        ev100: 5.2,
        ..cornell::view()
    }
}

fn spawn(world: &mut World) {
    cornell::spawn_box(world);
    let mut stage = Stage(world);
    let lamp = stage.material(shining([900.0, 780.0, 560.0], view().ev100));
    // As large as in the data, a centimetre below the ceiling.
    let at =
        Transform::from_xyz(0.0, 2.0 * cornell::HALF.y - 0.01, 0.0).looking_to(Vec3::Y, Vec3::Z);
    stage.mesh(Rectangle::new(1.3, 1.05), &lamp, at);
}
