//! The whole app on devices that do nothing: wgpu holds every layout, pipeline and resource against the limits of
//! such a device, without a GPU.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex},
};

use bevy::{
    app::PluginGroupBuilder,
    camera::RenderTarget,
    mesh::{
        VertexAttributeValues,
        morph::{MeshMorphWeights, MorphAttributes},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    pbr::{Material, MaterialPlugin},
    prelude::*,
    reflect::GetPath,
    render::{
        RenderApp, RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        render_resource::{
            AsBindGroup, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType,
            BufferBindingType, CachedPipeline, CachedPipelineState, PipelineCache,
            PipelineDescriptor, ShaderStages, TextureFormat, binding_types::storage_buffer_sized,
        },
        renderer::{
            RenderAdapter, RenderAdapterInfo, RenderDevice, RenderInstance, RenderQueue,
            WgpuWrapper,
        },
        settings::{RenderCreation, WgpuLimits},
        sync_world::MainEntity,
    },
    tasks::block_on,
    window::ExitCondition,
    winit::WinitPlugin,
};

use crate::{
    FieldRange, GiSettingsRegistry, GiStatistics, GiSupport, GiTechniques, ParametersKind,
    apply::gather::ViewIndirect,
    camera::{ExtractedGiCamera, PrimaryGiCamera},
    gpu::caps::{COMMON, DeviceNeeds, WRITTEN},
    no_renderer_tests,
    plugins::{DebugPlugin, ForwardViewsPlugin, GiCameraPlugin, OverlayPlugin},
    prelude::*,
    schedule::{GiPrepare, GiSystems},
};

/// An app with all of Bevy and of this crate, on a device that does nothing.
pub(crate) struct Idle {
    pub app: App,
    /// What wgpu finds wrong.
    errors: Arc<Mutex<Vec<String>>>,
}

/// A material that nothing is known of.
#[derive(Asset, AsBindGroup, TypePath, Clone)]
struct Unknown {}

impl Material for Unknown {}

/// A device with these limits and no features, as Bevy would make it (`bevy_render::renderer::initialize_renderer`).
fn device(required_limits: WgpuLimits) -> RenderCreation {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::NOOP,
        backend_options: wgpu::BackendOptions {
            noop: wgpu::NoopBackendOptions { enable: true },
            ..Default::default()
        },
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let adapter = block_on(instance.request_adapter(&Default::default()));
    let adapter = adapter.expect("there is an adapter that does nothing");
    let device = block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_limits,
        ..Default::default()
    }));
    let (device, queue) = device.expect("it has all limits");
    RenderCreation::manual(
        RenderDevice::from(device),
        RenderQueue(Arc::new(WgpuWrapper::new(queue))),
        RenderAdapterInfo(WgpuWrapper::new(adapter.get_info())),
        RenderAdapter(Arc::new(WgpuWrapper::new(adapter))),
        RenderInstance(Arc::new(WgpuWrapper::new(instance))),
    )
}

impl Idle {
    pub fn new(limits: WgpuLimits) -> Self {
        Self::with(limits, GiPlugins.build())
    }

    fn with(limits: WgpuLimits, plugins: PluginGroupBuilder) -> Self {
        let mut app = App::new();
        app.add_plugins((
            DefaultPlugins
                .set(RenderPlugin {
                    render_creation: device(limits),
                    synchronous_pipeline_compilation: true,
                    ..default()
                })
                .set(WindowPlugin {
                    primary_window: None,
                    exit_condition: ExitCondition::DontExit,
                    ..default()
                })
                .disable::<WinitPlugin>()
                .disable::<bevy::log::LogPlugin>()
                .disable::<PipelinedRenderingPlugin>(),
            MaterialPlugin::<Unknown>::default(),
            plugins,
        ));
        no_renderer_tests::finish(&mut app);
        let errors = Arc::new(Mutex::new(Vec::new()));
        let sink = errors.clone();
        // In the place of Bevy's, which keeps the first one and ends the app.
        let device = app.world().resource::<RenderDevice>().wgpu_device();
        device.on_uncaptured_error(Arc::new(move |error| {
            sink.lock().unwrap().push(error.to_string());
        }));
        Self { app, errors }
    }

