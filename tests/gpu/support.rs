//! A scene in a few lines, and figures of its picture.

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
    render::{
        RenderApp,
        render_resource::{
            BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferDescriptor, BufferUsages, CommandEncoderDescriptor, ComputePassDescriptor,
            ComputePipelineDescriptor, MapMode, PipelineCache, PollType, ShaderStages,
            TextureFormat, binding_types::storage_buffer_sized,
        },
        renderer::{RenderDevice, RenderQueue},
        settings::WgpuSettings,
    },
};
use bevy_gi::{
    prelude::*,
    scene::{
        light_maps::SceneLightMaps,
        volume::Grid,
        voxels::{SceneVoxels, WORDS},
    },
};

pub use crate::common::figures::{luminance, mean};
use crate::{
    common::{
        headless::{Headless, Picture, image_target},
        scenes::{
            cornell,
            stage::{Stage, diffuse},
        },
    },
    shared::{Pool, SharedApp},
};

/// With this exposure, a nit is 1 in the HDR target.
pub const UNIT_EV100: f32 = -0.263_034;

/// Voxel cone tracing, and radiance hints.
pub const CONES: GiTechnique = GiTechnique::new("vct");
pub const HINTS: GiTechnique = GiTechnique::new("hints");

/// Every technique of the plugin that computes light; `custom.rs` holds the list against the plugin's own.
pub const TECHNIQUES: [GiTechnique; 2] = [CONES, HINTS];

/// A headless app with the plugin, no ambient light, and emission in nits; with voxel cone tracing, unless a test
/// chooses another technique. Other tests have used it, and will.
pub fn app() -> SharedApp {
    static APPS: Pool = Pool::new(|| app_on(WgpuSettings::default(), |_| {}));
    app_of(&APPS)
}

/// The same from other apps that [`app_on`] makes.
pub fn app_of(apps: &'static Pool) -> SharedApp {
    let mut headless = apps.take();
    headless.app.insert_resource(settings());
    headless
}

/// Such an app on a device of that making, with what `configure` adds.
pub fn app_on(device: WgpuSettings, configure: impl FnOnce(&mut App)) -> Headless {
    Headless::on(device, |app| {
        app.add_plugins(GiPlugins)
            .insert_resource(ClearColor(Color::BLACK))
            .insert_resource(GlobalAmbientLight::NONE)
            .insert_resource(settings());
        configure(app);
    })
}

fn settings() -> GiSettings {
    GiSettings {
        technique: CONES,
        replace_ambient: true,
        sky: GiSky::Black,
        emissive_units: bevy_gi::EmissiveUnits::Nits,
        ..default()
    }
}

/// Lights everything with a technique.
pub fn choose(headless: &mut Headless, technique: GiTechnique) {
    let world = headless.app.world_mut();
    world.resource_mut::<GiSettings>().technique = technique;
}

/// A camera whose picture is in nits.
pub fn camera(
    headless: &mut Headless,
    size: UVec2,
    eye: Vec3,
    look: Vec3,
    fov: f32,
) -> (Entity, Handle<Image>) {
    let target = headless.target(size, TextureFormat::Rgba32Float);
    let up = if (look - eye).normalize().y.abs() > 0.99 {
        Vec3::Z
    } else {
        Vec3::Y
    };
    let camera = headless
        .app
        .world_mut()
        .spawn((
            Camera3d::default(),
            GiCamera::default(),
            image_target(&target),
            Tonemapping::None,
            DebandDither::Disabled,
            Exposure { ev100: UNIT_EV100 },
            Projection::from(PerspectiveProjection {
                fov: fov.to_radians(),
                near: 0.05,
                ..default()
            }),
            Transform::from_translation(eye).looking_at(look, up),
        ))
        .id();
    (camera, target)
}

/// A box of a material.
pub fn slab(
    headless: &mut Headless,
    min: Vec3,
    max: Vec3,
    material: &Handle<StandardMaterial>,
) -> Entity {
    Stage(headless.app.world_mut()).slab(min, max, material)
}

/// Six slabs around the inside of `min..max`.
pub fn room(
    headless: &mut Headless,
    min: Vec3,
    max: Vec3,
    wall: f32,
    material: &Handle<StandardMaterial>,
) {
    Stage(headless.app.world_mut()).room(min, max, wall, material);
}

