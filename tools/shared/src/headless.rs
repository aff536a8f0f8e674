//! An app without a window, stepped by hand: nothing in it depends on the wall clock.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use bevy::{
    app::{PluginsState, SubApps},
    asset::RenderAssetUsages,
    camera::RenderTarget,
    diagnostic::DiagnosticsStore,
    prelude::*,
    render::{
        Render, RenderApp, RenderPlugin, RenderSystems,
        diagnostic::RenderDiagnosticsPlugin,
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::{PipelineCache, PollType, TextureFormat, TextureUsages},
        renderer::RenderDevice,
        settings::WgpuSettings,
    },
    time::TimeUpdateStrategy,
    window::ExitCondition,
    winit::WinitPlugin,
};

use bevy_gi::last_frame;

use crate::{overlay::OverlayPlugin, scenes::asset_folder};

/// Pipelines that are not compiled yet, told by the render world.
#[derive(Resource, Clone, Default)]
struct PipelinesWaiting(Arc<AtomicUsize>);

/// Errors of pipelines, told by the render world: a shader that fails only logs.
#[derive(Resource, Clone, Default)]
pub struct PipelineErrors(pub Arc<Mutex<Vec<String>>>);

/// A headless app.
pub struct Headless {
    pub app: App,
    /// Wall-clock time of each frame of the second half of the last [`steps`](Self::steps),
    /// milliseconds.
    pub frame_ms: Vec<f64>,
    /// What Bevy's diagnostics measured in each frame of the last [`steps`](Self::steps), by path,
    /// milliseconds; 0 where a pass did not run. The first frame has the last of what ran before.
    pub passes_ms: BTreeMap<String, Vec<f64>>,
    /// When each path was last measured.
    measured: BTreeMap<String, Instant>,
}

/// Linear values of an image, row by row, RGBA.
#[derive(Clone)]
pub struct Picture {
    pub size: UVec2,
    pub pixels: Vec<[f32; 4]>,
}

impl Picture {
    /// The same times a factor.
    pub fn scaled(mut self, factor: f32) -> Self {
        for [r, g, b, _] in &mut self.pixels {
            (*r, *g, *b) = (*r * factor, *g * factor, *b * factor);
        }
        self
    }

    /// Colours of this one and of another one of the same size, each pair made one.
    pub fn combined(mut self, other: &Self, combine: impl Fn(f32, f32) -> f32) -> Self {
        for (a, b) in self.pixels.iter_mut().zip(&other.pixels) {
            for (a, b) in a[..3].iter_mut().zip(b) {
                *a = combine(*a, *b);
            }
        }
        self
    }

    /// The same, encoded as sRGB.
    pub fn encoded(mut self) -> Self {
        for pixel in &mut self.pixels {
            let [r, g, b, a] = *pixel;
            *pixel = Srgba::from(LinearRgba::new(r, g, b, a)).to_f32_array();
        }
        self
    }
}

impl Headless {
    /// An app with all of Bevy but a window, and `configure` on top.
    pub fn new(configure: impl FnOnce(&mut App)) -> Self {
        Self::on(WgpuSettings::default(), configure)
    }