    fn add<A: Asset>(&mut self, asset: A) -> Handle<A> {
        self.app.world_mut().resource_mut::<Assets<A>>().add(asset)
    }

    /// Something of each kind: meshes, one with nothing but positions, one with colours, one with a skin and one with a morph target, materials, lights, and a camera.
    fn spawn_scene(&mut self, volume: impl Bundle) {
        let plain = self.add(Mesh::from(Cuboid::default()));
        let mut bare = Mesh::from(Cuboid::default());
        bare.remove_attribute(Mesh::ATTRIBUTE_NORMAL);
        bare.remove_attribute(Mesh::ATTRIBUTE_UV_0);
        let mut coloured = Mesh::from(Cuboid::default());
        let colors = vec![[1.0; 4]; coloured.count_vertices()];
        coloured.insert_attribute(Mesh::ATTRIBUTE_COLOR, colors);
        let (bare, coloured) = (self.add(bare), self.add(coloured));
        let material = self.add(StandardMaterial::from(Color::WHITE));
        let masked = self.add(StandardMaterial {
            alpha_mode: AlphaMode::Mask(0.5),
            ..default()
        });
        let unknown = self.add(Unknown {});

        let mut skinned = Mesh::from(Cuboid::default());
        let vertices = skinned.count_vertices();
        skinned.insert_attribute(
            Mesh::ATTRIBUTE_JOINT_INDEX,
            VertexAttributeValues::Uint16x4(vec![[0; 4]; vertices]),
        );
        let weights = vec![[1.0, 0.0, 0.0, 0.0]; vertices];
        skinned.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights);
        let mut both = skinned.clone();
        both.set_morph_targets(vec![MorphAttributes::default(); vertices]);
        let (skinned, both) = (self.add(skinned), self.add(both));
        let inverse_bindposes = self.add(SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]));
        let target = Image::new_target_texture(64, 64, TextureFormat::Rgba8UnormSrgb, None);
        let target = self.add(target);

        let world = self.app.world_mut();
        let joint = world.spawn(Transform::default()).id();
        let skin = || SkinnedMesh {
            inverse_bindposes: inverse_bindposes.clone(),
            joints: vec![joint],
        };
        let lit = MeshMaterial3d(material);
        world.spawn((Mesh3d(plain.clone()), lit.clone()));
        world.spawn((Mesh3d(plain.clone()), MeshMaterial3d(masked.clone())));
        world.spawn((Mesh3d(bare), lit.clone()));
        world.spawn((Mesh3d(coloured), MeshMaterial3d(masked)));
        world.spawn((Mesh3d(plain), MeshMaterial3d(unknown)));
        world.spawn((Mesh3d(skinned), lit.clone(), skin()));
        let weights = MeshMorphWeights::Value { weights: vec![1.0] };
        world.spawn((Mesh3d(both), lit, skin(), weights));
        world.spawn(PointLight {
            shadow_maps_enabled: true,
            ..default()
        });
        world.spawn(DirectionalLight {
            shadow_maps_enabled: true,
            ..default()
        });
        world.spawn(SpotLight::default());
        world.spawn(RectLight::default());
        world.spawn((
            Camera3d::default(),
            GiCamera::default(),
            RenderTarget::Image(target.into()),
            Transform::from_xyz(0.0, 0.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y),
        ));
        world.spawn(volume);
    }

    /// All techniques of the app, off first.
    fn techniques(&self) -> Vec<GiTechnique> {
        let techniques = self.app.world().resource::<GiTechniques>();
        techniques.iter().map(|entry| entry.technique).collect()
    }

    fn use_technique(&mut self, technique: GiTechnique) {
        self.app.world_mut().resource_mut::<GiSettings>().technique = technique;
    }

    fn steps(&mut self, frames: usize) {
        for _ in 0..frames {
            self.app.update();
        }
    }

    fn pipelines(&self) -> &PipelineCache {
        let render_world = self.app.sub_app(RenderApp).world();
        render_world.resource::<PipelineCache>()
    }

    /// Renders until no pipeline has been waiting for a while.
    fn settle(&mut self) {
        let mut calm = 0;
        for _ in 0..5000 {
            self.app.update();
            let busy = self.pipelines().waiting_pipelines().next().is_some();
            calm = if busy { 0 } else { calm + 1 };
            if calm > 6 {
                return;
            }
            // Shaders are loaded by other threads.
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        panic!("pipelines are not compiled");
    }

    /// All debug views, and everything of techniques that has a switch is shown.
    fn views(&mut self) -> Vec<GiView> {
        let world = self.app.world_mut();
        let registry = world.resource::<GiSettingsRegistry>().clone();
        for entry in registry.iter().filter(|entry| entry.is_debug) {
            entry.change_all(world, |settings| {
                if let Ok(show) = settings.path_mut::<bool>("show") {
                    *show = true;
                }
            });
        }
        let views = world.resource::<GiViews>();
        views.iter().map(|entry| entry.view).collect()
    }

    /// Renders a scene with everything in it with every technique and view.
    pub fn make_all_pipelines(&mut self) {
        self.spawn_scene(GiVolume::new(Vec3::splat(4.0)).with_resolution(32));
        self.settle();
        for technique in self.techniques() {
            self.use_technique(technique);
            for view in self.views() {
                let world = self.app.world_mut();
                *world.resource_mut::<GiDebugSettings>() = GiDebugSettings {
                    view,
                    show_volumes: true,
                    show_ambient_cubes: true,
                    show_vpls: true,
                    show_picked: true,
                    ..default()
                };
                self.steps(3);
            }
            self.settle();
        }
    }

    /// Every pipeline of the crate.
    pub fn own_pipelines(&self) -> impl Iterator<Item = (&str, &CachedPipeline)> {
        let named = self.pipelines().pipelines().filter_map(|pipeline| {
            let label = match &pipeline.descriptor {
                PipelineDescriptor::RenderPipelineDescriptor(render) => &render.label,
                PipelineDescriptor::ComputePipelineDescriptor(compute) => &compute.label,
            };
            Some((label.as_deref()?, pipeline))
        });
        named.filter(|(label, _)| label.starts_with("gi/"))
    }

    /// wgpu has found nothing wrong, and every pipeline is there.
    #[track_caller]
    fn assert_fine(&self) {
        assert_eq!(*self.errors.lock().unwrap(), Vec::<String>::new());
        for (label, pipeline) in self.own_pipelines() {
            let state = &pipeline.state;
            assert!(
                matches!(state, CachedPipelineState::Ok(_)),
                "{label}: {state:?}"
            );
        }
    }

    fn support(&self) -> &GiSupport {
        self.app.world().resource()
    }
}

