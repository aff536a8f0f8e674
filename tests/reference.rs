//! The path tracer against closed forms, against itself, and against another path tracer.

use std::{
    f32::consts::PI,
    path::Path,
    sync::{Arc, atomic::AtomicBool},
};

use bevy::{
    asset::RenderAssetUsages,
    camera::{
        CameraProjection,
        visibility::{InheritedVisibility, RenderLayers, VisibilityRange},
    },
    light::Skybox,
    mesh::PrimitiveTopology,
    prelude::*,
    render::render_resource::{Extent3d, Face, TextureDimension, TextureFormat},
};
use bevy_gi::{
    EmissiveUnits,
    prelude::*,
    reference::{
        DiffuseModel, Reference, ReferenceCamera, ReferenceScene, ReferenceSettings, ReferenceView,
        SpecularModel,
    },
};
use bevy_gi_tools::{
    capture::read_exr,
    scenes::{cornell, stage::diffuse},
};

const LAMBERT: ReferenceSettings = ReferenceSettings {
    max_bounces: 64,
    seed: 0,
    diffuse: DiffuseModel::Lambert,
    specular: SpecularModel::Bevy,
    show_sky: true,
};

/// A world without a renderer.
fn world() -> World {
    let mut world = World::new();
    world.init_resource::<Assets<Mesh>>();
    world.init_resource::<Assets<StandardMaterial>>();
    world.init_resource::<Assets<Image>>();
    world.insert_resource(GiSettings {
        sky: GiSky::Black,
        emissive_units: EmissiveUnits::Nits,
        ..default()
    });
    world
}

fn add<A: Asset>(world: &mut World, asset: A) -> Handle<A> {
    world.resource_mut::<Assets<A>>().add(asset)
}

fn mesh(world: &mut World, mesh: impl Into<Mesh>, material: StandardMaterial, at: Transform) {
    let mesh = add(world, mesh.into());
    let material = add(world, material);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(material), at));
}

/// What the plugins and systems of an app would do.
fn settle(world: &mut World) {
    let mut query = world.query::<(Entity, &Transform)>();
    let placed: Vec<_> = query.iter(world).map(|(e, t)| (e, *t)).collect();
    for (entity, transform) in placed {
        world.entity_mut(entity).insert((
            GlobalTransform::from(transform),
            InheritedVisibility::VISIBLE,
        ));
    }
}

fn camera(eye: Vec3, look: Vec3, fov: f32, size: UVec2) -> ReferenceCamera {
    let up = if (look - eye).normalize().y.abs() > 0.99 {
        Vec3::X
    } else {
        Vec3::Y
    };
    let mut projection = PerspectiveProjection {
        fov: fov.to_radians(),
        near: 0.001,
        ..default()
    };
    projection.update(size.x as f32, size.y as f32);
    ReferenceCamera {
        world_from_view: Transform::from_translation(eye)
            .looking_at(look, up)
            .to_matrix(),
        clip_from_view: projection.get_clip_from_view(),
    }
}

fn render(
    world: &mut World,
    camera: ReferenceCamera,
    size: UVec2,
    samples: u32,
    settings: ReferenceSettings,
) -> Reference {
    settle(world);
    let scene = Arc::new(ReferenceScene::new(world));
    assert_eq!(scene.warnings(), &[] as &[String]);
    let mut reference = Reference::new(scene, camera, size, settings);
    reference.render(samples, &AtomicBool::new(false), || {});
    reference
}

fn mean(values: &[Vec3]) -> f32 {
    values.iter().map(|v| v.element_sum() / 3.0).sum::<f32>() / values.len() as f32
}

/// Nits of a spot of a floor at the origin, seen from above beside whatever hangs there.
fn floor_nits(world: &mut World, view: ReferenceView, samples: u32) -> f32 {
    let size = UVec2::splat(8);
    let camera = camera(Vec3::new(0.4, 0.4, 0.0), Vec3::ZERO, 0.2, size);
    mean(&render(world, camera, size, samples, LAMBERT).picture(view))
}

const ALBEDO: f32 = 0.8;

fn floor(world: &mut World) {
    mesh(
        world,
        Plane3d::new(Vec3::Y, Vec2::splat(1.0)),
        diffuse([ALBEDO; 3]),
        default(),
    );
}

fn shining(nits: f32) -> StandardMaterial {
    StandardMaterial {
        emissive: LinearRgba::rgb(nits, nits, nits),
        ..diffuse([0.0; 3])
    }
}

