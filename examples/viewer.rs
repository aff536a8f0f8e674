//! Opens any glTF, or a bundled scene by name, with global illumination; in a window, or headless
//! for pictures, luminances and statistics. `--help` lists the options.

mod common;

use std::{path::PathBuf, process::ExitCode};

use bevy::{
    camera::{Exposure, primitives::Aabb},
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
    reflect::{GetPath, serde::TypedReflectDeserializer},
    render::render_resource::TextureFormat,
    world_serialization::WorldInstance,
};
use bevy_gi::{FieldRange, GiSupport, prelude::*, reference::ReferenceSettings};
use clap::Parser;
use common::{
    adapter, capture,
    controls::ControlsPlugin,
    headless::{Headless, image_target},
    reference,
    scenes::{SceneView, asset_folder, cornell, sponza},
};
use serde::de::DeserializeSeed;

/// Opens a glTF file or a bundled scene with global illumination.
#[derive(Parser, Resource, Clone, Debug)]
#[command(name = "viewer", allow_negative_numbers = true)]
struct Options {
    /// A .gltf or .glb file, or: cornell, sponza.
    scene: Option<String>,
    /// How indirect light is computed: off, vct, reference.
    #[arg(long, value_parser = technique)]
    technique: Option<Technique>,
    /// No window: render, write, exit.
    #[arg(long)]
    headless: bool,
    /// Width x height, pixels.
    #[arg(long, default_value = "1280x720", value_parser = size)]
    size: UVec2,
    /// Frames rendered before the capture, 1/60 s each; with the reference, paths a pixel.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Camera position x,y,z, metres. Default: the file's first camera, else the whole scene.
    #[arg(long, value_parser = vector, allow_hyphen_values = true)]
    eye: Option<Vec3>,
    /// Point that the camera looks at.
    #[arg(long, value_parser = vector, allow_hyphen_values = true)]
    look: Option<Vec3>,
    /// Vertical field of view, degrees, 1 to 179.
    #[arg(long, value_parser = |text: &str| number(text, 1.0, 179.0))]
    fov: Option<f32>,
    /// Adds a sun whose light travels in this direction, in place of the file's lights.
    #[arg(long, value_parser = vector, allow_hyphen_values = true)]
    sun: Option<Vec3>,
    /// Illuminance of that sun, lux.
    #[arg(long, default_value_t = 10_000.0, value_parser = |text: &str| number(text, 0.0, 1e9))]
    lux: f32,
    /// Constant sky, nits.
    #[arg(long, value_parser = |text: &str| number(text, 0.0, 1e6))]
    sky: Option<f32>,
    /// Exposure value at ISO 100.
    #[arg(long, value_parser = |text: &str| number(text, -20.0, 40.0))]
    ev100: Option<f32>,
    /// What is shown; --list names all.
    #[arg(long, value_parser = view)]
    view: Option<GiView>,
    /// Sets a field, for example VoxelConeTracingSettings.cones=8. Repeatable.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    sets: Vec<String>,
    /// Settings as RON: ( settings: (..), vct: (..), debug: (..), reference: (..) ), each optional.
    #[arg(long, value_name = "FILE.ron")]
    settings: Option<PathBuf>,
    /// Voxels along the longest side of the volume that is put around the scene.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(32..=512))]
    resolution: u32,
    /// Picture: .png as seen, .exr luminances in nits before exposure and tone mapping.
    #[arg(long, value_parser = picture_path)]
    out: Option<PathBuf>,
    /// Adapter, passes, memory and settings as JSON.
    #[arg(long)]
    stats: Option<PathBuf>,
    /// Lists techniques, views and settings.
    #[arg(long)]
    list: bool,
}

/// What `--technique` names.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Technique {
    Gi(GiTechnique),
    /// The path tracer.
    Reference,
}

/// Names of all techniques.
fn technique_names() -> String {
    let names = GiTechnique::ALL.map(GiTechnique::name).join(" ");
    format!("{names} reference")
}

fn technique(name: &str) -> Result<Technique, String> {
    match GiTechnique::from_name(name) {
        Some(technique) => Ok(Technique::Gi(technique)),
        None if name == "reference" => Ok(Technique::Reference),
        None => Err(format!(
            "no such technique; there are: {}",
            technique_names()
        )),
    }
}

fn view(name: &str) -> Result<GiView, String> {
    GiView::from_name(name).ok_or_else(|| {
        let names = GiView::ALL.map(GiView::name).join(", ");
        format!("no such view; there are: {names}")
    })
}

