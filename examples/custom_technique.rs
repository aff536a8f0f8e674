//! A technique of one's own in one file: each surface has the light of the nearest of a few ambient cubes that are
//! placed by hand (McTaggart 2004, "Half-Life 2 / Valve Source Shading"; Mitchell et al. 2006).
//!
//! `--technique cubes` (default), or `off` and those of the plugin, to compare. The inspector lists it, and edits the cubes.

use bevy::{
    asset::uuid_handle,
    math::vec3,
    prelude::*,
    render::{extract_resource::ExtractResource, render_resource::*},
    shader::Shader,
};
use bevy_gi::{
    inspector::{GiInspectorPlugin, bevy_egui::EguiPlugin},
    prelude::*,
    technique::*,
};
use serde::{Deserialize, Serialize};

/// The technique.
pub struct AmbientCubes;

/// The cubes of the scene, on the CPU and on the GPU alike.
#[derive(
    Resource,
    Reflect,
    ExtractResource,
    Serialize,
    Deserialize,
    Clone,
    Debug,
    Default,
    PartialEq,
    ShaderType,
)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AmbientCubesSettings {
    /// The cubes. Default: none.
    #[shader(size(runtime))]
    pub cubes: Vec<AmbientCube>,
}

/// Light at a point, from six sides.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, ShaderType)]
pub struct AmbientCube {
    /// Where it is, metres.
    pub position: Vec3,
    /// `E / pi` of surfaces that face +x, +y and +z, nits.
    pub positive: [Vec3; 3],
    /// `E / pi` of surfaces that face -x, -y and -z, nits.
    pub negative: [Vec3; 3],
}

// There is no number with a range, and no preset.
impl Parameters for AmbientCubesSettings {}

const SHADER: Handle<Shader> = uuid_handle!("5d3c8f0a-6f0e-4c55-9d5e-2b1c7a9e4f10");

const WGSL: &str = "
#import bevy_gi::apply::gather::{begin, store as store_pixel}
#import bevy_gi::apply::export::{exported_side, store as store_side}

struct Cube { position: vec3<f32>, positive: array<vec3<f32>, 3>, negative: array<vec3<f32>, 3> }
@group(2) @binding(0) var<storage> cubes: array<Cube>;

fn light(p: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var nearest = 0u;
    for (var i = 1u; i < arrayLength(&cubes); i++) {
        if distance(p, cubes[i].position) < distance(p, cubes[nearest].position) {
            nearest = i;
        }
    }
    let cube = cubes[nearest];
    let weight = normal * normal;
    var sum = vec3(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let side = select(cube.negative[axis], cube.positive[axis], normal[axis] > 0.0);
        sum += weight[axis] * side;
    }
    return sum;
}
#ifdef EXPORT
@compute @workgroup_size(4, 4, 4)
fn export_cubes(@builtin(global_invocation_id) id: vec3<u32>) {
    let side = exported_side(id);
    if side.exists { store_side(side, light(side.position, side.normal)); }
}
#else
@compute @workgroup_size(8, 8)
fn gather_cubes(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = begin(id.xy);
    if !pixel.exists { return; }
    store_pixel(id.xy, pixel.weight, light(pixel.surface.position, pixel.surface.normal), vec3(0.0));
}
#endif
";

impl Technique for AmbientCubes {
    const NAME: &'static str = "cubes";
    const TITLE: &'static str = "Ambient cubes";
    type Settings = AmbientCubesSettings;
    type Debug = NoDebug;
    type Pipelines = NoPipelines;
    type Cache = CubesCache;
    type ViewCache = NoCache;

    fn build(app: &mut App) {
        let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
        let shader = Shader::from_wgsl(WGSL, file!());
        shaders.insert(&SHADER, shader).expect("the handle is free");
    }

    fn cache_layout() -> GroupLayout {
        GroupLayout::new("cubes", ShaderStages::COMPUTE)
            .with("cubes", storage_read::<AmbientCubesSettings>())
    }

    fn gather(_: &AssetServer) -> LookupShader {
        LookupShader::new(SHADER, "gather_cubes", Vec::new())
    }

    fn export(_: &AssetServer) -> Option<LookupShader> {
        Some(LookupShader::new(
            SHADER,
            "export_cubes",
            vec!["EXPORT".into()],
        ))
    }
}

/// The cubes as a volume's cache has them: all.
#[derive(Component, Default)]
pub struct CubesCache {
    shown: AmbientCubesSettings,
    bind_group: Option<BindGroup>,
}

impl Cache<AmbientCubes> for CubesCache {
    fn new(_: &Frame<AmbientCubes>) -> Option<Self> {
        Some(Self::default())
    }

    fn update(&mut self, frame: &Frame<AmbientCubes>) -> Activity {
        if self.bind_group.is_some() && self.shown == *frame.settings {
            return Activity::default();
        }
        self.shown = frame.settings.clone();
        let mut cubes = self.shown.clone();
        if cubes.cubes.is_empty() {
            // No buffer is empty: a black one.
            cubes.cubes.push(AmbientCube::default());
        }
        let mut buffer = StorageBuffer::from(cubes);
        buffer.write_buffer(frame.device, frame.queue);
        let layout = AmbientCubes::cache_layout();
        let cubes = layout.bind(frame.device, frame.cache);
        self.bind_group = Some(cubes.with("cubes", &buffer).build());
        // The new light is exact: one frame of it is enough.
        Activity::settling(1)
    }

    fn bind_group(&self) -> Option<&BindGroup> {
        self.bind_group.as_ref()
    }
}

pub fn main() {
    let mut app = App::new();
    app.add_plugins((DefaultPlugins, GiPlugins));
    app.add_plugins((EguiPlugin::default(), GiInspectorPlugin::default()));
    app.add_plugins(TechniquePlugin::<AmbientCubes>::default());
    let name = std::env::args().skip_while(|a| a != "--technique").nth(1);
    let techniques = app.world().resource::<GiTechniques>();
    let technique = techniques.find(name.as_deref().unwrap_or(AmbientCubes::NAME));
    let technique = technique.unwrap_or_else(|error| panic!("{error}"));
    app.world_mut().resource_mut::<GiSettings>().technique = technique;
    app.add_systems(Startup, setup).run();
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut settings: ResMut<AmbientCubesSettings>,
) {
    let cube = |x, light: Vec3| AmbientCube {
        position: Vec3::new(x, 1.0, 0.0),
        positive: [0.5 * light, light, 0.5 * light],
        negative: [0.5 * light, 0.1 * light, 0.5 * light],
    };
    let (warm, cold) = (vec3(400.0, 200.0, 80.0), vec3(80.0, 200.0, 400.0));
    settings.cubes = vec![cube(-4.0, warm), cube(4.0, cold)];
    let eye = Transform::from_xyz(0.0, 3.0, 12.0).looking_at(Vec3::Y, Vec3::Y);
    commands.spawn((Camera3d::default(), GiCamera::default(), eye));
    commands.spawn(GiVolume::new(Vec3::splat(14.0)));
    let sphere = meshes.add(Sphere::new(0.8));
    let white = materials.add(Color::WHITE);
    for x in [-5.0, -3.0, -1.0, 1.0, 3.0, 5.0] {
        let place = Transform::from_xyz(x, 1.0, 0.0);
        commands.spawn((Mesh3d(sphere.clone()), MeshMaterial3d(white.clone()), place));
    }
}
