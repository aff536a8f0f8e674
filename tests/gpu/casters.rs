//! What meshes and materials look like to light: where they stand as voxels, and in which colour.

use bevy::{
    asset::RenderAssetUsages,
    image::Image,
    mesh::{
        Indices, VertexAttributeValues,
        morph::{MeshMorphWeights, MorphAttributes},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    pbr::{ExtendedMaterial, MaterialExtension},
    prelude::*,
    render::render_resource::{AsBindGroup, Extent3d, TextureDimension, TextureFormat},
    shader::ShaderRef,
};
use bevy_gi::{GiMaterial, GiMaterialPlugin, prelude::*};

use crate::{
    common::{headless::Headless, scenes::stage::diffuse},
    shared::SharedApp,
    support::{Vpl, app, camera, material, read_voxels, read_vpls, settle},
};

/// An app with a volume around the origin.
fn volume() -> SharedApp {
    let mut headless = app();
    spawn_volume(&mut headless);
    headless
}

/// A volume of 3.2 m in voxels of 0.1 m around the origin, a camera and a sun that look at it from +z. Virtual point
/// lights are computed because they are shown.
fn spawn_volume(headless: &mut Headless) {
    let world = headless.app.world_mut();
    world.resource_mut::<GiDebugSettings>().show_vpls = true;
    world.spawn(GiVolume::new(Vec3::splat(3.2)).with_resolution(32));
    world.spawn((
        DirectionalLight::default(),
        Transform::default().looking_to(Vec3::NEG_Z, Vec3::Y),
    ));
    camera(
        headless,
        UVec2::splat(16),
        Vec3::new(0.0, 0.0, 6.0),
        Vec3::ZERO,
        45.0,
    );
}

/// A square of 1 m in the plane z = 0.05, seen from +z.
fn square() -> Mesh {
    Mesh::from(Rectangle::from_length(1.0)).translated_by(Vec3::Z * 0.05)
}

fn add<A: Asset>(headless: &mut Headless, asset: A) -> Handle<A> {
    headless
        .app
        .world_mut()
        .resource_mut::<Assets<A>>()
        .add(asset)
}

fn assert_near(a: Option<Vec3>, b: Vec3, what: &str) {
    let a = a.unwrap_or_else(|| panic!("{what}: there is no surface"));
    // 8 bits, and 16 while they are summed.
    assert!(
        (a - b).abs().max_element() < 0.005,
        "{what}: {a} is not {b}"
    );
}

/// Light leaves from a plane.
fn assert_lit_at(headless: &mut Headless, z: f32, what: &str) {
    for vpl in read_vpls(headless) {
        let dz = (vpl.position.z - z).abs();
        assert!(dz < 0.01, "{what}: light from {vpl:?}");
        assert!(vpl.flux.y > 0.0, "{what}: no light from {vpl:?}");
    }
}

#[test]
fn skins_and_morph_targets_are_voxelized_and_lit_where_they_are() {
    // A skin with one joint.
    let mut headless = volume();
    let white = material(&mut headless, diffuse([0.5; 3]));
    let mut mesh = square();
    let vertices = mesh.count_vertices();
    mesh.insert_attribute(
        Mesh::ATTRIBUTE_JOINT_INDEX,
        VertexAttributeValues::Uint16x4(vec![[0; 4]; vertices]),
    );
    mesh.insert_attribute(
        Mesh::ATTRIBUTE_JOINT_WEIGHT,
        vec![[1.0, 0.0, 0.0, 0.0]; vertices],
    );
    let mesh = add(&mut headless, mesh);
    let bind = add(
        &mut headless,
        SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]),
    );
    let world = headless.app.world_mut();
    let joint = world.spawn(Transform::from_xyz(0.0, 0.0, 1.0)).id();
    world.spawn((
        Mesh3d(mesh),
        MeshMaterial3d(white),
        SkinnedMesh {
            inverse_bindposes: bind,
            joints: vec![joint],
        },
    ));
    settle(&mut headless, 3);
    for (moved, z) in [(1.0, 1.05), (-0.5, -0.45)] {
        headless
            .app
            .world_mut()
            .get_mut::<Transform>(joint)
            .unwrap()
            .translation
            .z = moved;
        headless.steps(3);
        let voxels = read_voxels(&mut headless);
        assert_near(
            voxels.albedo(Vec3::new(0.0, 0.0, z)),
            Vec3::splat(0.5),
            "skin",
        );
        assert_eq!(voxels.albedo(Vec3::new(0.0, 0.0, 0.05)), None, "bind pose");
        assert_lit_at(&mut headless, z, "skin");
    }

    // A morph target that lifts the square by a metre.
    let mut headless = volume();
    let white = material(&mut headless, diffuse([0.5; 3]));
    let lift = MorphAttributes {
        position: Vec3::Z,
        ..default()
    };
    let mut mesh = square();
    mesh.set_morph_targets(vec![lift; mesh.count_vertices()]);
    let mesh = add(&mut headless, mesh);
    let entity = headless
        .app
        .world_mut()
        .spawn((
            Mesh3d(mesh),
            MeshMaterial3d(white),
            MeshMorphWeights::Value { weights: vec![1.0] },
        ))
        .id();
    settle(&mut headless, 3);
    for (weight, z) in [(1.0, 1.05), (0.5, 0.55)] {
        let weights = vec![weight];
        headless
            .app
            .world_mut()
            .entity_mut(entity)
            .insert(MeshMorphWeights::Value { weights });
        headless.steps(3);
        let voxels = read_voxels(&mut headless);
        assert_near(
            voxels.albedo(Vec3::new(0.0, 0.0, z)),
            Vec3::splat(0.5),
            "morph",
        );
        assert_eq!(voxels.albedo(Vec3::new(0.0, 0.0, 0.05)), None, "rest pose");
        assert_lit_at(&mut headless, z, "morph");
    }
}