/// A number in a range.
fn number(text: &str, min: f32, max: f32) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|value| (min..=max).contains(value))
        .ok_or(format!("a number from {min} to {max} is wanted"))
}

fn picture_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let known =
        |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("png") || e.eq_ignore_ascii_case("exr");
    match path.extension() {
        Some(extension) if known(extension) => Ok(path),
        _ => Err("a .png or .exr file is wanted".into()),
    }
}

fn size(text: &str) -> Result<UVec2, String> {
    text.split_once('x')
        .and_then(|(w, h)| Some(UVec2::new(w.parse().ok()?, h.parse().ok()?)))
        .filter(|s| s.min_element() > 0 && s.max_element() <= 8192)
        .ok_or("width x height is wanted, each 1 to 8192, like 640x360".into())
}

fn vector(text: &str) -> Result<Vec3, String> {
    let parts: Result<Vec<f32>, _> = text.split(',').map(|p| p.trim().parse()).collect();
    match parts.as_deref() {
        Ok([x, y, z]) if [x, y, z].iter().all(|v| v.is_finite()) => Ok(Vec3::new(*x, *y, *z)),
        _ => Err("three numbers are wanted, like 1,2.5,-3".into()),
    }
}

fn main() -> ExitCode {
    let options = Options::parse();
    let result = if options.list {
        list()
    } else {
        adapter::find().and_then(|()| match options.headless {
            true => headless(options),
            false => window(options),
        })
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("viewer: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Everything that `--settings` can hold.
#[derive(serde::Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
struct SettingsFile {
    settings: GiSettings,
    vct: VoxelConeTracingSettings,
    debug: GiDebugSettings,
    reference: ReferenceSettings,
}

/// Where the scene is, and whether it exists.
fn scene_path(options: &Options) -> Result<Option<PathBuf>, String> {
    let name = options
        .scene
        .as_deref()
        .ok_or("a scene is wanted: cornell, sponza, or the path of a .gltf or .glb file")?;
    match name {
        "cornell" => Ok(None),
        "sponza" => Ok(Some(PathBuf::from(asset_folder()).join(sponza::PATH))),
        path => Ok(Some(PathBuf::from(path))),
    }
    .and_then(|path: Option<PathBuf>| match path {
        None => Ok(None),
        Some(path) => {
            let is_gltf = path
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("gltf") || e.eq_ignore_ascii_case("glb"));
            if !is_gltf {
                return Err(format!(
                    "{}: not a .gltf or .glb file, and no bundled scene",
                    path.display()
                ));
            }
            path.canonicalize()
                .map(Some)
                .map_err(|e| format!("{}: {e}", path.display()))
        }
    })
}

/// Applies `--settings`, `--set` and the options that stand for settings.
fn configure(world: &mut World, options: &Options) -> Result<(), String> {
    if let Some(path) = &options.settings {
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = std::fs::read_to_string(path).map_err(|e| fail(&e))?;
        let file: SettingsFile = ron::from_str(&text).map_err(|e| fail(&e))?;
        world.insert_resource(file.settings);
        world.insert_resource(file.vct);
        world.insert_resource(file.debug);
        world.insert_resource(file.reference);
    } else {
        let mut gi = world.resource_mut::<GiSettings>();
        gi.replace_ambient = true;
        if options.headless {
            gi.sky = GiSky::Black;
        }
    }
    world.init_resource::<ReferenceSettings>();
    let mut gi = world.resource_mut::<GiSettings>();
    match options.technique {
        Some(Technique::Gi(technique)) => gi.technique = technique,
        Some(Technique::Reference) => gi.technique = GiTechnique::Off,
        None => {}
    }
    if let Some(nits) = options.sky {
        gi.sky = GiSky::Constant(LinearRgba::rgb(nits, nits, nits));
    }
    if let Some(view) = options.view {
        world.resource_mut::<GiDebugSettings>().view = view;
    }
    for set in &options.sets {
        apply_set(world, set)?;
    }
    Ok(())
}

/// `Resource.path.to.field=value`, the value as RON.
fn apply_set(world: &mut World, set: &str) -> Result<(), String> {
    let wanted = "Settings.field=value is wanted";
    let (path, value) = set
        .split_once('=')
        .ok_or(format!("--set {set}: {wanted}"))?;
    let (resource, field) = path
        .split_once('.')
        .ok_or(format!("--set {set}: {wanted}"))?;
    let registry = world.resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let unknown = || format!("--set {set}: there is no settings resource '{resource}'; see --list");
    let mut target = settings_mut(world, resource).ok_or_else(unknown)?;
    let target = target
        .reflect_path_mut(format!(".{field}").as_str())
        .map_err(|_| format!("--set {set}: '{resource}' has no field '{field}'; see --list"))?;
    let type_id = target
        .get_represented_type_info()
        .map(|info| info.type_id())
        .ok_or_else(unknown)?;
    let field_type = registry.get(type_id).ok_or_else(unknown)?;
    let fail = |e: &dyn std::fmt::Display| format!("--set {set}: {e}");
    let mut deserializer = ron::de::Deserializer::from_str(value).map_err(|e| fail(&e))?;
    let new = TypedReflectDeserializer::new(field_type, &registry)
        .deserialize(&mut deserializer)
        .map_err(|e| fail(&e))?;
    deserializer.end().map_err(|e| fail(&e))?;
    target.apply(&*new);
    Ok(())
}

/// The settings resource of that name.
fn settings_mut<'w>(world: &'w mut World, name: &str) -> Option<Mut<'w, dyn Reflect>> {
    fn of<T: Resource<Mutability = bevy::ecs::component::Mutable> + Reflect>(
        world: &mut World,
    ) -> Mut<'_, dyn Reflect> {
        world
            .resource_mut::<T>()
            .map_unchanged(|t| t as &mut dyn Reflect)
    }
    Some(match name {
        "GiSettings" => of::<GiSettings>(world),
        "VoxelConeTracingSettings" => of::<VoxelConeTracingSettings>(world),
        "GiDebugSettings" => of::<GiDebugSettings>(world),
        "ReferenceSettings" => of::<ReferenceSettings>(world),
        _ => return None,
    })
}

