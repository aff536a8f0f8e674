//! Opens a scene: a bundled one, or any glTF file; with its volume, lights, sky and camera.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use bevy::{
    camera::{Exposure, primitives::Aabb},
    camera_controller::free_camera::FreeCamera,
    light::{
        CascadeShadowConfig, CascadeShadowConfigBuilder, DirectionalLightShadowMap,
        PointLightShadowMap,
    },
    prelude::*,
    world_serialization::WorldInstance,
};
use bevy_gi::prelude::*;

use crate::{
    options::{number, vector},
    scenes::{
        self, Content, Scene, SceneView, asset_folder,
        random::{self, Plan, RandomScene},
    },
};

/// What is opened, and how it is looked at.
#[derive(clap::Args, Resource, Clone, Debug)]
pub struct SceneOptions {
    /// A .gltf or .glb file, or a bundled scene: see --list; or one that is drawn at random: random:SEED, with :furnace
    /// or :sealed for its other variants.
    pub scene: Option<String>,
    /// Camera position x,y,z, metres. Default: the file's first camera, else the whole scene.
    #[arg(long, value_parser = vector, allow_hyphen_values = true)]
    pub eye: Option<Vec3>,
    /// Point that the camera looks at.
    #[arg(long, value_parser = vector, allow_hyphen_values = true)]
    pub look: Option<Vec3>,
    /// Vertical field of view, degrees, 1 to 179.
    #[arg(long, value_parser = |text: &str| number(text, 1.0, 179.0))]
    pub fov: Option<f32>,
    /// Adds a sun whose light travels in this direction, in place of the file's lights.
    #[arg(long, value_parser = vector, allow_hyphen_values = true)]
    pub sun: Option<Vec3>,
    /// Illuminance of that sun, lux.
    #[arg(long, default_value_t = 10_000.0, value_parser = |text: &str| number(text, 0.0, 1e9))]
    pub lux: f32,
    /// Constant sky, nits.
    #[arg(long, value_parser = |text: &str| number(text, 0.0, 1e12))]
    pub sky: Option<f32>,
    /// Exposure value at ISO 100.
    #[arg(long, value_parser = |text: &str| number(text, -20.0, 40.0))]
    pub ev100: Option<f32>,
    /// Voxels along the longest side of the scene's volume; default: 128, or the bundled scene's own.
    #[arg(long, value_parser = clap::value_parser!(u32).range(32..=512))]
    pub resolution: Option<u32>,
}

impl SceneOptions {
    /// A bundled scene as it is meant to be.
    pub fn bundled(scene: &Scene) -> Self {
        Self::named(scene.name)
    }

    /// What is typed for a scene, without other options.
    pub fn named(name: &str) -> Self {
        Self {
            scene: Some(name.into()),
            eye: None,
            look: None,
            fov: None,
            sun: None,
            lux: 10_000.0,
            sky: None,
            ev100: None,
            resolution: None,
        }
    }
}

/// How far opening has come.
#[derive(Resource, Default)]
pub struct Opened {
    /// Whether everything is in its place.
    pub ready: bool,
    pub error: Option<String>,
}

/// Where a scene comes from.
#[derive(Clone)]
enum Source {
    Built(fn(&mut World)),
    Drawn(Arc<Plan>),
    File(PathBuf),
}

/// Opens a scene; [`Opened`] says when it is there. GI cameras are put where it is looked at from.
pub struct OpenPlugin {
    options: SceneOptions,
    source: Source,
    /// How the scene itself says that it is looked at.
    view: Option<SceneView>,
    /// Nits of the scene's own sky.
    sky: Option<[f32; 3]>,
}

impl OpenPlugin {
    /// Fails if there is no such scene.
    pub fn new(options: SceneOptions) -> Result<Self, String> {
        let name = options.scene.as_deref().ok_or_else(|| {
            let names = scenes::names();
            format!("a scene is wanted: the path of a .gltf or .glb file, or one of {names}")
        })?;
        let (source, view, sky) = if let Some(scene) = scenes::find(name) {
            let source = match scene.content {
                Content::Built(spawn) => Source::Built(spawn),
                Content::File(path) => Source::File(Path::new(&asset_folder()).join(path)),
            };
            (source, Some((scene.view)()), scene.sky)
        } else if let Some(scene) = RandomScene::find(name) {
            let plan = Plan::new(scene?);
            let (view, sky) = (plan.view(), plan.sky);
            (Source::Drawn(Arc::new(plan)), Some(view), sky)
        } else {
            (Source::File(gltf_path(name)?), None, None)
        };
        Ok(Self {
            options,
            source,
            view,
            sky,
        })
    }
}

