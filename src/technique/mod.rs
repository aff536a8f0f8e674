//! The contract between a technique and the rest of the crate.
//!
//! A [`Technique`] computes indirect light. It is a folder of this module, or a type of your own:
//! [`TechniquePlugin`](crate::TechniquePlugin) adds it to an app, and does all that is the same for every one.
//! Techniques know nothing of each other.
//!
//! # A frame
//!
//! 1. [`Technique::needs`] says what it reads of the [scene's capture](crate::scene), while a camera uses it.
//! 2. Each [`GiVolume`](crate::GiVolume) has a [`Cache`] of the technique. [`Cache::update`] decides what the frame
//!    computes anew, and makes the bind groups for it.
//! 3. [`Cache::record`] records that, in [`GiSystems::UpdateCaches`](crate::GiSystems::UpdateCaches).
//! 4. Two compute shaders look the cache up: the *gather* for each gathered pixel, the *export* for each probe of a coarse
//!    grid, from which forward-rendered objects are lit.
//!
//! What follows is the same for all: accumulation over frames, a filter, upsampling, and the composite.
//!
//! # The gather shader
//!
//! Workgroups of 8x8, one thread a gathered pixel. Bind groups: 0 the camera's surfaces (`bevy_gi::surface`), 1 the scene
//! (`bevy_gi::scene::bindings`), 2 the technique's cache, 3 input and output (`bevy_gi::apply::gather`, which has `begin`
//! and `store`). It writes radiances in nits: `E / pi` for diffuse light, and for specular light the radiance along the
//! mirror direction, averaged over the lobe.
//!
//! # The export shader
//!
//! Workgroups of 4x4x4, one thread a side of a probe's ambient cube. Bind groups: 0 the probes (`bevy_gi::apply::export`,
//! which has `exported_side` and `store`), 1 the scene, 2 the cache. It writes `E / pi` in nits.

pub mod hints;
pub mod vct;

use bevy::{
    app::App,
    asset::{AssetServer, Handle},
    ecs::{component::Mutable, prelude::*},
    render::{
        render_resource::{BindGroup, BindGroupLayoutDescriptor, PipelineCache},
        renderer::{RenderDevice, RenderQueue},
    },
    shader::{Shader, ShaderDefVal},
};

use crate::{
    debug::GiDebugSettings,
    gpu::caps::GiSupport,
    scene::{
        probes::SceneProbes, rsm::SceneRsm, units::LightUnits, volume::ExtractedVolume,
        voxels::SceneVoxels,
    },
    settings::{GiSettings, GiTechnique},
    surface::depth::CameraDepth,
};
pub use crate::{
    gpu::{
        caps::DeviceNeeds,
        compute::{ComputePass, Groups, Recorder, groups},
        statistics::GiStatistics,
    },
    scene::{
        bind_group::{LightingVersion, SceneBindGroup, scene_layout},
        needs::SceneNeeds,
    },
    settings::{Clamp, Clamped, SettingsResource},
};

/// An algorithm that computes indirect light. See the [module](self) for what runs when.
pub trait Technique: Sized + Send + Sync + 'static {
    /// Short name in lower case. It selects the technique, see [`GiTechnique`], and its passes are called
    /// `gi/NAME/gather` and so on.
    const NAME: &'static str;
    /// Its name as a title.
    const TITLE: &'static str;
    /// What it needs of the device beyond what every technique does. Default: nothing.
    const DEVICE: DeviceNeeds = DeviceNeeds::NONE;

    /// Its parameters.
    type Settings: SettingsResource;
    /// Its compute pipelines.
    type Pipelines: Pipelines;
    /// The light that it keeps of a volume.
    type Cache: Cache<Self>;

    /// Names of the debug views that it paints, see [`GiView`](crate::GiView). Default: none of its own.
    const VIEWS: &'static [&'static str] = &[];

    /// Loads shaders, and adds debug views. Anything that is the same for all techniques is done already.
    fn build(app: &mut App);

    /// What it reads of the scene's capture; nothing else is captured for it. Default: nothing.
    fn needs(_settings: &Self::Settings) -> SceneNeeds {
        SceneNeeds::default()
    }

    /// Layout of group 2 of the gather and of the export: the cache.
    fn cache_layout() -> BindGroupLayoutDescriptor;

    /// The gather shader.
    fn gather(server: &AssetServer) -> LookupShader;

    /// The export shader.
    fn export(server: &AssetServer) -> LookupShader;
}

impl GiTechnique {
    /// The name of a technique.
    pub const fn of<T: Technique>() -> Self {
        Self::new(T::NAME)
    }
}

/// A shader that looks a cache up.
pub struct LookupShader {
    /// The file.
    pub shader: Handle<Shader>,
    /// Its entry point.
    pub entry: &'static str,
    /// Definitions for its preprocessor.
    pub defs: Vec<ShaderDefVal>,
}

