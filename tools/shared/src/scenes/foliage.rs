//! A hedge of leaves cut out by an alpha mask, before a wall in the sun.

use bevy::{
    asset::RenderAssetUsages,
    light::CascadeShadowConfigBuilder,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};

use super::{
    Content, Scene, SceneView,
    stage::{Stage, diffuse},
};

pub const SCENE: Scene = Scene {
    name: "foliage",
    about: "a wall of masked leaves in sun and sky: light that comes through gaps",
    content: Content::Built(spawn),
    view,
    sky: Some([1500.0, 2100.0, 3200.0]),
    ..Scene::PLAIN
};

fn view() -> SceneView {
    SceneView {
        eye: Vec3::new(2.6, 1.6, 3.4),
        look: Vec3::new(-0.4, 0.9, -0.6),
        fov: 52.0,
        ev100: 12.6,
        speed: 2.0,
    }
}

/// Leaves on nothing: ellipses at places and angles of a fixed sequence, green with lighter veins.
pub fn leaves() -> Image {
    const SIZE: u32 = 256;
    let mut texels = vec![[40u8, 70, 24, 0]; (SIZE * SIZE) as usize];
    // A full-period sequence: the golden ratio's fractions.
    let fraction = |i: u32, k: f32| (i as f32 * k).fract();
    for i in 0..330 {
        let center = Vec2::new(fraction(i, 0.618_034), fraction(i, 0.754_877_7)) * SIZE as f32;
        let axis = Vec2::from_angle(fraction(i, 0.569_840_3) * std::f32::consts::TAU);
        let shade = 0.7 + 0.5 * fraction(i, 0.381_966);
        let (long, wide) = (11.0, 5.0);
        for y in -12i32..=12 {
            for x in -12i32..=12 {
                let d = Vec2::new(x as f32, y as f32);
                let along = d.dot(axis) / long;
                let across = d.perp_dot(axis) / wide;
                if along * along + across.abs().powf(1.5) > 1.0 {
                    continue;
                }
                let vein = if across.abs() < 0.2 { 1.35 } else { 1.0 };
                let wrap = |v: f32| (v as i32).rem_euclid(SIZE as i32) as u32;
                let at = (wrap(center.y + d.y), wrap(center.x + d.x));
                let color = Vec3::new(72.0, 118.0, 36.0) * shade * vein;
                let [r, g, b] = color.to_array().map(|c| c.min(255.0) as u8);
                texels[(at.0 * SIZE + at.1) as usize] = [r, g, b, 255];
            }
        }
    }
    Image::new(
        Extent3d {
            width: SIZE,
            height: SIZE,
            depth_or_array_layers: 1,
        },
        TextureDimension::D2,
        texels.concat(),
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::default(),
    )
}

fn spawn(world: &mut World) {
    let mut stage = Stage(world);
    let wall = stage.paint([0.7, 0.62, 0.5]);
    let paving = stage.paint([0.42, 0.4, 0.37]);
    let texture = stage.0.resource_mut::<Assets<Image>>().add(leaves());
    let leaf = stage.material(StandardMaterial {
        base_color_texture: Some(texture),
        alpha_mode: AlphaMode::Mask(0.5),
        cull_mode: None,
        double_sided: true,
        ..diffuse([1.0; 3])
    });
    let (min, max) = (Vec3::new(-3.4, -0.3, -2.3), Vec3::new(3.4, 2.6, 2.4));
    stage.slab(min, Vec3::new(max.x, 0.0, max.z), &paving);
    stage.slab(
        Vec3::new(min.x, 0.0, min.z),
        Vec3::new(max.x, max.y, -2.0),
        &wall,
    );
    stage.slab(
        Vec3::new(min.x, 0.0, -2.0),
        Vec3::new(-3.1, max.y, 1.0),
        &wall,
    );
    // The hedge: sheets of leaves behind one another, of many heights, each turned a little.
    for i in 0..18 {
        let (row, column) = (i / 3, i % 3);
        let size = Vec2::new(1.3, 1.15 + 0.11 * ((i * 7) % 5) as f32);
        let x = -2.2 + 1.05 * column as f32 + 0.3 * (row % 2) as f32;
        let z = -0.55 + 0.16 * row as f32;
        let at = Transform::from_xyz(x, 0.5 * size.y, z).with_rotation(Quat::from_rotation_y(
            0.5 * ((i * 3) % 7) as f32 / 7.0 - 0.25,
        ));
        stage.mesh(Rectangle::from_size(size), &leaf, at);
    }
    // Something white behind it and beside it.
    let white = stage.paint([0.8, 0.8, 0.78]);
    stage.block(Vec2::new(1.9, -1.0), Vec3::new(0.8, 1.2, 0.8), 20.0, &white);
    stage.mesh(
        Sphere::new(0.4).mesh().uv(48, 24),
        &white,
        Transform::from_xyz(1.4, 0.4, 0.9),
    );
    stage.0.spawn((
        DirectionalLight {
            illuminance: 60_000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        CascadeShadowConfigBuilder {
            maximum_distance: 20.0,
            ..default()
        }
        .build(),
        Transform::default().looking_to(Vec3::new(-0.45, -1.0, -0.62), Vec3::Y),
    ));
    stage.volume(min, max);
}
