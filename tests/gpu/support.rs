//! A scene in a few lines, and figures of its picture.

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    ecs::system::RunSystemOnce,
    prelude::*,
    render::render_resource::TextureFormat,
};
use bevy_gi::prelude::*;

use crate::common::{
    headless::{Headless, Picture, image_target},
    scenes::cornell,
};

/// With this exposure, a nit is 1 in the HDR target.
pub const UNIT_EV100: f32 = -0.263_034;

/// A headless app with the plugin, no ambient light, and emission in nits.
pub fn app() -> Headless {
    Headless::new(|app| {
        app.add_plugins(GiPlugins)
            .insert_resource(ClearColor(Color::BLACK))
            .insert_resource(GlobalAmbientLight::NONE)
            .insert_resource(GiSettings {
                replace_ambient: true,
                sky: GiSky::Black,
                emissive_units: bevy_gi::EmissiveUnits::Nits,
                ..default()
            });
    })
}

/// A camera whose picture is in nits.
pub fn camera(
    headless: &mut Headless,
    size: UVec2,
    eye: Vec3,
    look: Vec3,
    fov: f32,
) -> (Entity, Handle<Image>) {
    let target = headless.target(size, TextureFormat::Rgba32Float);
    let up = if (look - eye).normalize().y.abs() > 0.99 {
        Vec3::Z
    } else {
        Vec3::Y
    };
    let camera = headless
        .app
        .world_mut()
        .spawn((
            Camera3d::default(),
            GiCamera::default(),
            image_target(&target),
            Tonemapping::None,
            DebandDither::Disabled,
            Exposure { ev100: UNIT_EV100 },
            Projection::from(PerspectiveProjection {
                fov: fov.to_radians(),
                near: 0.05,
                ..default()
            }),
            Transform::from_translation(eye).looking_at(look, up),
        ))
        .id();
    (camera, target)
}

/// A box of a material.
pub fn slab(
    headless: &mut Headless,
    min: Vec3,
    max: Vec3,
    material: &Handle<StandardMaterial>,
) -> Entity {
    let world = headless.app.world_mut();
    let mesh = world
        .resource_mut::<Assets<Mesh>>()
        .add(Cuboid::from_size(max - min));
    world
        .spawn((
            Mesh3d(mesh),
            MeshMaterial3d(material.clone()),
            Transform::from_translation(0.5 * (min + max)),
        ))
        .id()
}

/// Six slabs around the inside of `min..max`.
pub fn room(
    headless: &mut Headless,
    min: Vec3,
    max: Vec3,
    wall: f32,
    material: &Handle<StandardMaterial>,
) {
    let (lo, hi) = (min - wall, max + wall);
    for axis in 0..3 {
        let mut below = hi;
        below[axis] = min[axis];
        slab(headless, lo, below, material);
        let mut above = lo;
        above[axis] = max[axis];
        slab(headless, above, hi, material);
    }
}

pub fn material(headless: &mut Headless, material: StandardMaterial) -> Handle<StandardMaterial> {
    headless
        .app
        .world_mut()
        .resource_mut::<Assets<StandardMaterial>>()
        .add(material)
}

/// Waits until everything is loaded, starts history afresh, and renders `frames`.
pub fn settle(headless: &mut Headless, frames: u32) {
    assert!(headless.wait_until(|_| true), "pipelines are compiled");
    assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
    headless.app.world_mut().resource_mut::<GiHistory>().reset();
    headless.steps(frames);
}

pub fn luminance(p: &[f32; 4]) -> f32 {
    0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]
}

pub fn mean(picture: &Picture) -> f32 {
    picture.pixels.iter().map(luminance).sum::<f32>() / picture.pixels.len() as f32
}

/// No NaN, no infinity, nothing negative.
pub fn assert_sane(picture: &Picture, what: &str) {
    for (i, p) in picture.pixels.iter().enumerate() {
        let fine = p[..3].iter().all(|c| c.is_finite() && *c >= 0.0);
        assert!(fine, "{what}: pixel {i} is {p:?}");
    }
}

/// The Cornell box of the examples.
pub fn spawn_cornell(headless: &mut Headless) {
    headless
        .app
        .world_mut()
        .run_system_once(
            |mut commands: Commands,
             mut meshes: ResMut<Assets<Mesh>>,
             mut materials: ResMut<Assets<StandardMaterial>>| {
                cornell::spawn(&mut commands, &mut meshes, &mut materials);
            },
        )
        .expect("the app has meshes and materials");
}
