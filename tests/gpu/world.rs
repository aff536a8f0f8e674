//! What of a Bevy world takes part in bounced light: what a GI camera would see if it looked there, where it is now,
//! and captured again only when it differs.

use bevy::{
    asset::RenderAssetUsages,
    camera::{
        primitives::Aabb,
        visibility::{
            DynamicSkinnedMeshBounds, NoCpuCulling, NoFrustumCulling, RenderLayers, VisibilityRange,
        },
    },
    mesh::{
        Indices, PrimitiveTopology, VertexAttributeValues,
        morph::{MeshMorphWeights, MorphAttributes},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use bevy_gi::{
    prelude::*,
    scene::{light_maps::SceneLightMaps, voxels::SceneVoxels},
};

use crate::{
    common::{headless::Headless, scenes::stage::diffuse},
    shared::SharedApp,
    support::{
        CONES, Voxels, app, camera, choose, in_render_world, lit_room, material, mean, read_voxels,
        read_vpls, settle, slab,
    },
};

/// Metres from the camera to the plane in which [`square`]s stand.
const EYE: f32 = 6.0;

/// A volume of 3.2 m in voxels of 0.1 m around the origin, which a camera sees from +z. All parts of the capture are
/// wanted: voxels and shadow maps by the technique, reflective shadow maps as they are shown.
fn volume() -> (SharedApp, Entity) {
    let mut headless = app();
    choose(&mut headless, CONES);
    let world = headless.app.world_mut();
    world.resource_mut::<GiDebugSettings>().show_vpls = true;
    world.spawn(GiVolume::new(Vec3::splat(3.2)).with_resolution(32));
    let eye = Vec3::Z * EYE;
    let (camera, _) = camera(&mut headless, UVec2::splat(16), eye, Vec3::ZERO, 45.0);
    (headless, camera)
}

/// A sun along `direction`.
fn sun(headless: &mut Headless, direction: Vec3) {
    let light = DirectionalLight {
        shadow_maps_enabled: true,
        ..default()
    };
    let transform = Transform::default().looking_to(direction, Vec3::Y);
    headless.app.world_mut().spawn((light, transform));
}

/// A square of 0.3 m that faces +z.
fn square() -> Mesh {
    Mesh::from(Rectangle::from_length(0.3))
}

fn add<A: Asset>(headless: &mut Headless, asset: A) -> Handle<A> {
    let world = headless.app.world_mut();
    world.resource_mut::<Assets<A>>().add(asset)
}

/// Centre of the square with a number.
fn place(i: usize) -> Vec3 {
    let (column, row) = ((i % 8) as f32, (i / 8) as f32);
    Vec3::new(0.4 * column - 1.35, 0.4 * row - 1.15, 0.05)
}

fn at(i: usize) -> Transform {
    Transform::from_translation(place(i))
}

fn present(voxels: &Voxels, i: usize) -> bool {
    voxels.at(voxels.voxel(place(i)))
}

/// Which way the surface at a point faces.
fn facing(voxels: &Voxels, p: Vec3) -> Vec3 {
    voxels.normal(p).expect("there is a surface")
}

/// How often voxels, shadow maps and reflective shadow maps were captured.
fn captures(headless: &mut Headless) -> [u64; 3] {
    let versions = in_render_world(headless, |world| {
        let mut volumes = world.try_query::<&SceneVoxels>()?;
        let voxels = volumes.iter(world).next()?.version;
        let maps = world.resource::<SceneLightMaps>();
        Some([voxels, maps.shadow_version, maps.rsm_version])
    });
    versions.expect("a volume is voxelized")
}

#[test]
fn what_a_camera_would_see_takes_part() {
    let (mut headless, camera) = volume();
    let white = material(&mut headless, diffuse([0.5; 3]));
    let mesh = add(&mut headless, square());
    let topology = |topology, indices: Option<Vec<u32>>| {
        let corners = [
            [-0.15, -0.15, 0.0],
            [0.15, -0.15, 0.0],
            [-0.15, 0.15, 0.0],
            [0.15, 0.15, 0.0],
        ];
        let mut mesh = Mesh::new(topology, RenderAssetUsages::default());
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, corners.to_vec());
        mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; 4]);
        if let Some(indices) = indices {
            mesh.insert_indices(Indices::U32(indices));
        }
        mesh
    };
    let diagonals = add(
        &mut headless,
        topology(PrimitiveTopology::LineList, Some(vec![0, 3, 1, 2])),
    );
    let strip = add(
        &mut headless,
        topology(PrimitiveTopology::TriangleStrip, None),
    );
    let world = headless.app.world_mut();
    let base = |i| (Mesh3d(mesh.clone()), MeshMaterial3d(white.clone()), at(i));
    let put = |i| world.spawn(base(i)).id();
    let [
        plain,
        layered,
        unculled,
        gpu_culled,
        gpu_layered,
        boxed,
        near,
        far,
    ] = std::array::from_fn(put);
    let other = RenderLayers::layer(3);
    world.entity_mut(layered).insert(other.clone());
    // Bevy gives it no `Aabb`.
    world.entity_mut(unculled).insert(NoFrustumCulling);
    world.entity_mut(gpu_culled).insert(NoCpuCulling);
    world
        .entity_mut(gpu_layered)
        .insert((NoCpuCulling, other.clone()));
    // Two levels of detail, one in place of the other.
    let level = |margins: [f32; 4]| VisibilityRange {
        start_margin: margins[0]..margins[1],
        end_margin: margins[2]..margins[3],
        use_aabb: false,
    };
    world.entity_mut(near).insert(level([0.0, 0.0, 4.0, 8.0]));
    world.entity_mut(far).insert(level([4.0, 8.0, 90.0, 90.0]));
    let parent = world.spawn((Transform::default(), Visibility::Hidden)).id();
    let hidden = world.spawn((base(8), ChildOf(parent))).id();
    let lines = (Mesh3d(diagonals), MeshMaterial3d(white.clone()), at(9));
    world.spawn(lines);
    world.spawn((Mesh3d(strip), MeshMaterial3d(white.clone()), at(10)));
    settle(&mut headless, 3);
    // A box far away: Bevy culls by it, light does not.
    let elsewhere = Aabb {
        center: Vec3::splat(500.0).into(),
        half_extents: Vec3::splat(0.1).into(),
    };
    headless.app.world_mut().entity_mut(boxed).insert(elsewhere);

    let check = |headless: &mut Headless, expected: [bool; 11], when: &str| {
        headless.steps(3);
        let voxels = read_voxels(headless);
        let found = std::array::from_fn(|i| present(&voxels, i));
        assert_eq!(found, expected, "{when}");
    };
    // The last three: below a hidden parent, lines, a strip.
    let mut expected = [true; 11];
    (expected[1], expected[4]) = (false, false);
    // The two levels stand side by side here, 6.1 m and 6.2 m from the camera: past the middle of the margins.
    (expected[6], expected[7]) = (false, true);
    (expected[8], expected[9]) = (false, false);
    check(&mut headless, expected, "at first");

    // The level changes once, and nothing is captured before it does.
    let nearer = |z: f32| Transform::from_xyz(0.0, 0.0, z).looking_at(Vec3::ZERO, Vec3::Y);
    let before = captures(&mut headless);
    for z in [5.95, 5.9, 5.85] {
        headless
            .app
            .world_mut()
            .entity_mut(camera)
            .insert(nearer(z));
        assert_eq!(captures(&mut headless), before, "the camera at {z} m");
    }
    headless
        .app
        .world_mut()
        .entity_mut(camera)
        .insert(nearer(5.0));
    (expected[6], expected[7]) = (true, false);
    check(&mut headless, expected, "from nearer");

    // Both ways at once, without a frame between: what is seen is what is captured.
    for shown in [true, false, true] {
        let world = headless.app.world_mut();
        let (visibility, layers) = match shown {
            true => (Visibility::Inherited, RenderLayers::from_layers(&[0, 3])),
            false => (Visibility::Hidden, RenderLayers::layer(0)),
        };
        world.entity_mut(parent).insert(visibility);
        world.entity_mut(camera).insert(layers);
        (expected[1], expected[4], expected[8]) = (shown, shown, shown);
        check(&mut headless, expected, "switched");
    }
    let world = headless.app.world_mut();
    world.entity_mut(hidden).insert(Visibility::Hidden);
    world.entity_mut(plain).insert(NotGiCaster);
    (expected[0], expected[8]) = (false, false);
    check(&mut headless, expected, "by themselves");
}