/// The layouts of a pipeline.
pub(crate) fn layouts(pipeline: &CachedPipeline) -> &[BindGroupLayoutDescriptor] {
    match &pipeline.descriptor {
        PipelineDescriptor::RenderPipelineDescriptor(render) => &render.layout,
        PipelineDescriptor::ComputePipelineDescriptor(compute) => &compute.layout,
    }
}

/// What a pipeline's layouts hold, in the stage that has most of each.
fn counted(pipeline: &CachedPipeline) -> DeviceNeeds {
    let most = |counts: fn(&BindingType) -> bool| {
        let stages = [
            ShaderStages::VERTEX,
            ShaderStages::FRAGMENT,
            ShaderStages::COMPUTE,
        ];
        let in_stage = |stage| {
            let entries = layouts(pipeline).iter().flat_map(|layout| &layout.entries);
            let counted = entries.filter(|e| e.visibility.contains(stage) && counts(&e.ty));
            counted.count() as u32
        };
        stages.into_iter().map(in_stage).max().unwrap_or(0)
    };
    DeviceNeeds {
        storage_buffers: most(|ty| {
            matches!(
                ty,
                BindingType::Buffer {
                    ty: BufferBindingType::Storage { .. },
                    ..
                }
            )
        }),
        storage_textures: most(|ty| matches!(ty, BindingType::StorageTexture { .. })),
        texture_3d: 0,
    }
}