/// The whole path of a glTF file.
pub fn gltf_path(name: &str) -> Result<PathBuf, String> {
    let path = Path::new(name);
    let is_gltf = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"));
    if !is_gltf {
        return Err(format!(
            "{name}: not a .gltf or .glb file, and no bundled scene; those are {}",
            scenes::names()
        ));
    }
    path.canonicalize().map_err(|e| format!("{name}: {e}"))
}

/// How the scene itself says that it is looked at; a file does not.
#[derive(Resource)]
struct OwnView(Option<SceneView>);

/// The glTF file to spawn.
#[derive(Resource)]
struct SceneFile(PathBuf, Handle<Gltf>);

/// Nits of the sky that the camera sees.
#[derive(Resource)]
struct SkyNits(LinearRgba);

impl Plugin for OpenPlugin {
    fn build(&self, app: &mut App) {
        let sky = self.options.sky.map(|nits| [nits; 3]);
        let mut gi = app.world_mut().resource_mut::<GiSettings>();
        // A sky from a file of settings is better than the scene's own.
        let chosen = matches!(gi.sky, GiSky::Constant(_));
        if let Some([r, g, b]) = sky.or(self.sky.filter(|_| !chosen)) {
            let nits = LinearRgba::rgb(r, g, b);
            gi.sky = GiSky::Constant(nits);
            app.insert_resource(SkyNits(nits));
        }
        let source = self.source.clone();
        app.insert_resource(ClearColor(Color::BLACK))
            .insert_resource(GlobalAmbientLight::NONE)
            .insert_resource(self.options.clone())
            .insert_resource(OwnView(self.view))
            .init_resource::<Opened>()
            .add_systems(Startup, move |world: &mut World| match &source {
                Source::Built(spawn) => spawn(world),
                Source::Drawn(plan) => random::spawn(world, plan),
                Source::File(path) => {
                    let handle = world.resource::<AssetServer>().load(path.clone());
                    world.insert_resource(SceneFile(path.clone(), handle));
                }
            })
            .add_systems(Update, (watch_loading, frame_scene, show_error).chain());
    }
}

/// In a window, what went wrong stays on screen.
fn show_error(mut commands: Commands, opened: Res<Opened>, mut shown: Local<bool>) {
    if let Some(error) = opened.error.as_ref().filter(|_| !*shown) {
        *shown = true;
        error!("{error}");
        commands.spawn((
            Text::new(error),
            Node {
                position_type: PositionType::Absolute,
                bottom: px(8),
                left: px(8),
                ..default()
            },
        ));
    }
}

fn watch_loading(
    mut commands: Commands,
    file: Option<Res<SceneFile>>,
    server: Res<AssetServer>,
    gltfs: Res<Assets<Gltf>>,
    mut opened: ResMut<Opened>,
    mut spawned: Local<bool>,
) {
    let Some(file) = file else { return };
    let SceneFile(path, handle) = &*file;
    if *spawned || opened.error.is_some() {
        return;
    }
    let failed = match server.get_load_states(handle) {
        Some((bevy::asset::LoadState::Failed(error), ..)) => Some(error.to_string()),
        // A texture or buffer beside the file.
        Some((_, _, bevy::asset::RecursiveDependencyLoadState::Failed(error))) => {
            Some(error.to_string())
        }
        _ => None,
    };
    if let Some(error) = failed {
        // The rest is a backtrace, where one is asked for.
        let error = error.lines().next().unwrap_or_default();
        opened.error = Some(format!("{}: {error}", path.display()));
        return;
    }
    if let Some(gltf) = gltfs.get(handle)
        && server.is_loaded_with_dependencies(handle)
    {
        *spawned = true;
        match gltf.default_scene.clone().or(gltf.scenes.first().cloned()) {
            Some(scene) => {
                commands.spawn(WorldAssetRoot(scene));
            }
            None => opened.error = Some("the file holds no scene".into()),
        }
    }
}