fn assert_near(value: f32, truth: f32, tolerance: f32, what: &str) {
    println!("{what}: {value:.5}, truth {truth:.5}");
    assert!(
        (value / truth - 1.0).abs() < tolerance,
        "{what}: {value}, truth {truth}"
    );
}

/// A closed room of albedo 1/2 that shines with 1 nit: 1 + 1/2 + 1/4 + ... = 2 nits everywhere. With
/// Bevy's diffuse lobe too, at the roughness at which it reflects as much as Lambert's.
#[test]
fn furnace_has_two_nits() {
    for (settings, roughness, tolerance) in [
        (LAMBERT, 1.0, 0.002),
        // The lobe depends on angles, so that corners and middles differ a little.
        (ReferenceSettings::default(), 0.65, 0.01),
    ] {
        let mut world = world();
        let walls = StandardMaterial {
            emissive: LinearRgba::rgb(1.0, 1.0, 1.0),
            emissive_exposure_weight: 1.0,
            perceptual_roughness: roughness,
            ..diffuse([0.5; 3])
        };
        // Seen from inside: the winding is turned round.
        let room = Mesh::from(Cuboid::from_length(4.0))
            .with_inverted_winding()
            .unwrap();
        let room = room.with_computed_flat_normals_of_triangles();
        mesh(&mut world, room, walls, default());
        let size = UVec2::new(16, 12);
        let camera = camera(
            Vec3::new(-1.2, -0.4, 1.4),
            Vec3::new(1.0, 0.3, -1.0),
            80.0,
            size,
        );
        let reference = render(&mut world, camera, size, 256, settings);
        assert_near(
            mean(&reference.picture(ReferenceView::Full)),
            2.0,
            tolerance,
            "furnace",
        );
    }
}

trait FlatNormals {
    fn with_computed_flat_normals_of_triangles(self) -> Self;
}

impl FlatNormals for Mesh {
    fn with_computed_flat_normals_of_triangles(mut self) -> Self {
        self.duplicate_vertices();
        self.compute_flat_normals();
        self
    }
}

/// E = pi L (r / d)^2 below a sphere.
#[test]
fn sphere_light_has_its_closed_form() {
    let mut world = world();
    floor(&mut world);
    let (radius, distance, nits) = (0.3, 1.0, 100.0);
    mesh(
        &mut world,
        Sphere::new(radius).mesh().ico(40).unwrap(),
        shining(nits),
        Transform::from_xyz(0.0, distance, 0.0),
    );
    let truth = ALBEDO * nits * (radius / distance).powi(2);
    let value = floor_nits(&mut world, ReferenceView::Indirect, 4096);
    // The mesh lies inside of the sphere by about a thousandth of its radius.
    assert_near(value, truth, 0.01, "sphere");
}

/// Form factor of a rectangle above a point, as a light of Bevy's and as a surface that shines.
#[test]
fn rectangle_has_its_form_factor() {
    let (half, distance, nits) = (Vec2::new(0.4, 0.25), 0.8, 50.0);
    // Four quarters (Howell's catalogue, C-11).
    let (x, y) = (half.x / distance, half.y / distance);
    let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let factor = 4.0 / (2.0 * PI) * (x / rx * (y / rx).atan() + y / ry * (x / ry).atan());
    let truth = ALBEDO * nits * factor;
    let down = Transform::from_xyz(0.0, distance, 0.0).looking_to(Vec3::NEG_Y, Vec3::Z);

    let mut lit = world();
    floor(&mut lit);
    lit.spawn((
        RectLight {
            // A diffuse emitter of one side: lumens = pi * area * nits.
            intensity: PI * 4.0 * half.x * half.y * nits,
            width: 2.0 * half.x,
            height: 2.0 * half.y,
            range: 1e4,
            ..default()
        },
        down,
    ));
    let value = floor_nits(&mut lit, ReferenceView::Direct, 4096);
    assert_near(value, truth, 0.005, "rect light");

    let mut shone_on = world();
    floor(&mut shone_on);
    mesh(
        &mut shone_on,
        Rectangle::from_size(2.0 * half),
        shining(nits),
        Transform::from_xyz(0.0, distance, 0.0).looking_to(Vec3::Y, Vec3::Z),
    );
    let value = floor_nits(&mut shone_on, ReferenceView::Indirect, 4096);
    assert_near(value, truth, 0.005, "shining rectangle");
}