/// Every pipeline of the crate, with every technique and view, within what WebGPU guarantees; and devices are asked
/// for what the layouts hold, not less and not more.
#[test]
fn everything_runs_within_the_limits_of_webgpu() {
    let mut idle = Idle::new(WgpuLimits::defaults());
    for technique in idle.techniques() {
        assert_eq!(idle.support().technique(technique), None);
    }
    idle.make_all_pipelines();
    idle.assert_fine();
    let techniques = idle.app.world().resource::<GiTechniques>();
    let techniques = techniques
        .on()
        .map(|entry| (format!("gi/{}/", entry.technique), entry.device));
    let mut needs: Vec<_> = techniques
        .chain([("gi/".to_owned(), COMMON)])
        .map(|(prefix, stated)| (prefix, stated, DeviceNeeds::default()))
        .collect();
    for (label, pipeline) in idle.own_pipelines() {
        let has = counted(pipeline);
        let (.., most) = needs
            .iter_mut()
            .find(|(prefix, ..)| label.starts_with(prefix.as_str()))
            .expect("all start with the last one");
        most.storage_buffers = most.storage_buffers.max(has.storage_buffers);
        most.storage_textures = most.storage_textures.max(has.storage_textures);
        for entry in layouts(pipeline).iter().flat_map(|layout| &layout.entries) {
            if let BindingType::StorageTexture { format, .. } = entry.ty {
                assert!(WRITTEN.contains(&format), "{label} writes {format:?}");
            }
        }
    }
    for (prefix, stated, most) in needs {
        let texture_3d = stated.texture_3d;
        assert_eq!(stated, DeviceNeeds { texture_3d, ..most }, "{prefix}");
    }

    // And the device would have complained.
    let nine = vec![storage_buffer_sized(false, None).build(0, ShaderStages::COMPUTE); 9];
    let nine = (0..)
        .zip(nine)
        .map(|(binding, entry)| BindGroupLayoutEntry { binding, ..entry });
    let device = idle.app.world().resource::<RenderDevice>();
    device.create_bind_group_layout("nine", &nine.collect::<Vec<_>>());
    assert!(!idle.errors.lock().unwrap().is_empty());
}

/// Sets numbers to the greatest that they may be.
fn enlarge(value: &mut dyn Reflect, ranges: &[FieldRange]) {
    for range in ranges {
        let Ok(field) = value.reflect_path_mut(range.field) else {
            continue;
        };
        if let Some(number) = field.try_downcast_mut::<u32>() {
            *number = range.max as u32;
        } else if let Some(number) = field.try_downcast_mut::<f32>() {
            *number = range.max as f32;
        }
    }
}

/// The largest settings make no buffer and no texture that WebGPU does not allow.
#[test]
fn the_largest_settings_fit_the_limits_of_webgpu() {
    let mut idle = Idle::new(WgpuLimits::defaults());
    let world = idle.app.world_mut();
    let registry = world.resource::<GiSettingsRegistry>().clone();
    for entry in registry.iter() {
        // The volume stays around the scene.
        if entry.kind != ParametersKind::Scene || entry.name == "ProbeSet" {
            let ranges = entry.ranges.clone();
            entry.change_always(world, move |value| enlarge(value, &ranges));
        }
    }
    assert!(world.resource::<GiCaptureSettings>().vpls > 10_000);
    idle.spawn_scene(GiVolume::new(Vec3::splat(4.0)).with_resolution(512));
    for technique in idle.techniques() {
        idle.use_technique(technique);
        idle.settle();
        idle.assert_fine();
    }
    let counts = idle.app.world().resource::<GiStatistics>().counts();
    // 256 rays of 8 bytes in 128 MiB.
    let count = counts["scene/probes"];
    assert!((32_768..=65_536).contains(&count), "{count} probes");
}