#[test]
fn a_lamp_that_no_camera_sees_lights_nothing() {
    let volume = GiVolume::new(Vec3::splat(5.0)).with_resolution(32);
    let (mut headless, _, target) = lit_room([0.5; 3], volume);
    settle(&mut headless, 40);
    let alone = mean(&headless.picture(&target));
    let lamp = PointLight {
        intensity: 30_000.0,
        shadow_maps_enabled: true,
        ..default()
    };
    let world = headless.app.world_mut();
    let at = Transform::from_xyz(0.0, 1.0, 0.5);
    world.spawn((lamp, at, RenderLayers::layer(3)));
    headless.steps(40);
    let ratio = mean(&headless.picture(&target)) / alone;
    assert!((ratio - 1.0).abs() < 0.01, "on another layer: {ratio}");
    // Eleven times the light of one lamp, once a camera sees both.
    let world = headless.app.world_mut();
    let mut cameras = world.query_filtered::<Entity, With<GiCamera>>();
    let camera = cameras.single(world).unwrap();
    world
        .entity_mut(camera)
        .insert(RenderLayers::from_layers(&[0, 3]));
    settle(&mut headless, 40);
    let ratio = mean(&headless.picture(&target)) / alone;
    assert!(
        (ratio / 11.0 - 1.0).abs() < 0.1,
        "on a layer of the camera's: {ratio}"
    );
}