/// A room of 4 m with a lamp and a volume in it, whose irradiance is seen from inside; with radiance hints.
pub fn lit_room(albedo: [f32; 3], volume: impl Bundle) -> (SharedApp, Entity, Handle<Image>) {
    let mut headless = app();
    choose(&mut headless, HINTS);
    let walls = material(&mut headless, diffuse(albedo));
    let half = Vec3::splat(2.0);
    room(&mut headless, -half, half, 0.3, &walls);
    let world = headless.app.world_mut();
    world.spawn((
        PointLight {
            intensity: 3000.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(0.0, 1.0, 0.5),
    ));
    let volume = world.spawn(volume).id();
    show(&mut headless, GiView::Irradiance);
    let eye = Vec3::new(0.0, 0.0, 1.8);
    let (_, target) = camera(&mut headless, UVec2::new(48, 32), eye, Vec3::ZERO, 60.0);
    (headless, volume, target)
}

pub fn material(headless: &mut Headless, material: StandardMaterial) -> Handle<StandardMaterial> {
    Stage(headless.app.world_mut()).material(material)
}

/// Waits until everything is loaded, starts history afresh, and renders `frames`.
pub fn settle(headless: &mut Headless, frames: u32) {
    assert!(headless.wait_until(|_| true), "pipelines are compiled");
    assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
    headless.app.world_mut().resource_mut::<GiHistory>().reset();
    headless.steps(frames);
}

/// Shows a view from the next frame on.
pub fn show(headless: &mut Headless, view: GiView) {
    headless
        .app
        .world_mut()
        .resource_mut::<GiDebugSettings>()
        .view = view;
}

/// No NaN, no infinity, nothing negative.
pub fn assert_sane(picture: &Picture, what: &str) {
    for (i, p) in picture.pixels.iter().enumerate() {
        let fine = p[..3].iter().all(|c| c.is_finite() && *c >= 0.0);
        assert!(fine, "{what}: pixel {i} is {p:?}");
    }
}

/// The Cornell box of the examples.
pub fn spawn_cornell(headless: &mut Headless) {
    cornell::spawn(headless.app.world_mut());
}

/// The same in so many voxels and probes, for what does not depend on their number.
pub fn spawn_coarse_cornell(headless: &mut Headless, voxels: u32, probes: u32) {
    spawn_cornell(headless);
    let world = headless.app.world_mut();
    let mut volumes = world.query::<(Entity, &mut GiVolume)>();
    let (volume, mut settings) = volumes.single_mut(world).expect("the box has a volume");
    settings.resolution = voxels;
    let probes = ProbeSet::default().with_resolution(probes);
    world.entity_mut(volume).insert(probes);
}

/// The voxels of a volume.
pub struct Voxels {
    pub grid: Grid,
    /// The first two words of each voxel's record, 0 where its brick is empty; x fastest.
    pub records: Vec<[u32; 2]>,
}

impl Voxels {
    fn record(&self, v: IVec3) -> [u32; 2] {
        let d = self.grid.dims;
        self.records[((v.z as u32 * d.y + v.y as u32) * d.x + v.x as u32) as usize]
    }

    /// Whether a voxel holds a surface.
    pub fn at(&self, v: IVec3) -> bool {
        (self.record(v)[1] >> 24) & 1 != 0
    }

    /// Which way the surface at a point of the world faces, if there is one.
    pub fn normal(&self, p: Vec3) -> Option<Vec3> {
        let v = self.voxel(p);
        let packed = self.record(v)[1];
        let part = |shift: u32| ((packed >> shift) & 0xfff) as f32 / 4095.0 * 2.0 - 1.0;
        let (x, y) = (part(0), part(12));
        let n = Vec3::new(x, y, 1.0 - x.abs() - y.abs());
        let fold = (-n.z).max(0.0);
        let folded = n - Vec3::new(fold.copysign(x), fold.copysign(y), 0.0);
        self.at(v).then(|| folded.normalize())
    }

    /// The voxel around a point of the world.
    pub fn voxel(&self, p: Vec3) -> IVec3 {
        ((p - self.grid.origin) / self.grid.voxel)
            .floor()
            .as_ivec3()
    }

    /// Linear albedo at a point of the world, if there is a surface.
    pub fn albedo(&self, p: Vec3) -> Option<Vec3> {
        let v = self.voxel(p);
        let word = self.record(v)[0];
        let part = |shift: u32, steps: u32| ((word >> shift) & steps) as f32 / steps as f32;
        let albedo = Vec3::new(part(0, 2047), part(11, 2047), part(22, 1023));
        self.at(v).then_some(albedo)
    }
}

/// The words of a buffer of the GPU.
pub fn words(buffer: &Buffer, device: &RenderDevice, queue: &RenderQueue) -> Vec<u32> {
    let staging = device.create_buffer(&BufferDescriptor {
        label: None,
        size: buffer.size(),
        usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    queue.submit([encoder.finish()]);
    staging.slice(..).map_async(MapMode::Read, |_| {});
    let _ = device.wgpu_device().poll(PollType::wait_indefinitely());
    bytemuck::pod_collect_to_vec(&staging.slice(..).get_mapped_range())
}

/// What `read` finds in the render world after the next frame.
pub fn in_render_world<T>(
    headless: &mut Headless,
    read: impl FnOnce(&World) -> Option<T>,
) -> Option<T> {
    headless.steps(1);
    let world = headless.app.sub_app(RenderApp).world();
    read(world)
}

/// What functions of the crate's shaders say: `code` imports them and has a function
/// `value(i: u32) -> f32`, which is called for each `i` below `count`.
pub fn evaluate(headless: &mut Headless, code: &str, count: u32) -> Vec<f32> {
    let source = format!(
        "{code}
        @group(0) @binding(0) var<storage, read_write> out_: array<f32>;
        @compute @workgroup_size(1)
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {{ out_[id.x] = value(id.x); }}"
    );
    let world = headless.app.world_mut();
    let shader = Shader::from_wgsl(source, "evaluate.wgsl");
    let shader = world.resource_mut::<Assets<Shader>>().add(shader);
    let layout = BindGroupLayoutDescriptor::new(
        "evaluate",
        &BindGroupLayoutEntries::single(ShaderStages::COMPUTE, storage_buffer_sized(false, None)),
    );
    let pipeline = in_render_world(headless, |world| {
        let cache = world.resource::<PipelineCache>();
        Some(cache.queue_compute_pipeline(ComputePipelineDescriptor {
            layout: vec![layout.clone()],
            shader: shader.clone(),
            entry_point: Some("main".into()),
            ..default()
        }))
    });
    let pipeline = pipeline.expect("a pipeline is queued");
    for _ in 0..500 {
        let values = in_render_world(headless, |world| {
            let (device, queue) = (world.resource::<RenderDevice>(), world.resource());
            let cache = world.resource::<PipelineCache>();
            let compiled = cache.get_compute_pipeline(pipeline)?;
            let buffer = device.create_buffer(&BufferDescriptor {
                label: None,
                size: 4 * u64::from(count),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let group = device.create_bind_group(
                "evaluate",
                &cache.get_bind_group_layout(&layout),
                &BindGroupEntries::single(buffer.as_entire_binding()),
            );
            let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor::default());
            let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor::default());
            pass.set_pipeline(compiled);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(count, 1, 1);
            drop(pass);
            let queue: &RenderQueue = queue;
            queue.submit([encoder.finish()]);
            Some(words(&buffer, device, queue))
        });
        if let Some(words) = values {
            return words.into_iter().map(f32::from_bits).collect();
        }
    }
    panic!("{:?}", headless.pipeline_errors());
}

/// A virtual point light.
#[derive(Clone, Copy, Debug)]
pub struct Vpl {
    pub position: Vec3,
    /// Square metres.
    pub area: f32,
    /// Lumens.
    pub flux: Vec3,
}

/// Reads all virtual point lights back.
pub fn read_vpls(headless: &mut Headless) -> Vec<Vpl> {
    let found = in_render_world(headless, |world| {
        let (device, queue) = (world.resource(), world.resource());
        Some(words(
            world.resource::<SceneLightMaps>().vpls()?,
            device,
            queue,
        ))
    });
    let words = found.expect("there are reflective shadow maps");
    let vpls = words.chunks(8).map(|words| {
        let f = |i: usize| f32::from_bits(words[i]);
        Vpl {
            position: Vec3::new(f(0), f(1), f(2)),
            area: std::f32::consts::PI * f(3),
            flux: Vec3::new(f(4), f(5), f(6)),
        }
    });
    vpls.collect()
}

/// Reads the voxels of the one volume back.
pub fn read_voxels(headless: &mut Headless) -> Voxels {
    let found = in_render_world(headless, |world| {
        let (device, queue) = (world.resource(), world.resource());
        let mut volumes = world.try_query::<&SceneVoxels>()?;
        let voxels = volumes.iter(world).next()?;
        let read = |buffer: &Buffer| words(buffer, device, queue);
        Some((voxels.grid, read(voxels.brick_map()), read(voxels.pool())))
    });
    let (grid, map, pool) = found.expect("a volume is voxelized");
    let d = grid.dims;
    let n = d / 4;
    let records = (0..d.element_product())
        .map(|i| {
            let v = UVec3::new(i % d.x, (i / d.x) % d.y, i / (d.x * d.y));
            let (b, l) = (v / 4, v % 4);
            match map[((b.z * n.y + b.y) * n.x + b.x) as usize] {
                0 => [0; 2],
                slot => {
                    let local = (l.z * 4 + l.y) * 4 + l.x;
                    let at = (((slot - 1) * 64 + local) * WORDS) as usize;
                    [pool[at], pool[at + 1]]
                }
            }
        })
        .collect();
    Voxels { grid, records }
}