/// A device lacks something for one technique only: no pipeline of that is made, and cameras with it show none.
#[test]
fn a_technique_that_the_device_cannot_run_is_off() {
    let mut idle = Idle::new(WgpuLimits {
        max_texture_dimension_3d: 1024,
        ..WgpuLimits::defaults()
    });
    assert!(idle.support().is_supported());
    let (possible, too_large): (Vec<_>, Vec<_>) = idle
        .techniques()
        .into_iter()
        .partition(|technique| idle.support().technique(*technique).is_none());
    assert!(possible.len() > 1 && !too_large.is_empty());
    for technique in &too_large {
        let why = idle.support().technique(*technique).unwrap();
        assert!(why.contains("3D texture (it has 1024)"), "{why}");
    }
    idle.spawn_scene(GiVolume::new(Vec3::splat(4.0)).with_resolution(32));
    for technique in idle.techniques() {
        idle.use_technique(technique);
        idle.settle();
        idle.assert_fine();
        let render_world = idle.app.sub_app_mut(RenderApp).world_mut();
        let mut cameras = render_world.query::<&ExtractedGiCamera>();
        let in_force = cameras.single(render_world).unwrap().technique;
        let wanted = match possible.contains(&technique) {
            true => technique,
            false => GiTechnique::OFF,
        };
        assert_eq!(in_force, wanted);
        let own = format!("gi/{technique}/");
        let has = idle
            .own_pipelines()
            .any(|(label, _)| label.starts_with(&own));
        assert_eq!(has, !wanted.is_off(), "{technique}");
    }
}

/// A camera that is reset starts its history afresh, once, and no other camera does.
#[test]
fn a_reset_is_of_one_camera_and_of_one_frame() {
    let mut idle = Idle::new(WgpuLimits::defaults());
    idle.spawn_scene(GiVolume::new(Vec3::splat(4.0)).with_resolution(32));
    let world = idle.app.world_mut();
    let mut cameras = world.query_filtered::<(Entity, &RenderTarget), With<GiCamera>>();
    let (first, target) = cameras.single(world).unwrap();
    let over = Camera {
        order: 1,
        ..default()
    };
    let target = target.clone();
    let second = world.spawn((Camera3d::default(), over, GiCamera::default(), target));
    let second = second.id();
    idle.settle();
    let frames = |idle: &mut Idle| {
        let world = idle.app.sub_app_mut(RenderApp).world_mut();
        let mut views = world.query::<(&MainEntity, &ViewIndirect)>();
        let views: HashMap<_, _> = views
            .iter(world)
            .map(|(main, view)| (main.id(), view.frame))
            .collect();
        [views[&first], views[&second]]
    };
    let before = frames(&mut idle);
    assert!(before.into_iter().all(|frame| frame > 2), "{before:?}");
    let reset = |idle: &Idle| idle.app.world().get::<GiCamera>(first).unwrap().reset;
    let world = idle.app.world_mut();
    world.get_mut::<GiCamera>(first).unwrap().reset = true;
    idle.steps(1);
    assert!(!reset(&idle));
    assert_eq!(frames(&mut idle), [0, before[1] + 1]);
    idle.steps(1);
    assert_eq!(frames(&mut idle), [1, before[1] + 2]);

    // Both worlds agree on which of them is the primary one.
    let primary = |idle: &Idle| {
        let world = idle.app.sub_app(RenderApp).world();
        let camera = world.resource::<PrimaryGiCamera>().0.unwrap();
        let main = world.get::<MainEntity>(camera).unwrap().id();
        assert_eq!(idle.app.world().resource::<PrimaryGiCamera>().0, Some(main));
        main
    };
    assert_eq!(primary(&idle), first);
    idle.app
        .world_mut()
        .get_mut::<Camera>(first)
        .unwrap()
        .is_active = false;
    idle.steps(1);
    assert_eq!(primary(&idle), second);
}