/// What stands beside a lit floor changes nothing where no GI camera would see it, and a floor said in another way is
/// lit the same.
#[test]
fn what_a_camera_would_see_takes_part_however_it_is_made() {
    let (candela, distance) = (200.0, 1.5);
    let truth = ALBEDO / PI * candela / (distance * distance);
    let lamp = |intensity: f32| {
        let light = PointLight {
            intensity: 4.0 * PI * intensity,
            range: 1e4,
            ..default()
        };
        (light, Transform::from_xyz(0.0, distance, 0.0))
    };
    let other = RenderLayers::layer(3);
    let plane = || Mesh::from(Plane3d::new(Vec3::Y, Vec2::splat(1.0)));
    let roof = |world: &mut World| {
        let mesh = add(world, plane());
        let material = add(world, diffuse([0.5; 3]));
        let at = Transform::from_xyz(0.0, 1.0, 0.0);
        world
            .spawn((Mesh3d(mesh), MeshMaterial3d(material), at))
            .id()
    };
    type Variant<'a> = (&'a str, &'a dyn Fn(&mut World));
    let beside: [Variant; 3] = [
        ("on other layers", &|world| {
            world.spawn((lamp(1000.0), other.clone()));
            let roof = roof(world);
            world.entity_mut(roof).insert(other.clone());
        }),
        ("a roof on a layer that the lamp is not on", &|world| {
            world.spawn((
                GiCamera::default(),
                Transform::default(),
                RenderLayers::from_layers(&[0, 3]),
            ));
            let roof = roof(world);
            world.entity_mut(roof).insert(other.clone());
        }),
        ("another level of detail", &|world| {
            world.spawn((GiCamera::default(), Transform::from_xyz(0.0, 1.0, 10.0)));
            let roof = roof(world);
            let range = VisibilityRange::abrupt(0.0, 5.0);
            world.entity_mut(roof).insert(range);
        }),
    ];
    for (what, spawn) in beside {
        let mut world = world();
        floor(&mut world);
        world.spawn(lamp(candela));
        spawn(&mut world);
        let value = floor_nits(&mut world, ReferenceView::Direct, 16);
        assert_near(value, truth, 0.002, what);
    }

    let mut strip = Mesh::new(
        PrimitiveTopology::TriangleStrip,
        RenderAssetUsages::default(),
    );
    strip.insert_attribute(
        Mesh::ATTRIBUTE_POSITION,
        vec![
            [-1.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [-1.0, 0.0, -1.0],
            [1.0, 0.0, -1.0],
        ],
    );
    strip.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 1.0, 0.0]; 4]);
    let with_normals =
        |n: [f32; 3]| plane().with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![n; 4]);
    // As Bevy's glTF loader culls what is mirrored.
    let inside_out = StandardMaterial {
        cull_mode: Some(Face::Front),
        ..diffuse([ALBEDO; 3])
    };
    let as_usual = diffuse([ALBEDO; 3]);
    let mirror = Transform::from_scale(Vec3::new(-1.0, 1.0, 2.0));
    for (what, mesh, material, transform) in [
        ("a strip", strip, as_usual.clone(), default()),
        ("mirrored", plane(), inside_out, mirror),
        (
            "normals of zero",
            with_normals([0.0; 3]),
            as_usual.clone(),
            default(),
        ),
        (
            "normals of NaN",
            with_normals([f32::NAN; 3]),
            as_usual,
            default(),
        ),
    ] {
        let mut world = world();
        self::mesh(&mut world, mesh, material, transform);
        world.spawn(lamp(candela));
        let value = floor_nits(&mut world, ReferenceView::Direct, 16);
        assert_near(value, truth, 0.002, what);
    }
}

/// E = I / d^2 on the axis of a spot, and of a point; lumens over 4 pi are candela.
#[test]
fn point_and_spot_follow_the_inverse_square() {
    let (candela, distance) = (200.0, 1.5);
    let truth = ALBEDO / PI * candela / (distance * distance);
    let at = Transform::from_xyz(0.0, distance, 0.0).looking_to(Vec3::NEG_Y, Vec3::Z);
    let mut lit = world();
    floor(&mut lit);
    lit.spawn((
        PointLight {
            intensity: candela * 4.0 * PI,
            range: 1e4,
            ..default()
        },
        at,
    ));
    assert_near(
        floor_nits(&mut lit, ReferenceView::Direct, 16),
        truth,
        0.001,
        "point",
    );
    let mut lit = world();
    floor(&mut lit);
    lit.spawn((
        SpotLight {
            intensity: candela * 4.0 * PI,
            range: 1e4,
            inner_angle: 0.2,
            outer_angle: 0.4,
            ..default()
        },
        at,
    ));
    assert_near(
        floor_nits(&mut lit, ReferenceView::Direct, 16),
        truth,
        0.001,
        "spot",
    );
    let mut lit = world();
    floor(&mut lit);
    lit.spawn((
        DirectionalLight {
            illuminance: 1000.0,
            ..default()
        },
        at,
    ));
    assert_near(
        floor_nits(&mut lit, ReferenceView::Direct, 16),
        ALBEDO / PI * 1000.0,
        0.001,
        "sun",
    );
}