/// The variants of an enum, for `--list`.
fn variants(value: &dyn PartialReflect) -> String {
    match value.get_represented_type_info() {
        Some(bevy::reflect::TypeInfo::Enum(info)) => {
            format!("  {}", info.variant_names().join(" | "))
        }
        _ => String::new(),
    }
}

fn list() -> Result<(), String> {
    println!("techniques: {}", technique_names());
    println!("views: {}", GiView::ALL.map(GiView::name).join(" "));
    println!("settings and components, with their defaults and ranges:");
    let dump = |name: &str, value: &dyn PartialReflect, ranges: Vec<FieldRange>| {
        if let bevy::reflect::ReflectRef::Struct(fields) = value.reflect_ref() {
            for i in 0..fields.field_len() {
                let field = fields.name_at(i).unwrap_or_default();
                let value = fields.field_at(i).unwrap();
                let range = match ranges.iter().find(|range| range.field == field) {
                    // Single precision, as the fields have it.
                    Some(range) => format!("  {}..={}", range.min as f32, range.max as f32),
                    None => variants(value),
                };
                println!("  {name}.{field} = {value:?}{range}");
            }
        }
    };
    dump("GiSettings", &GiSettings::default(), GiSettings::ranges());
    dump(
        "VoxelConeTracingSettings",
        &VoxelConeTracingSettings::default(),
        VoxelConeTracingSettings::ranges(),
    );
    dump("GiVolume", &GiVolume::default(), GiVolume::ranges());
    dump("GiLight", &GiLight::default(), GiLight::ranges());
    dump("GiDebugSettings", &GiDebugSettings::default(), vec![]);
    dump("ReferenceSettings", &ReferenceSettings::default(), vec![]);
    Ok(())
}

/// The glTF file to spawn.
#[derive(Resource)]
struct SceneFile(Option<PathBuf>);

/// What has been done of the scene's set-up.
#[derive(Resource, Default)]
struct SceneReady {
    framed: bool,
    error: Option<String>,
}

fn add_scene(app: &mut App, options: &Options, file: Option<PathBuf>) {
    app.insert_resource(ClearColor(Color::BLACK))
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(options.clone())
        .insert_resource(SceneFile(file))
        .init_resource::<SceneReady>()
        .add_systems(Startup, spawn_scene)
        .add_systems(Update, (watch_loading, frame_scene, show_error).chain());
}