#[test]
fn textures_colour_voxels_and_bounced_light_and_masks_cut_them() {
    // Left half red and there, right half green and cut out.
    let image = Image::new(
        Extent3d {
            width: 2,
            height: 1,
            depth_or_array_layers: 1,
        },
        TextureDimension::D2,
        vec![255, 0, 0, 255, 0, 255, 0, 0],
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::RENDER_WORLD,
    );
    for (mode, right) in [
        (AlphaMode::Mask(0.5), None),
        (AlphaMode::Opaque, Some(Vec3::new(0.0, 0.5, 0.0))),
    ] {
        let mut headless = volume();
        let texture = add(&mut headless, image.clone());
        let material = material(
            &mut headless,
            StandardMaterial {
                base_color_texture: Some(texture),
                alpha_mode: mode,
                ..diffuse([0.5; 3])
            },
        );
        let mesh = add(&mut headless, square());
        headless
            .app
            .world_mut()
            .spawn((Mesh3d(mesh), MeshMaterial3d(material)));
        settle(&mut headless, 3);
        let voxels = read_voxels(&mut headless);
        let at = |x: f32| voxels.albedo(Vec3::new(x, 0.05, 0.05));
        assert_near(at(-0.35), Vec3::new(0.5, 0.0, 0.0), "left half");
        match right {
            Some(color) => assert_near(at(0.35), color, "right half"),
            None => assert_eq!(at(0.35), None, "what the mask cuts out"),
        }
        // The texture is filtered: in the middle is some of both.
        let vpls = read_vpls(&mut headless);
        let left = vpls.iter().filter(|vpl| vpl.position.x < -0.25);
        let red = |vpl: &Vpl| vpl.flux.x > 0.0 && vpl.flux.y < 0.01 * vpl.flux.x;
        assert!(
            left.clone().count() > 0 && left.into_iter().all(red),
            "left half"
        );
        let right_half = vpls.iter().filter(|vpl| vpl.position.x > 0.25);
        let green = |vpl: &Vpl| vpl.flux.y > 0.0 && vpl.flux.x < 0.01 * vpl.flux.y;
        let count = right_half.clone().count();
        assert_eq!(count > 0, right.is_some(), "right half: {mode:?}");
        assert!(right_half.into_iter().all(green), "right half");
    }
}

/// An extension with nothing in it.
#[derive(Asset, AsBindGroup, TypePath, Clone, Default)]
struct Plain {
    #[uniform(100)]
    unused: Vec4,
}

impl MaterialExtension for Plain {}

/// A material of its own kind.
#[derive(Asset, AsBindGroup, TypePath, Clone)]
struct Own {
    #[uniform(0)]
    color: LinearRgba,
}

impl Material for Own {}

/// The same, with a shader that says what it looks like to light.
#[derive(Asset, AsBindGroup, TypePath, Clone)]
struct Known {
    #[uniform(0)]
    color: LinearRgba,
}

impl Material for Known {}

/// Set by the test: the shader is made there.
static KNOWN_SHADER: std::sync::OnceLock<Handle<Shader>> = std::sync::OnceLock::new();

impl GiMaterial for Known {
    fn voxelize_shader() -> ShaderRef {
        KNOWN_SHADER.get().unwrap().clone().into()
    }
}