/// Between two plates without end, one of which shines: B1 = L + a B2, B2 = a B1.
#[test]
fn two_plates_light_each_other() {
    let (albedo, nits) = (0.7f32, 10.0);
    let mut world = world();
    let mut plate = |normal: Vec3, y: f32, emission: f32| {
        let material = StandardMaterial {
            emissive: LinearRgba::rgb(emission, emission, emission),
            ..diffuse([albedo; 3])
        };
        mesh(
            &mut world,
            Plane3d::new(normal, Vec2::splat(2000.0)),
            material,
            Transform::from_xyz(0.0, y, 0.0),
        );
    };
    plate(Vec3::NEG_Y, 1.0, nits);
    plate(Vec3::Y, 0.0, 0.0);
    let truth = albedo * nits / (1.0 - albedo * albedo);
    let value = floor_nits(&mut world, ReferenceView::Indirect, 4096);
    // Half a per cent of a plate's light comes from beyond 14 m, and none from beyond 2 km.
    assert_near(value, truth, 0.01, "plates");
}

/// A floor under an open sky: E = pi L; and under a sky box, of which one half shines, half of that.
#[test]
fn the_sky_lights_a_floor() {
    let mut open = world();
    floor(&mut open);
    open.resource_mut::<GiSettings>().sky = GiSky::Constant(LinearRgba::rgb(30.0, 30.0, 30.0));
    let value = floor_nits(&mut open, ReferenceView::Indirect, 256);
    assert_near(value, ALBEDO * 30.0, 0.001, "constant sky");

    let mut boxed = world();
    floor(&mut boxed);
    boxed.resource_mut::<GiSettings>().sky = GiSky::Camera;
    // The faces +x and the half of all others that lies there.
    let mut data = Vec::new();
    for face in 0..6 {
        for _y in 0..4 {
            for x in 0..4 {
                let lit = match face {
                    0 => true,
                    1 => false,
                    2..=4 => x >= 2,
                    _ => x < 2,
                };
                data.extend([if lit { 255u8 } else { 0 }; 4]);
            }
        }
    }
    let image = Image::new(
        Extent3d {
            width: 4,
            height: 4,
            depth_or_array_layers: 6,
        },
        TextureDimension::D2,
        data,
        TextureFormat::Rgba8Unorm,
        RenderAssetUsages::default(),
    );
    let image = add(&mut boxed, image);
    boxed.spawn((
        Camera3d::default(),
        GiCamera::default(),
        Skybox {
            image: Some(image),
            brightness: 40.0,
            ..default()
        },
    ));
    let value = floor_nits(&mut boxed, ReferenceView::Indirect, 8192);
    assert_near(value, ALBEDO * 20.0, 0.01, "half a sky box");
}

fn cornell() -> World {
    let mut world = world();
    cornell::spawn(&mut world);
    world
}

fn cornell_camera(size: UVec2) -> ReferenceCamera {
    let view = cornell::view();
    camera(view.eye, view.look, view.fov, size)
}

/// The mean of 16 renders of different seeds is that of a long one, within what their spread allows.
#[test]
fn seeds_agree_within_three_sigma() {
    let size = UVec2::splat(16);
    let value = |samples, seed| {
        let settings = ReferenceSettings { seed, ..LAMBERT };
        let picture = render(
            &mut cornell(),
            cornell_camera(size),
            size,
            samples,
            settings,
        )
        .picture(ReferenceView::Indirect);
        f64::from(mean(&picture))
    };
    let values: Vec<f64> = (1..=16).map(|seed| value(16, seed)).collect();
    let average = values.iter().sum::<f64>() / 16.0;
    let variance = values.iter().map(|v| (v - average).powi(2)).sum::<f64>() / 15.0;
    let sigma = (variance / 16.0).sqrt();
    let long = value(4096, 0);
    println!("16 seeds {average:.4} +- {sigma:.4}, long {long:.4}");
    assert!((average - long).abs() < 3.0 * sigma);
}