/// In a window, what went wrong stays on screen.
fn show_error(mut commands: Commands, ready: Res<SceneReady>, mut shown: Local<bool>) {
    if let Some(error) = ready.error.as_ref().filter(|_| !*shown) {
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

#[derive(Resource)]
struct LoadedGltf(Handle<Gltf>);

fn spawn_scene(
    mut commands: Commands,
    file: Res<SceneFile>,
    server: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    match &file.0 {
        None => cornell::spawn(&mut commands, &mut meshes, &mut materials),
        Some(path) => {
            commands.insert_resource(LoadedGltf(server.load(path.clone())));
        }
    }
}

fn watch_loading(
    mut commands: Commands,
    handle: Option<Res<LoadedGltf>>,
    server: Res<AssetServer>,
    gltfs: Res<Assets<Gltf>>,
    file: Res<SceneFile>,
    mut ready: ResMut<SceneReady>,
    mut spawned: Local<bool>,
) {
    let Some(handle) = handle else { return };
    if *spawned || ready.error.is_some() {
        return;
    }
    let failed = match server.get_load_states(&handle.0) {
        Some((bevy::asset::LoadState::Failed(error), ..)) => Some(error.to_string()),
        // A texture or buffer beside the file.
        Some((_, _, bevy::asset::RecursiveDependencyLoadState::Failed(error))) => {
            Some(error.to_string())
        }
        _ => None,
    };
    if let Some(error) = failed {
        let path = file.0.as_ref().map(|p| p.display().to_string());
        // The rest is a backtrace, where one is asked for.
        let error = error.lines().next().unwrap_or_default();
        ready.error = Some(format!("{}: {error}", path.unwrap_or_default()));
        return;
    }
    if let Some(gltf) = gltfs.get(&handle.0)
        && server.is_loaded_with_dependencies(&handle.0)
    {
        *spawned = true;
        match gltf.default_scene.clone().or(gltf.scenes.first().cloned()) {
            Some(scene) => {
                commands.spawn(WorldAssetRoot(scene));
            }
            None => ready.error = Some("the file holds no scene".into()),
        }
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
    options: Res<Options>,
    file: Res<SceneFile>,
    mut ready: ResMut<SceneReady>,
    instances: Query<(), With<WorldInstance>>,
    meshes: Query<(&GlobalTransform, &Aabb), With<Mesh3d>>,
    mut lights: ParamSet<(
        Query<(
            Entity,
            Option<&mut PointLight>,
            Option<&mut SpotLight>,
            Option<&mut DirectionalLight>,
        )>,
        Query<(Entity, &GlobalTransform, &Projection), (With<Camera3d>, Without<GiCamera>)>,
    )>,
    mut camera: Query<(&mut Transform, &mut Projection, &mut Exposure), With<GiCamera>>,
    mut volumes: Query<&mut GiVolume>,
    mut waited: Local<u32>,
) {
    if ready.framed || ready.error.is_some() {
        return;
    }
    if file.0.is_some() && instances.is_empty() {
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
            ready.error = Some("the scene holds no mesh".into());
        }
        return;
    }
    ready.framed = true;
    let center = 0.5 * (min + max);
    let extent = (max - min).max(Vec3::splat(0.01));

    if file.0.is_some() {
        commands.spawn((
            GiVolume::new(extent * 1.04 + 0.02 * extent.max_element())
                .with_resolution(options.resolution),
            Transform::from_translation(center),
        ));
    }
    for mut volume in &mut volumes {
        volume.resolution = options.resolution;
    }
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
            bevy::light::CascadeShadowConfigBuilder {
                maximum_distance: extent.length() * 1.5,
                ..default()
            }
            .build(),
        ));
    }

    // The camera: options, else the bundled scene's, else the file's first, else all of it.
    let bundled = match options.scene.as_deref() {
        Some("cornell") => Some(cornell::view()),
        Some("sponza") => Some(sponza::view()),
        _ => None,
    };
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
        from_file.get_or_insert((transform.compute_transform(), projection));
    }
    let radius = extent.length() * 0.5;
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
        let far = (extent.length() * 4.0).max(1000.0);
        if let Projection::Perspective(p) = &mut *projection {
            if options.fov.is_some() || bundled.is_some() || from_file.is_none() {
                p.fov = fov;
            }
            p.far = far;
            p.near = p.near.min(0.05);
        }
        exposure.ev100 = options.ev100.unwrap_or(view.ev100);
        if let Some(nits) = options.sky {
            // The sky is seen as bright as it shines; a clear colour is not exposed by Bevy.
            let seen = nits * exposure.exposure();
            commands.insert_resource(ClearColor(Color::linear_rgb(seen, seen, seen)));
        }
    }
}