    /// The same on a device of that making.
    pub fn on(device: WgpuSettings, configure: impl FnOnce(&mut App)) -> Self {
        let mut app = App::new();
        // A process has one log, even if a test makes many apps.
        static LOG: std::sync::Once = std::sync::Once::new();
        let mut logged = true;
        LOG.call_once(|| logged = false);
        let mut plugins = DefaultPlugins
            .set(AssetPlugin {
                file_path: asset_folder(),
                unapproved_path_mode: bevy::asset::UnapprovedPathMode::Allow,
                ..default()
            })
            .set(RenderPlugin {
                render_creation: device.into(),
                synchronous_pipeline_compilation: true,
                ..default()
            })
            .set(WindowPlugin {
                primary_window: None,
                exit_condition: ExitCondition::DontExit,
                ..default()
            })
            .build()
            .set(bevy::log::LogPlugin {
                filter: "warn,bevy_gi=info,calloop=off".into(),
                ..default()
            })
            .disable::<WinitPlugin>()
            .disable::<bevy::render::pipelined_rendering::PipelinedRenderingPlugin>();
        if logged {
            plugins = plugins.disable::<bevy::log::LogPlugin>();
        }
        app.add_plugins(plugins)
            .add_plugins((RenderDiagnosticsPlugin, OverlayPlugin))
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(
                1.0 / 60.0,
            )));
        let waiting = PipelinesWaiting::default();
        let errors = PipelineErrors::default();
        app.insert_resource(waiting.clone())
            .insert_resource(errors.clone());
        configure(&mut app);
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app
                .insert_resource(waiting)
                .insert_resource(errors)
                .add_systems(Render, publish_pipelines.in_set(RenderSystems::Cleanup));
        }
        Self::of(app)
    }

    /// An app that goes on with the worlds of another one, also in another thread.
    pub fn with_worlds(worlds: SubApps) -> Self {
        let mut app = App::empty();
        *app.sub_apps_mut() = worlds;
        Self::of(app)
    }

    fn of(app: App) -> Self {
        Self {
            app,
            frame_ms: Vec::new(),
            passes_ms: BTreeMap::new(),
            measured: BTreeMap::new(),
        }
    }

    /// Renders a frame, and waits for the GPU.
    pub fn step(&mut self) {
        self.app.update();
        if let Some(device) = self.app.world().get_resource::<RenderDevice>() {
            let _ = device.wgpu_device().poll(PollType::wait_indefinitely());
        }
    }

    /// Renders `frames` frames.
    pub fn steps(&mut self, frames: u32) {
        self.steps_with(frames, |_, _| {});
    }

    /// Renders `frames` frames; `before` may change the world before each.
    pub fn steps_with(&mut self, frames: u32, mut before: impl FnMut(&mut World, u32)) {
        self.frame_ms.clear();
        self.passes_ms.clear();
        for frame in 0..frames {
            before(self.app.world_mut(), frame);
            let start = Instant::now();
            self.step();
            let elapsed = start.elapsed().as_secs_f64() * 1000.0;
            if frame >= frames / 2 {
                self.frame_ms.push(elapsed);
            }
            for (path, ms) in self.new_measurements() {
                let all = self.passes_ms.entry(path).or_default();
                all.resize(frame as usize, 0.0);
                all.push(ms);
            }
        }
        for all in self.passes_ms.values_mut() {
            all.resize(frames as usize, 0.0);
        }
    }

    /// What was measured since this was last called.
    fn new_measurements(&mut self) -> Vec<(String, f64)> {
        let diagnostics = self.app.world().resource::<DiagnosticsStore>();
        let mut new = Vec::new();
        for diagnostic in diagnostics.iter() {
            let Some(measurement) = last_frame(diagnostic) else {
                continue;
            };
            let path = diagnostic.path().as_str();
            if self.measured.get(path) != Some(&measurement.time) {
                self.measured.insert(path.into(), measurement.time);
                new.push((path.into(), measurement.value));
            }
        }
        new
    }

    /// Renders until `loaded` says so and no pipeline has been missing for a while. False if that
    /// does not come about within two minutes.
    pub fn wait_until(&mut self, mut loaded: impl FnMut(&mut World) -> bool) -> bool {
        let (mut calm, mut enough) = (0, 3);
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(120) {
            self.step();
            let waiting = self.app.world().resource::<PipelinesWaiting>();
            let busy = waiting.0.load(Ordering::Relaxed) > 0;
            if busy || !loaded(self.app.world_mut()) {
                // What was missing may ask for more once it is there.
                (calm, enough) = (0, 6);
                // Assets load in other threads.
                std::thread::sleep(Duration::from_millis(2));
            } else {
                calm += 1;
            }
            if calm >= enough {
                return true;
            }
        }
        false
    }

    /// A camera target that can be read back.
    pub fn target(&mut self, size: UVec2, format: TextureFormat) -> Handle<Image> {
        let mut images = self.app.world_mut().resource_mut::<Assets<Image>>();
        images.add(readable_target(size, format))
    }

    /// Bytes of an image or a buffer on the GPU, rendering frames until they are there.
    pub fn read_back(&mut self, readback: Readback) -> Vec<u8> {
        let data = Arc::new(Mutex::new(None));
        let sink = data.clone();
        let entity = self
            .app
            .world_mut()
            .spawn(readback)
            .observe(move |complete: On<ReadbackComplete>| {
                let mut sink = sink.lock().unwrap();
                if sink.is_none() {
                    *sink = Some(complete.data.clone());
                }
            })
            .id();
        let mut bytes = None;
        for _ in 0..32 {
            self.step();
            bytes = data.lock().unwrap().take();
            if bytes.is_some() {
                break;
            }
        }
        self.app.world_mut().despawn(entity);
        bytes.expect("the GPU answers within 32 frames")
    }

    /// What a target of format `Rgba32Float` or `Rgba8UnormSrgb` shows; the latter as 0..=1, encoded.
    pub fn picture(&mut self, target: &Handle<Image>) -> Picture {
        let layout = self.layout(target);
        decode(&self.read_back(Readback::texture(target.clone())), layout)
    }

    /// Every one of the next `frames` pictures of a target. `before` may change the world before each
    /// frame; `picture` gets its number and what it shows.
    pub fn record(
        &mut self,
        target: &Handle<Image>,
        frames: u32,
        mut before: impl FnMut(&mut World, u32),
        mut picture: impl FnMut(u32, Picture),
    ) {
        let layout = self.layout(target);
        let (sender, receiver) = std::sync::mpsc::channel();
        let sender = Mutex::new(sender);
        let world = self.app.world_mut();
        let entity = world
            .spawn(Readback::texture(target.clone()))
            .observe(move |complete: On<ReadbackComplete>| {
                // Nobody listens any more to what comes after the last frame.
                let _ = sender.lock().unwrap().send(complete.data.clone());
            })
            .id();
        let mut taken = 0;
        // Pictures arrive in their order, some frames late.
        for frame in 0..frames + 32 {
            if frame < frames {
                before(self.app.world_mut(), frame);
            }
            self.step();
            for bytes in receiver.try_iter() {
                if taken < frames {
                    picture(taken, decode(&bytes, layout));
                    taken += 1;
                }
            }
            if taken == frames {
                break;
            }
        }
        self.app.world_mut().despawn(entity);
        assert_eq!(taken, frames, "the GPU answers within 32 frames");
    }

    fn layout(&self, target: &Handle<Image>) -> (UVec2, TextureFormat) {
        let images = self.app.world().resource::<Assets<Image>>();
        let image = images.get(target).expect("the target exists");
        (image.size(), image.texture_descriptor.format)
    }

    /// Errors of shaders and pipelines so far.
    pub fn pipeline_errors(&self) -> Vec<String> {
        let errors = self.app.world().resource::<PipelineErrors>();
        errors.0.lock().unwrap().clone()
    }

    /// Bevy's diagnostics.
    pub fn diagnostics(&self) -> &DiagnosticsStore {
        self.app.world().resource::<DiagnosticsStore>()
    }
}