/// Memory for Bevy's shadow maps of point lights, and for those of spots, bytes.
const SHADOW_MEMORY: usize = 512 << 20;

/// Makes Bevy's own shadow maps smaller where a file has so many lamps that they would not fit into memory: each point
/// light has six, each spot one, of 4 bytes a texel.
fn fit_shadow_maps(commands: &mut Commands, points: usize, spots: usize) {
    let fit = |size: usize, maps: usize| {
        let texels = SHADOW_MEMORY / (4 * maps.max(1));
        // The power of two below.
        size.min(1 << (texels.max(1).ilog2() / 2)).max(16)
    };
    let default = PointLightShadowMap::default().size;
    let size = fit(default, 6 * points);
    if size < default {
        warn!("{points} point lights: Bevy's shadow maps have {size} texels a side, not {default}");
        commands.insert_resource(PointLightShadowMap { size });
    }
    let default = DirectionalLightShadowMap::default().size;
    let size = fit(default, spots);
    if size < default {
        warn!("{spots} spot lights: Bevy's shadow maps have {size} texels a side, not {default}");
        commands.insert_resource(DirectionalLightShadowMap { size });
    }
}

/// Once the scene is there: its volume, its lights, its camera.
#[allow(
    clippy::too_many_arguments,
    clippy::type_complexity,
    reason = "a system's parameters"
)]
fn frame_scene(
    mut commands: Commands,
    options: Res<SceneOptions>,
    own: Res<OwnView>,
    file: Option<Res<SceneFile>>,
    sky: Option<Res<SkyNits>>,
    mut opened: ResMut<Opened>,
    instances: Query<(), With<WorldInstance>>,
    meshes: Query<(&GlobalTransform, &Aabb), With<Mesh3d>>,
    mut lights: ParamSet<(
        Query<(
            Entity,
            Option<&mut PointLight>,
            Option<&mut SpotLight>,
            Option<&mut DirectionalLight>,
        )>,
        Query<
            (Entity, &GlobalTransform, &Projection),
            (With<Camera3d>, With<ChildOf>, Without<GiCamera>),
        >,
    )>,
    mut camera: Query<(&mut Transform, &mut Projection, &mut Exposure), With<GiCamera>>,
    mut volumes: Query<&mut GiVolume>,
    mut waited: Local<u32>,
) {
    if opened.ready || opened.error.is_some() {
        return;
    }
    if file.is_some() && instances.is_empty() {
        return;
    }
    // Bounds and transforms are computed after a scene is spawned.
    *waited += 1;
    if *waited < 3 {
        return;
    }
    let (mut min, mut max) = (Vec3::MAX, Vec3::MIN);
    for (transform, aabb) in &meshes {
        for i in 0..8 {
            let sign =
                Vec3::new((i & 1) as f32, ((i >> 1) & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
            let corner = Vec3::from(aabb.center) + Vec3::from(aabb.half_extents) * sign;
            let p = transform.transform_point(corner);
            if p.is_finite() {
                min = min.min(p);
                max = max.max(p);
            }
        }
    }
    if min.x > max.x {
        if *waited > 600 {
            opened.error = Some("the scene holds no mesh".into());
        }
        return;
    }
    opened.ready = true;
    let center = 0.5 * (min + max);
    let diagonal = (max - min).length().max(1e-4);

    if file.is_some() {
        let resolution = options.resolution.unwrap_or(128);
        commands.spawn(GiVolume::around(min, max, resolution));
    }
    if let Some(resolution) = options.resolution {
        for mut volume in &mut volumes {
            volume.resolution = resolution;
        }
    }
    let points = lights.p0().iter().filter(|light| light.1.is_some()).count();
    let spots = lights.p0().iter().filter(|light| light.2.is_some()).count();
    fit_shadow_maps(&mut commands, points, spots);
    // For comparison with a path tracer: lights cast shadows, and end nowhere unless told to.
    for (entity, point, spot, directional) in &mut lights.p0() {
        if options.sun.is_some() && (point.is_some() || spot.is_some() || directional.is_some()) {
            commands.entity(entity).despawn();
            continue;
        }
        if let Some(mut light) = point {
            light.shadow_maps_enabled = true;
            light.radius = 0.0;
            if light.range == 20.0 {
                light.range = 1e4;
            }
        }
        if let Some(mut light) = spot {
            light.shadow_maps_enabled = true;
            light.radius = 0.0;
            if light.range == 20.0 {
                light.range = 1e4;
            }
        }
        if let Some(mut light) = directional {
            light.shadow_maps_enabled = true;
            commands.entity(entity).insert(cascades(diagonal));
        }
    }
    if let Some(direction) = options.sun {
        commands.spawn((
            DirectionalLight {
                illuminance: options.lux,
                shadow_maps_enabled: true,
                ..default()
            },
            Transform::default().looking_to(direction.normalize_or(Vec3::NEG_Y), Vec3::X),
            cascades(diagonal),
        ));
    }

    // The camera: options, else the scene's own, else the file's first, else all of it.
    let bundled = own.0;
    let fov = options
        .fov
        .or(bundled.map(|b| b.fov))
        .unwrap_or(45.0)
        .to_radians();
    let mut from_file = None;
    let mut file_cameras: Vec<_> = lights
        .p1()
        .iter()
        .map(|(e, t, p)| (e, *t, p.clone()))
        .collect();
    file_cameras.sort_by_key(|(e, ..)| *e);
    for (entity, transform, projection) in file_cameras {
        commands
            .entity(entity)
            .remove::<Camera3d>()
            .remove::<Camera>();
        // A camera is not scaled with its node (glTF 2.0, section 3.10.2).
        let transform = transform.compute_transform().with_scale(Vec3::ONE);
        from_file.get_or_insert((transform, projection));
    }
    let radius = diagonal * 0.5;
    let all = SceneView {
        eye: center + Vec3::new(0.0, 0.25, 1.0).normalize() * radius / (0.5 * fov).sin(),
        look: center,
        fov: 45.0,
        ev100: 9.7,
        speed: radius * 0.3,
    };
    for (mut transform, mut projection, mut exposure) in &mut camera {
        let view = bundled.unwrap_or(all);
        if let (None, Some((t, p))) = (bundled, &from_file) {
            *transform = *t;
            *projection = p.clone();
        } else {
            *transform = Transform::from_translation(view.eye).looking_at(view.look, Vec3::Y);
        }
        if options.eye.is_some() || options.look.is_some() {
            let eye = options.eye.unwrap_or(transform.translation);
            let look = options.look.unwrap_or(view.look);
            let up = if (look - eye).normalize_or_zero().y.abs() > 0.999 {
                Vec3::X
            } else {
                Vec3::Y
            };
            *transform = Transform::from_translation(eye).looking_at(look, up);
        }
        let far = (diagonal * 4.0).max(1000.0);
        if let Projection::Perspective(p) = &mut *projection {
            if options.fov.is_some() || bundled.is_some() || from_file.is_none() {
                p.fov = fov;
            }
            p.far = far;
            p.near = p.near.min(0.05).min(1e-3 * diagonal);
        }
        exposure.ev100 = options.ev100.unwrap_or(view.ev100);
        if let Some(sky) = &sky {
            // The sky is seen as bright as it shines; a clear colour is not exposed by Bevy.
            let seen = sky.0 * exposure.exposure();
            commands.insert_resource(ClearColor(seen.with_alpha(1.0).into()));
        }
    }
}

/// Shadows of a sun over a whole scene, as Bevy has them, of any size.
fn cascades(diagonal: f32) -> CascadeShadowConfig {
    let maximum_distance = diagonal * 1.5;
    CascadeShadowConfigBuilder {
        minimum_distance: 1e-3 * maximum_distance.min(100.0),
        first_cascade_far_bound: (0.2 * maximum_distance).min(10.0),
        maximum_distance,
        ..default()
    }
    .build()
}

/// A GI camera that flies, for [`OpenPlugin`] to put in its place.
pub fn camera() -> impl Bundle {
    (
        Camera3d::default(),
        GiCamera::default(),
        Exposure::default(),
        Projection::from(PerspectiveProjection::default()),
        Transform::default(),
        FreeCamera::default(),
    )
}