#[test]
fn materials_of_ones_own_block_and_bounce() {
    KNOWN_SHADER
        .set(Handle::Uuid(
            bevy::asset::uuid::Uuid::from_u128(0x6769_0001),
            Default::default(),
        ))
        .unwrap();
    let mut headless = Headless::new(|app| {
        app.add_plugins((
            GiPlugins,
            MaterialPlugin::<ExtendedMaterial<StandardMaterial, Plain>>::default(),
            GiMaterialPlugin::<ExtendedMaterial<StandardMaterial, Plain>>::default(),
            MaterialPlugin::<Own>::default(),
            MaterialPlugin::<Known>::default(),
            GiMaterialPlugin::<Known>::default(),
        ));
        let shader = "
            #import bevy_pbr::prepass_io::VertexOutput
            #import bevy_gi::scene::voxels::splat::{VoxelSurface, splat, triangle_normal}

            @group(3) @binding(0) var<uniform> color: vec4<f32>;

            @fragment
            fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) {
                let normal = triangle_normal(in);
                splat(in, is_front, normal, VoxelSurface(color.rgb, vec3(0.0), false));
            }";
        app.world_mut()
            .resource_mut::<Assets<Shader>>()
            .insert(
                KNOWN_SHADER.get().unwrap(),
                Shader::from_wgsl(shader, "tests/known.wgsl"),
            )
            .unwrap();
    });
    spawn_volume(&mut headless);
    let mesh = add(&mut headless, Mesh::from(Rectangle::from_length(0.6)));
    let blue = LinearRgba::rgb(0.1, 0.2, 0.8);
    let extended = add(
        &mut headless,
        ExtendedMaterial {
            base: diffuse([0.1, 0.2, 0.8]),
            extension: Plain::default(),
        },
    );
    let own = add(&mut headless, Own { color: blue });
    let known = add(&mut headless, Known { color: blue });
    let world = headless.app.world_mut();
    let at = |x: f32| Transform::from_xyz(x, 0.05, 0.05);
    world.spawn((Mesh3d(mesh.clone()), MeshMaterial3d(extended), at(-0.95)));
    world.spawn((Mesh3d(mesh.clone()), MeshMaterial3d(own), at(0.05)));
    world.spawn((Mesh3d(mesh), MeshMaterial3d(known), at(1.05)));
    settle(&mut headless, 3);
    let voxels = read_voxels(&mut headless);
    let albedo = |x: f32| voxels.albedo(Vec3::new(x, 0.05, 0.05));
    assert_near(albedo(-0.95), Vec3::new(0.1, 0.2, 0.8), "extended");
    assert_near(albedo(0.05), Vec3::splat(0.5), "unknown");
    assert_near(albedo(1.05), Vec3::new(0.1, 0.2, 0.8), "with a shader");
}

/// More bricks with surfaces than a pool starts with: it grows until all are there.
#[test]
fn the_pool_grows_to_what_the_scene_needs() {
    let mut headless = app();
    let white = material(&mut headless, diffuse([0.5; 3]));
    // Shelves 4 voxels apart fill every brick of 64^3 voxels: 4096, and a pool starts with 2048.
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for shelf in 0..16 {
        let y = (shelf as f32 + 0.5) * 0.4 - 3.2;
        let base = positions.len() as u32;
        positions.extend([
            [-3.2, y, -3.2],
            [3.2, y, -3.2],
            [3.2, y, 3.2],
            [-3.2, y, 3.2],
        ]);
        indices.extend([0, 2, 1, 0, 3, 2].map(|i| base + i));
    }
    let mut mesh = Mesh::new(
        bevy::mesh::PrimitiveTopology::TriangleList,
        RenderAssetUsages::default(),
    );
    mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
    mesh.insert_indices(Indices::U32(indices));
    let mesh = add(&mut headless, mesh);
    let world = headless.app.world_mut();
    world.spawn((Mesh3d(mesh), MeshMaterial3d(white)));
    world.spawn(GiVolume::new(Vec3::splat(6.4)).with_resolution(64));
    camera(
        &mut headless,
        UVec2::splat(16),
        Vec3::new(0.0, 0.0, 9.0),
        Vec3::ZERO,
        45.0,
    );
    settle(&mut headless, 6);
    let voxels = read_voxels(&mut headless);
    let occupied = voxels
        .records
        .iter()
        .filter(|r| (r[1] >> 24) & 1 != 0)
        .count();
    assert_eq!(occupied, 16 * 64 * 64);
    headless.steps(3);
    let counts = headless
        .app
        .world()
        .resource::<bevy_gi::GiStatistics>()
        .counts();
    println!("{counts:?}");
    assert_eq!(counts["scene/voxels_occupied"], 16 * 64 * 64);
    assert_eq!(counts["scene/brick_slots"], 4096);
}