/// What an app may leave out of the group is not missed by the rest.
#[test]
fn plugins_can_be_left_out() {
    let all = || GiPlugins.build();
    let without: [(&str, PluginGroupBuilder); 3] = [
        (
            "debug views, other cameras",
            all()
                .disable::<DebugPlugin>()
                .disable::<OverlayPlugin>()
                .disable::<ForwardViewsPlugin>(),
        ),
        (
            "radiance hints",
            all().disable::<TechniquePlugin<RadianceHints>>(),
        ),
        (
            "cones, and the default of materials",
            all()
                .disable::<TechniquePlugin<VoxelConeTracing>>()
                .set(GiCameraPlugin {
                    deferred_by_default: false,
                }),
        ),
    ];
    for (what, plugins) in without {
        let mut idle = Idle::with(WgpuLimits::defaults(), plugins);
        idle.spawn_scene(GiVolume::new(Vec3::splat(4.0)).with_resolution(32));
        for technique in idle.techniques() {
            idle.use_technique(technique);
            idle.settle();
            idle.assert_fine();
            let own = format!("gi/{technique}/gather");
            let gathers = idle.own_pipelines().any(|(label, _)| label == own);
            assert_eq!(gathers, !technique.is_off(), "without {what}: {technique}");
        }
    }
}

/// A device that lacks something for all of them makes no pipeline of the crate, whatever is asked for.
#[test]
fn nothing_is_made_where_nothing_can_run() {
    let mut idle = Idle::new(WgpuLimits {
        max_storage_buffers_per_shader_stage: 4,
        ..WgpuLimits::defaults()
    });
    let why = idle.support().reason().expect("those are too few");
    assert!(
        why.contains("storage buffers per shader stage (it has 4)"),
        "{why}"
    );
    idle.spawn_scene(GiVolume::default());
    for view in [
        GiView::Full,
        GiView::VoxelAlbedo,
        GiView::ShadowMaps,
        GiView::RsmFlux,
    ] {
        *idle.app.world_mut().resource_mut::<GiDebugSettings>() = GiDebugSettings {
            view,
            show_ambient_cubes: true,
            show_vpls: true,
            show_picked: true,
            ..default()
        };
        idle.steps(3);
    }
    let made: Vec<_> = idle.own_pipelines().map(|(label, _)| label).collect();
    assert!(made.is_empty(), "{made:?}");
}

/// Systems of the crate that touch the same data have an order, unless none of them writes it.
///
/// Names of systems and data are known with Bevy's feature `debug` alone; without it, their sets say where to look.
#[test]
fn systems_that_touch_the_same_data_are_ordered() {
    let mut idle = Idle::new(WgpuLimits::defaults());
    idle.spawn_scene(GiVolume::new(Vec3::splat(4.0)).with_resolution(32));
    idle.steps(3);
    let world = idle.app.sub_app(RenderApp).world();
    let (mut systems, mut unordered) = (0, Vec::new());
    for (label, schedule) in world.resource::<Schedules>().iter() {
        let prepare = GiPrepare::ALL.map(|set| (format!("{set:?}"), set.intern()));
        let record = GiSystems::ALL.map(|set| (format!("{set:?}"), set.intern()));
        // The set of each system of the crate.
        let mut sets = HashMap::new();
        for (name, set) in prepare.into_iter().chain(record) {
            for system in schedule.graph().systems_in_set(set).into_iter().flatten() {
                sets.insert(*system, name.clone());
            }
        }
        systems += sets.len();
        for (a, b, data) in schedule.graph().conflicting_systems().iter() {
            if let (Some(a), Some(b)) = (sets.get(a), sets.get(b)) {
                let components = world.components();
                let data = data.iter().map(|id| components.get_name(*id));
                let data: Vec<_> = data.flatten().collect();
                unordered.push(format!("{label:?}: {a} and {b}, {data:?}"));
            }
        }
    }
    assert!(systems > 40, "only {systems} systems were found");
    assert!(unordered.is_empty(), "{}", unordered.join("\n"));
}
