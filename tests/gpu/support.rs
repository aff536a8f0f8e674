//! A scene in a few lines, and figures of its picture.

use std::sync::{Arc, Mutex};

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        render_resource::{
            Buffer, BufferDescriptor, BufferUsages, CommandEncoderDescriptor, MapMode, PollType,
            TextureFormat,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};
use bevy_gi::{
    prelude::*,
    scene::{
        volume::Grid,
        voxels::{SceneVoxels, WORDS},
    },
};

pub use crate::common::figures::{luminance, mean};
use crate::common::{
    headless::{Headless, Picture, image_target},
    scenes::{cornell, stage::Stage},
};

/// With this exposure, a nit is 1 in the HDR target.
pub const UNIT_EV100: f32 = -0.263_034;

/// A headless app with the plugin, no ambient light, and emission in nits.
pub fn app() -> Headless {
    Headless::new(|app| {
        app.add_plugins(GiPlugins)
            .insert_resource(ClearColor(Color::BLACK))
            .insert_resource(GlobalAmbientLight::NONE)
            .insert_resource(GiSettings {
                replace_ambient: true,
                sky: GiSky::Black,
                emissive_units: bevy_gi::EmissiveUnits::Nits,
                ..default()
            });
    })
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

    /// The voxel around a point of the world.
    pub fn voxel(&self, p: Vec3) -> IVec3 {
        ((p - self.grid.origin) / self.grid.voxel)
            .floor()
            .as_ivec3()
    }

    /// Linear albedo at a point of the world, if there is a surface.
    pub fn albedo(&self, p: Vec3) -> Option<Vec3> {
        let v = self.voxel(p);
        let byte = |c: u32| (self.record(v)[0] >> (8 * c)) as u8 as f32 / 255.0;
        self.at(v).then(|| Vec3::new(byte(0), byte(1), byte(2)))
    }
}

/// Reads the voxels of the one volume back.
pub fn read_voxels(headless: &mut Headless) -> Voxels {
    type Found = Arc<Mutex<Option<(Grid, Vec<u32>, Vec<u32>)>>>;
    #[derive(Resource, Clone, Default)]
    struct Sink(Found);

    fn read(
        voxels: Query<&SceneVoxels>,
        device: Res<RenderDevice>,
        queue: Res<RenderQueue>,
        sink: Res<Sink>,
    ) {
        let Some(voxels) = voxels.iter().next() else {
            return;
        };
        let copy = |buffer: &Buffer| -> Vec<u32> {
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
        };
        *sink.0.lock().unwrap() =
            Some((voxels.grid, copy(voxels.brick_map()), copy(voxels.pool())));
    }

    let render_app = headless.app.sub_app_mut(RenderApp);
    if !render_app.world().contains_resource::<Sink>() {
        render_app
            .init_resource::<Sink>()
            .add_systems(Render, read.in_set(RenderSystems::Cleanup));
    }
    let sink = render_app.world().resource::<Sink>().clone();
    headless.steps(1);
    let found = sink.0.lock().unwrap().take();
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