#[test]
fn meshes_cast_into_the_maps_of_lights_with_which_they_share_a_layer() {
    let (mut headless, camera) = volume();
    let white = material(&mut headless, diffuse([0.5; 3]));
    let half = Vec3::new(1.2, 0.0, 1.2);
    slab(&mut headless, -half - Vec3::Y, half - Vec3::Y * 0.8, &white);
    let roof = slab(&mut headless, -half + Vec3::Y, half + Vec3::Y * 1.2, &white);
    sun(&mut headless, Vec3::NEG_Y);
    let world = headless.app.world_mut();
    let both = RenderLayers::from_layers(&[0, 1]);
    world.entity_mut(camera).insert(both.clone());
    settle(&mut headless, 3);
    // As Bevy's own shadow maps have it: on a layer that the sun is not on, the roof lets light through.
    for (layers, lit) in [(RenderLayers::layer(1), -0.8), (both, 1.2)] {
        headless.app.world_mut().entity_mut(roof).insert(layers);
        headless.steps(4);
        let vpls = read_vpls(&mut headless);
        let lights = vpls.iter().filter(|vpl| vpl.flux.y > 0.0);
        assert!(lights.clone().count() > 0);
        for vpl in lights {
            assert!((vpl.position.y - lit).abs() < 0.01, "not at {lit}: {vpl:?}");
        }
    }
}

/// With a skin and a morph target that both leave it where it is.
fn posed(headless: &mut Headless) -> (Mesh, SkinnedMesh) {
    let mut mesh = square();
    let vertices = mesh.count_vertices();
    mesh.insert_attribute(
        Mesh::ATTRIBUTE_JOINT_INDEX,
        VertexAttributeValues::Uint16x4(vec![[0; 4]; vertices]),
    );
    let weights = vec![[1.0, 0.0, 0.0, 0.0]; vertices];
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights);
    mesh.generate_skinned_mesh_bounds().unwrap();
    let raised = MorphAttributes {
        position: Vec3::Y,
        ..default()
    };
    mesh.set_morph_targets(vec![raised; vertices]);
    let poses = SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]);
    let skin = SkinnedMesh {
        inverse_bindposes: add(headless, poses),
        joints: vec![headless.app.world_mut().spawn(at(0)).id()],
    };
    (mesh, skin)
}

