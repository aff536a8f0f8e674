//! A technique that stores light for each camera: the distance of what is in the middle of its picture, as nits.

use bevy::{
    asset::uuid_handle, prelude::*, render::render_resource::*, render::settings::WgpuSettings,
};
use bevy_gi::{
    GiStatistics, GiView,
    prelude::*,
    technique::{ComputePass, *},
};

use crate::{
    common::{headless::Picture, scenes::stage::diffuse},
    custom_technique::AmbientCubesSettings,
    support::{app_on, camera, choose, luminance, material, settle, show, slab},
};

struct Middle;

/// Distance of each surface over that of the middle one.
const SHARE: GiView = GiView::new("middle-share");

const SHADER: Handle<Shader> = uuid_handle!("a3f0b1de-93f2-4a17-8f0b-51a9c5a0a5e7");

const WGSL: &str = "
#ifdef UPDATE
#import bevy_gi::surface::{load_surface, view}
@group(2) @binding(0) var<storage, read_write> middle: array<f32>;

@compute @workgroup_size(1)
fn measure() {
    let surface = load_surface(vec2<u32>(view.viewport.zw * 0.5));
    middle[0] = distance(surface.position, view.world_position);
}
#else
#import bevy_gi::apply::gather::{begin, store}
#import bevy_gi::surface::view
@group(2) @binding(0) var<storage> middle: array<f32>;

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = begin(id.xy);
    if !pixel.exists { return; }
    store(id.xy, pixel.weight, vec3(middle[0]), vec3(0.0));
}

@compute @workgroup_size(8, 8)
fn share(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = begin(id.xy);
    if !pixel.exists { return; }
    let there = distance(pixel.surface.position, view.world_position);
    store(id.xy, pixel.weight, vec3(there / middle[0]), vec3(0.0));
}
#endif
";

fn written() -> GroupLayout {
    GroupLayout::new("middle", ShaderStages::COMPUTE).with("middle", storage_write::<Vec<f32>>())
}

#[derive(Resource)]
struct Measure(ComputePass);

impl Pipelines for Measure {
    fn new(_: &AssetServer, cache: &PipelineCache) -> Self {
        let layouts = [&surface_layout(), &scene_layout(), &written()];
        let defs = vec!["UPDATE".into()];
        let name = "gi/middle/measure";
        Self(ComputePass::new(
            cache,
            name,
            block::ONE,
            &layouts,
            SHADER,
            "measure",
            defs,
        ))
    }

    fn passes(&self) -> Vec<ComputePass> {
        vec![self.0]
    }
}

#[derive(Component)]
struct Distance {
    distance: Tracked<Buffer>,
    write: BindGroup,
    read: BindGroup,
}

impl ViewCache<Middle> for Distance {
    fn new(frame: &ViewFrame<Middle>) -> Option<Self> {
        let (statistics, usage) = (frame.statistics, BufferUsages::COPY_SRC);
        let distance = statistics.storage_buffer(frame.device, "middle/distance", 4, usage);
        let group = |layout: GroupLayout| {
            let group = layout.bind(frame.device, frame.cache);
            group.with("middle", distance.as_entire_binding()).build()
        };
        let (write, read) = (group(written()), group(Middle::cache_layout()));
        Some(Self {
            distance,
            write,
            read,
        })
    }

    fn update(&mut self, _: &ViewFrame<Middle>) -> Option<Settling> {
        assert_eq!(self.distance.size(), 16);
        Activity::settling(1).settling
    }

    fn record(&self, pipelines: &Measure, inputs: ViewInputs, recorder: &mut Recorder) {
        let Some(scene) = inputs.scenes.first() else {
            return;
        };
        let once = Dispatch::Workgroups(UVec3::ONE);
        let groups = [inputs.surface, scene, &self.write];
        recorder.run_all(&pipelines.0, Some(inputs.offset), [(once, groups)]);
    }

    fn bind_group(&self) -> Option<&BindGroup> {
        Some(&self.read)
    }
}

