//! Every shader of the crate, composed as Bevy composes it and validated, without a GPU.

use std::collections::BTreeMap;

use bevy::{
    DefaultPlugins,
    app::{App, PluginGroup, PluginsState},
    asset::{AssetServer, Assets, Handle},
    log::LogPlugin,
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuFeatures, WgpuSettings},
    },
    shader::{Shader, ShaderCache, ShaderCacheError, ShaderCacheSource, ShaderDefVal},
    winit::WinitPlugin,
};
use naga::{
    AddressSpace, ImageClass, TypeInner,
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};

use crate::{
    apply,
    debug::GiView,
    plugins::{self, GiPlugins},
};

/// Shaders with entry points, and the definitions of each of their variants.
const VARIANTS: [(&str, &[&[&str]]); 34] = [
    ("scene/voxels/allocate.wgsl", &[&[]]),
    ("scene/voxels/resolve.wgsl", &[&[]]),
    ("scene/voxels/voxelize.wgsl", &[PREPASS, PREPASS_BARE]),
    (
        "scene/voxels/voxelize_unknown.wgsl",
        &[PREPASS, PREPASS_BARE],
    ),
    (
        "technique/vct/light.wgsl",
        &[&["CARRY"], &["BOUNCE"], &["LIGHT"]],
    ),
    (
        "technique/vct/filter.wgsl",
        &[&["CLEAR"], &["VOXELS"], &["CELLS"]],
    ),
    ("technique/vct/gather.wgsl", &[&[]]),
    ("technique/vct/export.wgsl", &[&[]]),
    ("apply/temporal.wgsl", &[&[]]),
    ("apply/denoise.wgsl", &[&[]]),
    ("apply/composite.wgsl", &[&[]]),
    ("technique/vct/debug.wgsl", &[&[]]),
    ("debug/light_maps.wgsl", &[&[], &["RSM"]]),
    ("scene/rsm/resolve.wgsl", &[&[]]),
    ("scene/rsm/sum.wgsl", &[&[]]),
    ("scene/rsm/vpls.wgsl", &[&[]]),
    ("debug/shapes.wgsl", &[&[]]),
    ("debug/vpls.wgsl", &[&[]]),
    ("apply/probes.wgsl", &[&[]]),
    ("scene/probes/place.wgsl", &[&[]]),
    ("scene/probes/moments.wgsl", &[&[]]),
    ("debug/voxels.wgsl", &[&[]]),
    ("technique/hints/albedo.wgsl", &[&[]]),
    ("technique/hints/carry.wgsl", &[&[]]),
    ("surface/depth.wgsl", &[&[]]),
    ("technique/hints/marks.wgsl", &[&[]]),
    ("technique/hints/pick.wgsl", &[&[]]),
    ("technique/hints/lights.wgsl", &[&[]]),
    ("technique/hints/bounce.wgsl", &[&[], &["SURFACES"]]),
    ("technique/hints/exchange.wgsl", &[&[]]),
    ("technique/hints/sum.wgsl", &[&[]]),
    ("technique/hints/gather.wgsl", &[&[]]),
    ("technique/hints/export.wgsl", &[&[]]),
    ("technique/hints/debug.wgsl", &[&[]]),
];

/// What Bevy's prepass defines for a mesh with normals, texture coordinates and colours.
const PREPASS: &[&str] = &[
    "PREPASS_PIPELINE",
    "VIEW_PROJECTION_ORTHOGRAPHIC",
    "PREPASS_FRAGMENT",
    "DEFERRED_PREPASS",
    "NORMAL_PREPASS_OR_DEFERRED_PREPASS",
    "MOTION_VECTOR_PREPASS_OR_DEFERRED_PREPASS",
    "VERTEX_OUTPUT_INSTANCE_INDEX",
    "VERTEX_POSITIONS",
    "VERTEX_NORMALS",
    "VERTEX_UVS",
    "VERTEX_UVS_A",
    "VERTEX_COLORS",
    "MAY_DISCARD",
];

/// The same for a mesh that has nothing but positions.
const PREPASS_BARE: &[&str] = &[
    "PREPASS_PIPELINE",
    "VIEW_PROJECTION_ORTHOGRAPHIC",
    "PREPASS_FRAGMENT",
    "DEFERRED_PREPASS",
    "NORMAL_PREPASS_OR_DEFERRED_PREPASS",
    "MOTION_VECTOR_PREPASS_OR_DEFERRED_PREPASS",
    "VERTEX_OUTPUT_INSTANCE_INDEX",
    "VERTEX_POSITIONS",
];

/// Imported by the composite.
const FULLSCREEN: &str = "embedded://bevy_core_pipeline/fullscreen_vertex_shader/fullscreen.wgsl";

type Validated = (naga::Module, ModuleInfo);

fn validate(
    _: &(),
    source: ShaderCacheSource,
    _: &bevy::shader::ValidateShader,
) -> Result<Validated, ShaderCacheError> {
    let ShaderCacheSource::Naga(module) = source else {
        return Err(ShaderCacheError::CreateShaderModule("no WGSL".into()));
    };
    match Validator::new(ValidationFlags::all(), Capabilities::all()).validate(&module) {
        Ok(info) => Ok((module, info)),
        Err(error) => Err(ShaderCacheError::CreateShaderModule(format!("{error:?}"))),
    }
}