#[test]
fn what_stays_the_same_is_not_captured_again() {
    let (mut headless, _) = volume();
    sun(&mut headless, Vec3::NEG_Z);
    let white = material(&mut headless, diffuse([0.5; 3]));
    let unused = material(&mut headless, diffuse([0.5; 3]));
    let plain = add(&mut headless, square());
    let spare = add(&mut headless, square());
    let (mesh, skin) = posed(&mut headless);
    let mesh = add(&mut headless, mesh);
    let joint = skin.joints[0];
    let weights = |weight: f32| MeshMorphWeights::Value {
        weights: vec![weight],
    };
    let world = headless.app.world_mut();
    let character = world
        .spawn((
            Mesh3d(mesh.clone()),
            MeshMaterial3d(white.clone()),
            skin,
            weights(0.0),
            DynamicSkinnedMeshBounds,
        ))
        .id();
    let stone = world
        .spawn((Mesh3d(plain.clone()), MeshMaterial3d(white.clone()), at(1)))
        .id();
    // Nothing that Bevy draws, and nothing that is ever there.
    world.spawn((Mesh3d(plain.clone()), at(2)));
    let missing = StandardMaterial {
        base_color_texture: Some(Handle::Uuid(
            bevy::asset::uuid::Uuid::from_u128(0x6769_0002),
            default(),
        )),
        ..diffuse([0.5; 3])
    };
    let missing = world
        .resource_mut::<Assets<StandardMaterial>>()
        .add(missing);
    world.spawn((Mesh3d(plain.clone()), MeshMaterial3d(missing), at(3)));
    // A stranger far away, whose components and assets change.
    let stranger = world
        .spawn((
            Mesh3d(spare.clone()),
            MeshMaterial3d(unused.clone()),
            Transform::from_xyz(500.0, 0.0, 0.0),
        ))
        .id();
    headless.steps(6);
    settle(&mut headless, 6);

    let before = captures(&mut headless);
    for i in 0..6 {
        let world = headless.app.world_mut();
        for (entity, mesh, transform) in [
            (character, &mesh, Transform::default()),
            (stone, &plain, at(1)),
        ] {
            world.entity_mut(entity).insert((
                Mesh3d(mesh.clone()),
                MeshMaterial3d(white.clone()),
                transform,
                Visibility::default(),
                RenderLayers::default(),
            ));
        }
        // What interpolation between two keys that are the same makes of them.
        let rounded = place(0) * (1.0 + f32::EPSILON * (i % 3) as f32);
        world
            .entity_mut(joint)
            .insert(Transform::from_translation(rounded));
        world.entity_mut(character).insert(weights(0.0));
        world
            .entity_mut(stranger)
            .insert(Transform::from_xyz(500.0, i as f32, 0.0));
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        materials.get_mut(&unused).unwrap().base_color =
            Color::linear_rgb(0.1 * i as f32, 0.0, 0.0);
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        let mut spare = meshes.get_mut(&spare).unwrap();
        spare.translate_by(Vec3::X);
        drop(spare);
        assert_eq!(captures(&mut headless), before, "frame {i}");
    }

    // Whatever does change is captured, and then no more.
    type Change = Box<dyn Fn(&mut World)>;
    let moved = at(9);
    let changes: [(&str, Change); 5] = [
        (
            "joint",
            Box::new(move |world| {
                world.entity_mut(joint).insert(moved);
            }),
        ),
        (
            "morph weight",
            Box::new(move |world| {
                world.entity_mut(character).insert(weights(0.5));
            }),
        ),
        (
            "transform",
            Box::new(move |world| {
                world.entity_mut(stone).insert(at(10));
            }),
        ),
        (
            "material",
            Box::new({
                let white = white.clone();
                move |world| {
                    let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
                    materials.get_mut(&white).unwrap().base_color = Color::BLACK;
                }
            }),
        ),
        (
            "mesh",
            Box::new(move |world| {
                let mut meshes = world.resource_mut::<Assets<Mesh>>();
                meshes.get_mut(&plain).unwrap().translate_by(Vec3::X * 0.1);
            }),
        ),
    ];
    for (what, change) in changes {
        let before = captures(&mut headless);
        change(headless.app.world_mut());
        headless.steps(3);
        let after = captures(&mut headless);
        assert!(
            (0..3).all(|i| after[i] > before[i]),
            "{what}: {before:?} {after:?}"
        );
        assert_eq!(captures(&mut headless), after, "after {what}");
    }
    let voxels = read_voxels(&mut headless);
    // Half a metre up, to which its bounds in bind pose do not reach.
    assert!(voxels.at(voxels.voxel(moved.translation + Vec3::Y * 0.5)));
    assert!(!present(&voxels, 9) && present(&voxels, 10), "0.1 m aside");
}