impl Technique for Middle {
    const NAME: &'static str = "middle";
    const TITLE: &'static str = "Distance of the middle";
    const LOOKUP: Lookup = Lookup::PerView;
    const VIEWS: &'static [TechniqueView] = &[TechniqueView::gathered(
        SHARE,
        "distance over that of the middle",
        false,
        |_| LookupShader::new(SHADER, "share", Vec::new()),
    )];
    type Settings = AmbientCubesSettings;
    type Debug = NoDebug;
    type Pipelines = Measure;
    type Cache = NoCache;
    type ViewCache = Distance;

    fn build(app: &mut App) {
        let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
        let shader = Shader::from_wgsl(WGSL, file!());
        shaders.insert(&SHADER, shader).expect("the handle is free");
    }

    fn cache_layout() -> GroupLayout {
        GroupLayout::new("middle", ShaderStages::COMPUTE).with("middle", storage_read::<Vec<f32>>())
    }

    fn gather(_: &AssetServer) -> LookupShader {
        LookupShader::new(SHADER, "gather", Vec::new())
    }
}

/// Luminance at a part of the picture's width, halfway up.
fn at(picture: &Picture, x: f32) -> f32 {
    let pixel = picture.size.y / 2 * picture.size.x + (x * picture.size.x as f32) as u32;
    luminance(&picture.pixels[pixel as usize])
}

/// Each camera has its own light, made from what it sees in the same frame, and memory for it while it lives; a view
/// of the technique shows numbers of its own.
#[test]
fn a_technique_stores_light_for_each_camera() {
    let mut headless = app_on(WgpuSettings::default(), |app| {
        app.add_plugins(TechniquePlugin::<Middle>::default());
    });
    choose(&mut headless, GiTechnique::of::<Middle>());
    show(&mut headless, GiView::Irradiance);
    let white = material(&mut headless, diffuse([0.5; 3]));
    let (min, max) = (Vec3::new(-20.0, -1.0, -20.0), Vec3::new(20.0, 0.0, 20.0));
    slab(&mut headless, min, max, &white);
    // Too small for the picture: light for a camera ends at no volume.
    headless
        .app
        .world_mut()
        .spawn(GiVolume::new(Vec3::splat(1.0)));
    let size = UVec2::new(65, 33);
    let cameras = [2.0, 5.0].map(|height| {
        let eye = Vec3::new(0.0, height, 0.0);
        let (camera, target) = camera(&mut headless, size, eye, Vec3::ZERO, 60.0);
        // Each pixel has what the technique stores for it.
        let unfiltered = GiCamera::default().unfiltered();
        headless
            .app
            .world_mut()
            .entity_mut(camera)
            .insert(unfiltered);
        (height, (camera, target))
    });
    settle(&mut headless, 2);
    for (height, (_, target)) in &cameras {
        let picture = headless.picture(target);
        for x in [0.1, 0.5, 0.9] {
            let nits = at(&picture, x);
            assert!((nits / height - 1.0).abs() < 2e-3, "{nits} from {height} m");
        }
    }

    // What it sees in a frame lights the same frame.
    let (_, (first, target)) = &cameras[0];
    let mut eye = headless
        .app
        .world_mut()
        .get_mut::<Transform>(*first)
        .expect("it lives");
    eye.translation.y = 3.0;
    headless.steps(1);
    let nits = at(&headless.picture(target), 0.5);
    assert!((nits / 3.0 - 1.0).abs() < 2e-3, "{nits} from 3 m");

    // At the left border, half a picture's width (65/33 x tan 30°) from the middle.
    show(&mut headless, SHARE);
    headless.steps(2);
    let picture = headless.picture(target);
    let slope = 64.0 / 33.0 * f32::to_radians(30.0).tan();
    let share = f32::hypot(1.0, slope);
    let (middle, border) = (at(&picture, 0.5), at(&picture, 0.0));
    assert!((middle - 1.0).abs() < 5e-3, "{middle} in the middle");
    assert!(
        (border / share - 1.0).abs() < 0.02,
        "{border} at the border, not {share}"
    );

    let bytes = |world: &World| {
        world
            .resource::<GiStatistics>()
            .memory()
            .get("middle/distance")
            .copied()
    };
    assert_eq!(bytes(headless.app.world()), Some(32));
    headless.app.world_mut().despawn(cameras[1].1.0);
    headless.steps(3);
    assert_eq!(bytes(headless.app.world()), Some(16));
    choose(&mut headless, GiTechnique::OFF);
    headless.steps(3);
    assert_eq!(bytes(headless.app.world()), None);
}