/// All of Bevy and of this crate, without a renderer and a window.
pub(crate) fn add_plugins(app: &mut App) {
    app.add_plugins((
        DefaultPlugins
            .set(RenderPlugin {
                render_creation: RenderCreation::Automatic(Box::new(WgpuSettings {
                    backends: None,
                    ..Default::default()
                })),
                ..Default::default()
            })
            .disable::<WinitPlugin>()
            .disable::<LogPlugin>(),
        GiPlugins,
    ));
}

/// All plugins are ready.
pub(crate) fn finish(app: &mut App) {
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
}

/// Such an app, with Bevy's shaders and ours loaded.
pub(crate) fn load(shaders: &[&str]) -> (App, Vec<Handle<Shader>>) {
    let mut app = App::new();
    add_plugins(&mut app);
    finish(&mut app);
    let server = app.world().resource::<AssetServer>().clone();
    let handles: Vec<_> = shaders
        .iter()
        .map(|path| server.load(format!("embedded://bevy_gi/{path}")))
        // With a renderer, Bevy would load this one itself.
        .chain([server.load(FULLSCREEN)])
        .collect();
    // Libraries are loaded by other threads, nobody waits for them.
    let mut calm = 0;
    let mut before = 0;
    for _ in 0..5000 {
        app.update();
        let shaders = app.world().resource::<Assets<Shader>>();
        let done = handles.iter().all(|h| shaders.contains(h)) && shaders.len() == before;
        before = shaders.len();
        calm = if done { calm + 1 } else { 0 };
        if calm > 100 {
            return (app, handles);
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    panic!("the shaders do not load");
}

#[test]
fn shaders_are_valid_and_fit_the_limits_of_webgpu() {
    let files: Vec<_> = VARIANTS.iter().map(|(file, _)| *file).collect();
    let (app, handles) = load(&files);
    let mut cache = ShaderCache::<Validated, ()>::new(
        (),
        WgpuFeatures::empty(),
        // No flags, of a type that Bevy does not name.
        std::iter::empty().collect(),
        validate,
    );
    for (id, shader) in app.world().resource::<Assets<Shader>>().iter() {
        cache.set_shader(id, shader.clone());
    }

    let server = app.world().resource::<AssetServer>();
    let mut common = plugins::shader_defs(server);
    // What Bevy's pipeline cache and prepass add.
    for (name, value) in [
        ("AVAILABLE_STORAGE_BUFFER_BINDINGS", 8),
        ("MATERIAL_BIND_GROUP", 3),
        ("MAX_CASCADES_PER_LIGHT", 4),
        ("MAX_DIRECTIONAL_LIGHTS", 10),
    ] {
        common.push(ShaderDefVal::UInt(name.into(), value));
    }
    common.extend(GiView::shader_defs());
    common.extend(apply::fog::shader_defs());

    let mut passes = 0;
    for ((file, variants), handle) in VARIANTS.iter().zip(&handles) {
        for variant in *variants {
            let mut defs = common.clone();
            defs.extend(variant.iter().map(|def| ShaderDefVal::from(*def)));
            let composed = cache.get(0, handle.id(), &defs);
            let validated = composed.unwrap_or_else(|error| {
                let error = match error {
                    ShaderCacheError::ProcessShaderError(error) => {
                        error.emit_to_string(&cache.composer)
                    }
                    other => other.to_string(),
                };
                panic!("{file} {variant:?}: {error}")
            });
            let (module, info) = &*validated;
            for (i, entry) in module.entry_points.iter().enumerate() {
                passes += 1;
                let uses = info.get_entry_point(i);
                let mut counts = BTreeMap::<&str, u32>::new();
                for (global, variable) in module.global_variables.iter() {
                    if uses[global].is_empty() {
                        continue;
                    }
                    let kind = match (variable.space, &module.types[variable.ty].inner) {
                        (AddressSpace::Storage { .. }, _) => "storage buffers",
                        (
                            _,
                            TypeInner::Image {
                                class: ImageClass::Storage { .. },
                                ..
                            },
                        ) => "storage textures",
                        _ => continue,
                    };
                    *counts.entry(kind).or_default() += 1;
                }
                let count = |kind| counts.get(kind).copied().unwrap_or(0);
                assert!(
                    count("storage buffers") <= 8 && count("storage textures") <= 4,
                    "{file}, {}: {counts:?}; WebGPU guarantees 8 buffers and 4 textures",
                    entry.name
                );
            }
        }
    }
    assert!(passes >= 15, "only {passes} entry points were found");
}

/// Without a renderer the plugin says so, and the app goes on.
#[test]
fn an_app_without_a_renderer_goes_on() {
    let (mut app, _) = load(&[]);
    let support = app.world().resource::<crate::GiSupport>();
    let why = support.reason().expect("there is no renderer");
    assert!(
        why.contains("bevy_gi is off") && why.contains("mesa-vulkan-drivers"),
        "{why}"
    );
    let world = app.world_mut();
    world.spawn((
        bevy::camera::Camera3d::default(),
        crate::GiCamera::default(),
    ));
    world.spawn(crate::GiVolume::default());
    for _ in 0..3 {
        app.update();
    }
}