fn spawn_camera(options: &Options) -> impl Bundle + use<> {
    (
        Camera3d::default(),
        GiCamera::default(),
        Exposure {
            ev100: options.ev100.unwrap_or(9.7),
        },
        Projection::from(PerspectiveProjection::default()),
        Transform::default(),
    )
}

fn window(options: Options) -> Result<(), String> {
    if options.technique == Some(Technique::Reference) {
        return Err("--technique reference needs --headless".into());
    }
    if options.out.is_some() || options.stats.is_some() {
        return Err("--out and --stats need --headless".into());
    }
    let file = scene_path(&options)?;
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(AssetPlugin {
                file_path: asset_folder(),
                unapproved_path_mode: bevy::asset::UnapprovedPathMode::Allow,
                ..default()
            })
            .set(WindowPlugin {
                primary_window: Some(Window {
                    title: "bevy_gi viewer".into(),
                    resolution: (options.size.x, options.size.y).into(),
                    ..default()
                }),
                ..default()
            }),
    )
    .add_plugins((GiPlugins, ControlsPlugin { help: "" }));
    configure(app.world_mut(), &options)?;
    add_scene(&mut app, &options, file);
    app.world_mut().spawn((
        spawn_camera(&options),
        bevy::camera_controller::free_camera::FreeCamera::default(),
    ));
    app.run();
    Ok(())
}

fn headless(options: Options) -> Result<(), String> {
    let file = scene_path(&options)?;
    let mut configured = Ok(());
    let mut headless = Headless::new(|app| {
        app.add_plugins(GiPlugins);
        configured = configure(app.world_mut(), &options);
        add_scene(app, &options, file);
    });
    configured?;
    if let Some(GiSupport::Unsupported(why)) = headless.app.world().get_resource() {
        eprintln!("{why}");
    }
    let exr = options
        .out
        .as_ref()
        .is_some_and(|p| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")));
    let format = if exr {
        TextureFormat::Rgba32Float
    } else {
        TextureFormat::Rgba8UnormSrgb
    };
    let target = headless.target(options.size, format);
    let view = headless.app.world().resource::<GiDebugSettings>().view;
    let linear = exr || !view.is_luminance();
    let camera = headless
        .app
        .world_mut()
        .spawn((
            spawn_camera(&options),
            image_target(&target),
            if linear {
                Tonemapping::None
            } else {
                Tonemapping::TonyMcMapface
            },
            bevy::core_pipeline::tonemapping::DebandDither::Disabled,
        ))
        .id();
    let loaded = headless.wait_until(|world| {
        let ready = world.resource::<SceneReady>();
        ready.framed || ready.error.is_some()
    });
    if let Some(error) = &headless.app.world().resource::<SceneReady>().error {
        return Err(error.clone());
    }
    if !loaded {
        return Err("the scene did not finish loading".into());
    }
    if let Some(error) = headless.pipeline_errors().first() {
        return Err(format!("a shader failed: {error}"));
    }
    let exposure = headless
        .app
        .world()
        .get::<Exposure>(camera)
        .copied()
        .unwrap_or_default()
        .exposure();
    // From here on nothing depends on how long loading took.
    let picture = if options.technique == Some(Technique::Reference) {
        let world = headless.app.world_mut();
        let settings = *world.resource::<ReferenceSettings>();
        let samples = options.frames.max(1);
        let traced = reference::trace(world, camera, options.size, samples, settings)?;
        let picture = reference::picture(&traced, view, exposure)?;
        if exr {
            picture
        } else if linear {
            picture.encoded()
        } else {
            reference::show(headless.app.world_mut(), &picture, &target);
            headless.wait_until(|_| true);
            headless.picture(&target)
        }
    } else {
        headless.app.world_mut().resource_mut::<GiHistory>().reset();
        headless.steps(options.frames.max(1));
        headless.picture(&target)
    };
    if let Some(path) = &options.out {
        let scale = if view.is_luminance() { exposure } else { 1.0 };
        capture::write(&picture, if exr { scale } else { 1.0 }, path)?;
        println!("{}", path.display());
    }
    if let Some(path) = &options.stats {
        let stats = capture::statistics(&headless);
        let text = serde_json::to_string_pretty(&stats).map_err(|e| e.to_string())?;
        std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}