#[test]
fn surfaces_face_the_way_they_wind_where_their_normals_say_nothing() {
    let (mut headless, _) = volume();
    // 30 degrees off the normal of what faces +x, 60 off that of what faces +z.
    sun(&mut headless, Vec3::new(-0.866, 0.0, -0.5));
    let white = material(&mut headless, diffuse([0.5; 3]));
    let normals = [
        Some([0.0; 3]),
        Some([f32::NAN; 3]),
        Some([f32::INFINITY, 0.0, 0.0]),
        Some([0.6, 0.8, 0.0]),
        None,
    ];
    let squares = normals.map(|normal| {
        let mut mesh = square();
        match normal {
            Some(normal) => mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![normal; 4]),
            None => {
                mesh.remove_attribute(Mesh::ATTRIBUTE_NORMAL);
            }
        }
        add(&mut headless, mesh)
    });
    // Two more triangles: one without an area, and one with a corner that is nowhere.
    let mut torn = square();
    torn.insert_attribute(
        Mesh::ATTRIBUTE_POSITION,
        vec![
            [0.15, 0.15, 0.0],
            [-0.15, 0.15, 0.0],
            [-0.15, -0.15, 0.0],
            [f32::NAN, -0.15, 0.0],
        ],
    );
    torn.insert_indices(Indices::U32(vec![0, 1, 2, 0, 2, 3, 0, 0, 1]));
    let torn = add(&mut headless, torn);
    let world = headless.app.world_mut();
    // Turned, mirrored, and sheared: a turned square below a parent that stretches.
    let stretched = Transform::from_scale(Vec3::new(1.5, 0.5, 1.0));
    let parent = world.spawn((stretched, Visibility::default())).id();
    let mut placed = Vec::new();
    for (i, mesh) in squares.iter().enumerate() {
        let turn = |degrees: f32| Quat::from_rotation_y(degrees.to_radians());
        for (row, transform, facing) in [
            (0, Transform::default(), Vec3::Z),
            (1, Transform::from_rotation(turn(180.0)), Vec3::NEG_Z),
            (2, Transform::from_scale(Vec3::new(-1.0, 1.0, 1.0)), Vec3::Z),
            (
                3,
                Transform::from_scale(Vec3::new(1.0, 1.0, -1.0)),
                Vec3::NEG_Z,
            ),
        ] {
            let at = place(i + 8 * row);
            let transform = transform.with_translation(at);
            world.spawn((
                Mesh3d(mesh.clone()),
                MeshMaterial3d(white.clone()),
                transform,
            ));
            placed.push((at, facing));
        }
        let at = place(i + 8 * 4);
        let sheared = Transform::from_rotation(Quat::from_rotation_z(0.7))
            .with_scale(Vec3::new(-0.8, 0.8, 0.8))
            .with_translation(at / stretched.scale);
        let mesh = (Mesh3d(mesh.clone()), MeshMaterial3d(white.clone()));
        world.spawn((mesh, sheared, ChildOf(parent)));
        placed.push((at, Vec3::Z));
    }
    let torn = world
        .spawn((Mesh3d(torn), MeshMaterial3d(white.clone()), at(6)))
        .id();
    settle(&mut headless, 3);
    let voxels = read_voxels(&mut headless);
    for (at, expected) in placed {
        let n = facing(&voxels, at);
        assert!(n.dot(expected) > 0.99, "at {at}: {n}, not {expected}");
    }
    let whole = voxels.albedo(place(6) + Vec3::new(-0.1, 0.1, 0.0));
    let whole = whole.expect("the triangle with all of its corners is there");
    assert!((whole - 0.5).abs().max_element() < 0.005, "{whole}");

    // Reflective shadow maps: the patches of a square that faces +x are as large as it is, whatever its normals.
    let world = headless.app.world_mut();
    let mut all = world.query_filtered::<Entity, With<Mesh3d>>();
    let all: Vec<_> = all.iter(world).filter(|entity| *entity != torn).collect();
    for entity in all {
        world.despawn(entity);
    }
    world.despawn(torn);
    for (mesh, normal) in squares.iter().zip(normals) {
        let world = headless.app.world_mut();
        let turned = Transform::from_rotation(Quat::from_rotation_y(std::f32::consts::FRAC_PI_2))
            .with_scale(Vec3::splat(5.0));
        let mesh = (Mesh3d(mesh.clone()), MeshMaterial3d(white.clone()));
        let square = world.spawn((mesh, turned)).id();
        headless.steps(4);
        let vpls = read_vpls(&mut headless);
        let area: f32 = vpls.iter().map(|vpl| vpl.area).sum();
        // 1.5 m wide; pixels at its rim are in or out.
        if normal.is_none_or(|n| !n[0].is_finite() || n == [0.0; 3]) {
            assert!((area / 2.25 - 1.0).abs() < 0.05, "{normal:?}: {area} m2");
        }
        headless.app.world_mut().despawn(square);
    }
}