impl LookupShader {
    /// The entry point `entry` of a file.
    pub fn new(shader: Handle<Shader>, entry: &'static str, defs: Vec<ShaderDefVal>) -> Self {
        Self {
            shader,
            entry,
            defs,
        }
    }
}

/// The compute pipelines of a technique.
pub trait Pipelines: Resource + Sized {
    /// Queues all of them, once the device is there and can run the technique.
    fn new(server: &AssetServer, cache: &PipelineCache) -> Self;

    /// All passes.
    fn passes(&self) -> Vec<ComputePass>;

    /// Whether all of them are compiled. Caches are made from then on.
    fn ready(&self, cache: &PipelineCache) -> bool {
        self.passes().iter().all(|pass| pass.ready(cache))
    }
}

/// Of a technique without passes of its own: the gather and the export are all.
#[derive(Resource)]
pub struct NoPipelines;

impl Pipelines for NoPipelines {
    fn new(_: &AssetServer, _: &PipelineCache) -> Self {
        Self
    }

    fn passes(&self) -> Vec<ComputePass> {
        Vec::new()
    }
}

/// What the cache of a volume is made from, in one frame.
pub struct Frame<'a, T: Technique> {
    /// The technique's parameters.
    pub settings: &'a T::Settings,
    /// Those for all techniques.
    pub gi: &'a GiSettings,
    /// What is shown for debugging.
    pub debug: &'a GiDebugSettings,
    /// Grows with each [`GiHistory::reset`](crate::GiHistory::reset).
    pub history: u32,
    /// The volume.
    pub volume: &'a ExtractedVolume,
    /// Its voxels, if the technique needs them and once there are any.
    pub voxels: Option<&'a SceneVoxels>,
    /// Its probes, likewise.
    pub probes: Option<&'a SceneProbes>,
    /// Reflective shadow maps of all lights.
    pub rsm: &'a SceneRsm,
    /// Changes whenever light arrives differently.
    pub lighting: LightingVersion,
    /// Units in which light is stored.
    pub units: &'a LightUnits,
    /// Depth as the primary camera saw it, in the frame before.
    pub(crate) camera_depth: &'a CameraDepth,
    /// The technique's pipelines.
    pub pipelines: &'a T::Pipelines,
    /// All pipelines of the app.
    pub cache: &'a PipelineCache,
    /// Where memory is made.
    pub device: &'a RenderDevice,
    /// Where it is written.
    pub queue: &'a RenderQueue,
    /// Where memory and work are counted.
    pub statistics: &'a GiStatistics,
}

/// What is there to record a volume's update with.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The volume's voxels, if any.
    pub voxels: Option<&'a SceneVoxels>,
    /// Its probes, if any.
    pub probes: Option<&'a SceneProbes>,
    /// Reflective shadow maps of all lights.
    pub rsm: &'a SceneRsm,
    /// Group 1: the scene, with this volume.
    pub scene: &'a BindGroup,
}

/// The light that a technique keeps of one volume: a component of the volume's entity in the render world.
///
/// It is made once pipelines and inputs are there, and removed when no camera uses the technique any more.
pub trait Cache<T: Technique>: Component<Mutability = Mutable> + Sized {
    /// Memory for a volume; `None` while something is not there yet.
    fn new(frame: &Frame<T>) -> Option<Self>;

    /// Whether the memory is that of [`new`](Self::new); if not, the cache is made anew. Default: always.
    fn fits(&self, _frame: &Frame<T>) -> bool {
        true
    }

    /// Decides what this frame computes, and prepares it.
    fn update(&mut self, frame: &Frame<T>) -> Activity;

    /// Records the passes of this frame; none where nothing has changed. Default: none at all.
    fn record(&self, _pipelines: &T::Pipelines, _inputs: Inputs, _recorder: &mut Recorder) {}

    /// Group 2 of the gather and of the export, once there is something to look up.
    fn bind_group(&self) -> Option<&BindGroup>;
}

/// What a cache does in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Activity {
    /// While the light of the cache changes, how cameras treat their history of it. `None`: it rests.
    pub settling: Option<Settling>,
    /// Whether the volume's probes are to trace other rays in the next frame.
    pub look_again: bool,
}

impl Activity {
    /// The light of the cache changes: cameras mix in so many past frames at most.
    pub const fn settling(history_frames: u32) -> Self {
        Self {
            settling: Some(Settling {
                history_frames,
                blur: 0,
            }),
            look_again: false,
        }
    }
}

/// On a volume's entity in the render world while its cache still changes: what cameras remember of
/// past frames is then worth less.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settling {
    /// Maximum number of past frames that a camera mixes in meanwhile: as few as the noise of the gather allows.
    pub history_frames: u32,
    /// Gathered pixels by which the spatial filter reaches farther meanwhile, for the noise that so short a history
    /// leaves.
    pub blur: u32,
}

/// Run condition of all that is a technique's own: whether the device has what it needs.
pub(crate) fn possible<T: Technique>(support: Option<Res<GiSupport>>) -> bool {
    support.is_some_and(|support| support.technique(GiTechnique::of::<T>()).is_none())
}