/// A picture from the bytes of a texture of format `Rgba32Float`, `Rgba16Float` or `Rgba8UnormSrgb`; the
/// last as 0..=1, encoded.
pub fn decode(bytes: &[u8], (size, format): (UVec2, TextureFormat)) -> Picture {
    let channel = match format {
        TextureFormat::Rgba32Float => 4,
        TextureFormat::Rgba16Float => 2,
        _ => 1,
    };
    let value = |at: &[u8]| match *at {
        [a, b, c, d] => f32::from_le_bytes([a, b, c, d]),
        [a, b] => half::f16::from_le_bytes([a, b]).to_f32(),
        _ => f32::from(at[0]) / 255.0,
    };
    // Rows may be padded to the alignment of copies.
    let row = bytes.len() / size.y as usize;
    let texel = 4 * channel;
    let mut pixels = Vec::with_capacity(size.element_product() as usize);
    for y in 0..size.y as usize {
        for x in 0..size.x as usize {
            let at = &bytes[y * row + x * texel..][..texel];
            pixels.push(std::array::from_fn(|c| {
                value(&at[c * channel..][..channel])
            }));
        }
    }
    Picture { size, pixels }
}

/// What a camera draws into, and what can be read back.
pub fn readable_target(size: UVec2, format: TextureFormat) -> Image {
    let mut image = Image::new_target_texture(size.x, size.y, format, None);
    image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    image.asset_usage = RenderAssetUsages::default();
    image
}

/// Lets a camera draw into `target`.
pub fn image_target(target: &Handle<Image>) -> RenderTarget {
    RenderTarget::Image(target.clone().into())
}

fn publish_pipelines(
    cache: Res<PipelineCache>,
    waiting: Res<PipelinesWaiting>,
    errors: Res<PipelineErrors>,
) {
    use bevy::render::render_resource::CachedPipelineState;
    waiting
        .0
        .store(cache.waiting_pipelines().count(), Ordering::Relaxed);
    let mut errors = errors.0.lock().unwrap();
    errors.clear();
    for pipeline in cache.pipelines() {
        if let CachedPipelineState::Err(error) = &pipeline.state {
            errors.push(format!("{error}"));
        }
    }
}