/// The same bytes, whatever the number of threads, and whether in one go or in several.
#[test]
fn threads_do_not_matter() {
    let size = UVec2::new(24, 16);
    let bits = |threads: usize, passes: &[u32]| -> Vec<[u32; 3]> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut reference = render(
                &mut cornell(),
                cornell_camera(size),
                size,
                passes[0],
                ReferenceSettings::default(),
            );
            for pass in &passes[1..] {
                reference.render(*pass, &AtomicBool::new(false), || {});
            }
            let picture = reference.picture(ReferenceView::Full);
            picture
                .iter()
                .map(|v| v.to_array().map(f32::to_bits))
                .collect()
        })
    };
    let one = bits(1, &[8]);
    assert!(one == bits(3, &[8]));
    assert!(one == bits(2, &[3, 5]));
}

/// What is stopped keeps what it has.
#[test]
fn a_stopped_render_keeps_its_paths() {
    let size = UVec2::new(16, 16);
    let mut reference = render(
        &mut cornell(),
        cornell_camera(size),
        size,
        2,
        ReferenceSettings::default(),
    );
    let before = reference.picture(ReferenceView::Full);
    reference.render(1000, &AtomicBool::new(true), || {});
    assert_eq!(reference.samples(), 2);
    assert_eq!(reference.picture(ReferenceView::Full), before);
}

/// A texture colours, and its alpha cuts.
#[test]
fn textures_colour_and_masks_cut() {
    for (mode, right) in [
        (AlphaMode::Mask(0.5), Vec3::ZERO),
        (AlphaMode::Opaque, Vec3::new(0.0, 0.5, 0.0)),
    ] {
        let mut world = world();
        // Left red and there, right green and cut out.
        let image = Image::new(
            Extent3d {
                width: 2,
                height: 1,
                depth_or_array_layers: 1,
            },
            TextureDimension::D2,
            vec![255, 0, 0, 255, 0, 255, 0, 0],
            TextureFormat::Rgba8UnormSrgb,
            RenderAssetUsages::default(),
        );
        let texture = add(&mut world, image);
        let material = StandardMaterial {
            base_color_texture: Some(texture),
            alpha_mode: mode,
            ..diffuse([0.5; 3])
        };
        mesh(&mut world, Rectangle::from_length(1.0), material, default());
        let size = UVec2::new(8, 8);
        let camera = camera(Vec3::Z, Vec3::ZERO, 50.0, size);
        let picture = render(&mut world, camera, size, 4, LAMBERT).picture(ReferenceView::Albedo);
        assert_eq!(picture[4 * 8 + 1], Vec3::new(0.5, 0.0, 0.0), "{mode:?}");
        assert_eq!(picture[4 * 8 + 6], right, "{mode:?}");
    }
}

/// The Cornell box against Mitsuba 3 (`tests/truth/cornell.py`).
#[test]
fn cornell_agrees_with_mitsuba() {
    let size = UVec2::new(320, 184);
    let start = std::time::Instant::now();
    let samples = 2048;
    let picture = render(&mut cornell(), cornell_camera(size), size, samples, LAMBERT)
        .picture(ReferenceView::Indirect);
    let paths = f64::from(size.x * size.y * samples);
    let rate = paths / start.elapsed().as_secs_f64() / 1e6;
    let truth =
        read_exr(Path::new("tests/truth/cornell.exr")).expect("the truth is in the repository");
    let width = size.x as usize;
    let (mut ours, mut theirs, mut squares, mut n) = (0.0, 0.0, 0.0, 0);
    for (i, truth) in truth.pixels.iter().enumerate() {
        let truth = Vec3::from_slice(truth);
        let (bx, by) = (i % (width / 8), i / (width / 8));
        // The truth has no bulb, which hangs in these blocks.
        if by == 4 && (bx == 19 || bx == 20) {
            continue;
        }
        let block = (0..64)
            .map(|k| picture[(by * 8 + k / 8) * width + bx * 8 + k % 8])
            .sum::<Vec3>()
            / 64.0;
        ours += block.element_sum();
        theirs += truth.element_sum();
        if truth.element_sum() > 1e-3 {
            squares += (block - truth).length_squared();
            n += 3;
        }
    }
    let ratio = ours / theirs;
    let rmse = (squares / n as f32).sqrt() / (theirs / n as f32);
    println!(
        "cornell: mean / Mitsuba {ratio:.4}, relative RMSE {rmse:.4}; {rate:.2} million paths/s"
    );
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    // Noise of both sides included.
    assert!(rmse < 0.02, "{rmse}");
}
