//! Whatever is thrown at it: no panic, no NaN.

use bevy::{
    asset::RenderAssetUsages,
    camera::Viewport,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
    render::render_resource::TextureFormat,
};
use bevy_gi::prelude::*;

use crate::{
    common::{headless::image_target, scenes::stage::diffuse},
    support::{app, assert_sane, camera, luminance, material, room, settle, slab},
};

#[test]
fn nothing_panics_and_nothing_is_nan() {
    let mut headless = app();
    let white = material(&mut headless, diffuse([0.7; 3]));
    room(
        &mut headless,
        Vec3::splat(-2.0),
        Vec3::splat(2.0),
        0.3,
        &white,
    );
    let (gi_camera, target) = camera(
        &mut headless,
        UVec2::new(64, 48),
        Vec3::new(0.0, 0.0, 1.8),
        Vec3::ZERO,
        70.0,
    );
    let light = headless
        .app
        .world_mut()
        .spawn((
            PointLight {
                intensity: 2000.0,
                range: 50.0,
                shadow_maps_enabled: true,
                ..default()
            },
            Transform::from_xyz(0.5, 1.0, 0.5),
        ))
        .id();
    let volume = headless
        .app
        .world_mut()
        .spawn(GiVolume::new(Vec3::splat(5.0)).with_resolution(32))
        .id();
    settle(&mut headless, 6);
    let check = |headless: &mut crate::common::headless::Headless, what: &str| {
        headless.steps(3);
        let picture = headless.picture(&target);
        assert_sane(&picture, what);
        assert_eq!(headless.pipeline_errors(), Vec::<String>::new(), "{what}");
        picture.pixels.iter().map(|p| luminance(p)).sum::<f32>()
    };
    assert!(check(&mut headless, "the plain room") > 0.0);

    // Volumes.
    for extent in [
        Vec3::NAN,
        Vec3::ZERO,
        Vec3::INFINITY,
        Vec3::splat(-3.0),
        Vec3::new(5.0, 1e-9, 5.0),
    ] {
        headless
            .app
            .world_mut()
            .get_mut::<GiVolume>(volume)
            .unwrap()
            .extent = extent;
        check(&mut headless, &format!("extent {extent}"));
    }
    headless
        .app
        .world_mut()
        .entity_mut(volume)
        .insert(GiVolume::new(Vec3::splat(5.0)));
    for resolution in [0, 1] {
        headless
            .app
            .world_mut()
            .get_mut::<GiVolume>(volume)
            .unwrap()
            .resolution = resolution;
        check(&mut headless, &format!("resolution {resolution}"));
        let clamped = headless
            .app
            .world()
            .get::<GiVolume>(volume)
            .unwrap()
            .resolution;
        assert_eq!(clamped, 32);
    }
    for transform in [
        Transform::from_translation(Vec3::NAN),
        Transform::from_scale(Vec3::ZERO),
        Transform::from_xyz(1e30, 0.0, 0.0),
        Transform::default(),
    ] {
        headless
            .app
            .world_mut()
            .entity_mut(volume)
            .insert(transform);
        check(&mut headless, "a strange transform of the volume");
    }

    // Settings.
    {
        let world = headless.app.world_mut();
        let mut camera = world.get_mut::<GiCamera>(gi_camera).unwrap();
        camera.strength = f32::NAN;
        camera.history_frames = 0;
        world.resource_mut::<GiCaptureSettings>().shadow_map_size = 1;
        let mut gi = world.resource_mut::<GiSettings>();
        gi.sky = GiSky::Constant(LinearRgba::rgb(f32::NAN, -1.0, f32::INFINITY));
        let mut vct = world.resource_mut::<VoxelConeTracingSettings>();
        vct.cones = 0;
        vct.step = f32::NAN;
        vct.cone_angle = 1e9;
        vct.bias = f32::NEG_INFINITY;
        vct.diffuse_steps = u32::MAX;
    }
    check(&mut headless, "settings out of range");
    let world = headless.app.world();
    let clamped = world.get::<GiCamera>(gi_camera).unwrap();
    assert_eq!((clamped.strength, clamped.history_frames), (0.0, 1));
    assert_eq!(world.resource::<GiCaptureSettings>().shadow_map_size, 64);
    headless
        .app
        .world_mut()
        .insert_resource(VoxelConeTracingSettings::default());
    headless.app.world_mut().resource_mut::<GiSettings>().sky = GiSky::Black;

    // Meshes: no normals or uvs, no triangles, lost in space, see-through, gone.
    let bare = Mesh::new(
        PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    )
    .with_inserted_attribute(
        Mesh::ATTRIBUTE_POSITION,
        vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    );
    let degenerate = bare
        .clone()
        .with_inserted_indices(Indices::U32(vec![0, 0, 0]));
    for mesh in [bare, degenerate] {
        let mesh = headless
            .app
            .world_mut()
            .resource_mut::<Assets<Mesh>>()
            .add(mesh);
        headless
            .app
            .world_mut()
            .spawn((Mesh3d(mesh), MeshMaterial3d(white.clone())));
        check(&mut headless, "a bare mesh");
    }
    let lost = slab(&mut headless, Vec3::ZERO, Vec3::ONE, &white);
    for transform in [
        Transform::from_translation(Vec3::NAN),
        Transform::from_scale(Vec3::ZERO),
    ] {
        headless.app.world_mut().entity_mut(lost).insert(transform);
        check(&mut headless, "a mesh with a strange transform");
    }
    headless.app.world_mut().despawn(lost);
    check(&mut headless, "a mesh that is gone");

    // Lights that change, break and vanish.
    let share = GiLight {
        intensity: f32::NAN,
        rsm_size: 7,
        rsm_interval: 0,
        ..default()
    };
    headless.app.world_mut().entity_mut(light).insert(share);
    check(&mut headless, "a light that bounces NaN times its light");
    headless.app.world_mut().despawn(light);
    for directional in [true, false] {
        if directional {
            headless.app.world_mut().spawn((
                DirectionalLight::default(),
                GiLight {
                    intensity: 1e9,
                    ..default()
                },
            ));
        } else {
            headless
                .app
                .world_mut()
                .spawn((SpotLight::default(), Transform::from_xyz(0.0, 1.0, 0.0)));
            headless
                .app
                .world_mut()
                .spawn((RectLight::default(), Transform::from_xyz(0.0, 1.5, 0.0)));
        }
        check(&mut headless, "lights that come");
    }

    // Cameras: a second one, a viewport, another size, gone.
    let (_, other) = camera(&mut headless, UVec2::new(33, 17), Vec3::ZERO, Vec3::X, 90.0);
    check(&mut headless, "two cameras");
    assert_sane(&headless.picture(&other), "the second camera");
    headless
        .app
        .world_mut()
        .get_mut::<Camera>(gi_camera)
        .unwrap()
        .viewport = Some(Viewport {
        physical_position: UVec2::new(10, 7),
        physical_size: UVec2::new(31, 29),
        ..default()
    });
    check(&mut headless, "a viewport");
    headless
        .app
        .world_mut()
        .get_mut::<Camera>(gi_camera)
        .unwrap()
        .viewport = None;
    headless.app.world_mut().entity_mut(volume).despawn();
    check(&mut headless, "no volume");
    headless
        .app
        .world_mut()
        .spawn(GiVolume::new(Vec3::splat(5.0)).with_resolution(32));
    headless.app.world_mut().spawn((
        GiVolume::new(Vec3::splat(9.0)).following_camera(),
        Transform::default(),
    ));
    check(&mut headless, "two volumes, one following");
    headless
        .app
        .world_mut()
        .entity_mut(gi_camera)
        .remove::<GiCamera>();
    headless.steps(3);
    headless
        .app
        .world_mut()
        .entity_mut(gi_camera)
        .insert(GiCamera::default());
    assert!(check(&mut headless, "the component taken away and given back") > 0.0);
    let small = headless.target(UVec2::ONE, TextureFormat::Rgba32Float);
    headless
        .app
        .world_mut()
        .entity_mut(gi_camera)
        .insert(image_target(&small));
    headless.steps(3);
    assert_sane(&headless.picture(&small), "a picture of one pixel");
    headless.app.world_mut().despawn(gi_camera);
    headless.steps(3);
}
