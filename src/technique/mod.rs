//! The contract between a technique and the rest of the crate.
//!
//! A [`Technique`] computes indirect light. It is a folder of this module, or a type of an app.
//! [`TechniquePlugin`](crate::TechniquePlugin) adds it to an app, and does everything that is the same for all
//! techniques. Techniques do not depend on each other.
//!
//! # A frame
//!
//! 1. [`Technique::needs`] says what the technique reads of the [scene's capture](crate::scene), while a camera
//!    uses it.
//! 2. Each [`GiVolume`](crate::GiVolume) has a [`Cache`] of the technique. [`Cache::update`] decides what the
//!    frame computes anew, and makes the bind groups for it.
//! 3. [`Cache::record`] records that, in [`GiSystems::UpdateCaches`](crate::GiSystems::UpdateCaches).
//! 4. Two compute shaders look the cache up: the *gather* for each gathered pixel, the *export* for each probe
//!    of a coarse grid that lights forward-rendered objects.
//!
//! Everything after that is the same for all techniques: accumulation over frames, a spatial filter,
//! upsampling, and the composite.
//!
//! # The gather shader
//!
//! Workgroups of 8x8 ([`block::TILE`]), one thread per gathered pixel. Bind groups:
//!
//! | group | holds | WGSL module |
//! |---|---|---|
//! | 0 | surfaces that the camera sees | `bevy_gi::surface` |
//! | 1 | the scene, with the volume | `bevy_gi::scene::bindings` |
//! | 2 | the technique's cache | its own |
//! | 3 | input and output | `bevy_gi::apply::gather`, with `begin` and `store` |
//!
//! It writes radiances in nits: `E / pi` for diffuse light, and for specular light the radiance along the
//! mirror direction, averaged over the lobe.
//!
//! # The export shader
//!
//! Workgroups of 4x4x4 ([`block::CUBE`]), one thread per side of a probe's ambient cube. Bind groups:
//!
//! | group | holds | WGSL module |
//! |---|---|---|
//! | 0 | the probes | `bevy_gi::apply::export`, with `exported_side` and `store` |
//! | 1 | the scene, with the volume | `bevy_gi::scene::bindings` |
//! | 2 | the technique's cache | its own |
//!
//! It writes `E / pi` in nits.

pub mod hints;
pub mod vct;

use bevy::{
    app::App,
    asset::{AssetServer, Handle},
    ecs::{component::Mutable, prelude::*},
    render::{
        extract_resource::ExtractResource,
        render_resource::{BindGroup, PipelineCache},
        renderer::{RenderDevice, RenderQueue},
    },
    shader::{Shader, ShaderDefVal},
};

use crate::{
    debug::GiDebugSettings,
    gpu::caps::GiSupport,
    scene::{
        light_maps::SceneLightMaps, probes::SceneProbes, units::LightUnits,
        volume::ExtractedVolume, voxels::SceneVoxels,
    },
    settings::{GiCaptureSettings, GiSettings, GiTechnique},
    surface::depth::CameraDepth,
};
pub use crate::{
    gpu::{
        caps::DeviceNeeds,
        compute::{ComputePass, Dispatch, Recorder, block},
        layout::{
            Binding, GroupBuilder, GroupLayout, dynamic_uniform, filtered, loaded, storage_read,
            storage_write, uniform,
        },
        statistics::GiStatistics,
    },
    scene::{
        bind_group::{LightingVersion, SceneBindGroup, scene_layout},
        needs::SceneNeeds,
    },
    settings::{Clamp, Parameters, Preset},
};

/// An algorithm that computes indirect light. The [module](self) says what runs when.
pub trait Technique: Sized + Send + Sync + 'static {
    /// Short name in lower case. It selects the technique, see [`GiTechnique`], and is part of the names of its
    /// passes, such as `gi/NAME/gather`.
    const NAME: &'static str;
    /// Title, as shown to users.
    const TITLE: &'static str;
    /// What it needs of the device beyond what every technique does. A device that lacks it turns this technique off,
    /// with a reason in the log. Default: nothing.
    const DEVICE: DeviceNeeds = DeviceNeeds::NONE;

    /// Parameters, a resource.
    type Settings: Parameters + Resource + ExtractResource<Source = Self::Settings>;
    /// Compute pipelines.
    type Pipelines: Pipelines;
    /// The light that it stores for a volume.
    type Cache: Cache<Self>;

    /// Names of the debug views that only this technique draws, see [`GiView`](crate::GiView). Default: none.
    const VIEWS: &'static [&'static str] = &[];

    /// Loads shaders and adds plugins for debug views. Registration, settings, caches, gather and export are
    /// set up by [`TechniquePlugin`](crate::TechniquePlugin).
    fn build(app: &mut App);

    /// Parts of the scene's capture that it reads. Other parts are not captured for it. Default: none.
    fn needs(_settings: &Self::Settings) -> SceneNeeds {
        SceneNeeds::default()
    }

    /// Layout of group 2 of the gather and of the export: the cache.
    fn cache_layout() -> GroupLayout;

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

/// A shader that looks up a cache.
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
    /// Queues all pipelines. Called once the device is there, if it can run the technique.
    fn new(server: &AssetServer, cache: &PipelineCache) -> Self;

    /// All passes.
    fn passes(&self) -> Vec<ComputePass>;

    /// Whether all pipelines are compiled. Caches are made from then on.
    fn ready(&self, cache: &PipelineCache) -> bool {
        self.passes().iter().all(|pass| pass.ready(cache))
    }
}

/// The pipelines of a technique that has only its gather and its export.
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

/// Everything that the cache of a volume is computed from, in one frame.
pub struct Frame<'a, T: Technique> {
    /// Parameters of the technique.
    pub settings: &'a T::Settings,
    /// How the scene is lit.
    pub gi: &'a GiSettings,
    /// Budget of the capture.
    pub capture: &'a GiCaptureSettings,
    /// Debug views.
    pub debug: &'a GiDebugSettings,
    /// Number of calls of [`GiHistory::reset`](crate::GiHistory::reset) so far.
    pub history: u32,
    /// The volume.
    pub volume: &'a ExtractedVolume,
    /// Voxels of the volume. `None` if the technique does not need them, or before they exist.
    pub voxels: Option<&'a SceneVoxels>,
    /// Probes of the volume. `None` if the technique does not need them, or before they exist.
    pub probes: Option<&'a SceneProbes>,
    /// What all lights see: shadow maps and reflective shadow maps.
    pub light_maps: &'a SceneLightMaps,
    /// Changes whenever the direct light changes.
    pub lighting: LightingVersion,
    /// Units of stored light.
    pub units: &'a LightUnits,
    /// Depth as the primary camera saw it, in the frame before.
    pub(crate) camera_depth: &'a CameraDepth,
    /// Pipelines of the technique.
    pub pipelines: &'a T::Pipelines,
    /// All pipelines of the app.
    pub cache: &'a PipelineCache,
    /// Makes buffers, textures and bind groups.
    pub device: &'a RenderDevice,
    /// Writes buffers and textures.
    pub queue: &'a RenderQueue,
    /// Counts memory and work.
    pub statistics: &'a GiStatistics,
}

/// Inputs of [`Cache::record`].
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// Voxels of the volume, if any.
    pub voxels: Option<&'a SceneVoxels>,
    /// Probes of the volume, if any.
    pub probes: Option<&'a SceneProbes>,
    /// What all lights see: shadow maps and reflective shadow maps.
    pub light_maps: &'a SceneLightMaps,
    /// Bind group 1: the scene, with this volume.
    pub scene: &'a BindGroup,
}

/// The light that a technique stores for one volume: a component of the volume's entity in the render world.
///
/// It is made once pipelines and inputs exist, and removed when no camera uses the technique any more.
pub trait Cache<T: Technique>: Component<Mutability = Mutable> + Sized {
    /// Allocates memory for a volume. `None` while an input is missing.
    fn new(frame: &Frame<T>) -> Option<Self>;

    /// Whether the memory is what [`new`](Self::new) would allocate. If not, the cache is made anew. Default: always.
    fn fits(&self, _frame: &Frame<T>) -> bool {
        true
    }

    /// Decides what this frame computes, and makes bind groups for it.
    fn update(&mut self, frame: &Frame<T>) -> Activity;

    /// Records the passes of this frame. Records none if nothing has changed. Default: none.
    fn record(&self, _pipelines: &T::Pipelines, _inputs: Inputs, _recorder: &mut Recorder) {}

    /// Bind group 2 of the gather and of the export. `None` before there is light to look up.
    fn bind_group(&self) -> Option<&BindGroup>;
}

/// What a cache does in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Activity {
    /// How cameras treat their history while the light of the cache changes. `None` if it has settled.
    pub settling: Option<Settling>,
    /// Whether the probes of the volume trace other rays in the next frame.
    pub look_again: bool,
}

impl Activity {
    /// The light of the cache changes, and cameras accumulate at most that many frames of it.
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

/// How cameras treat their history while the light of a cache changes. A component of the volume's entity in
/// the render world.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settling {
    /// Maximum number of accumulated frames meanwhile. As few as the noise of the gather allows.
    pub history_frames: u32,
    /// Gathered pixels that are added to the radius of the spatial filter meanwhile, against the noise of so
    /// short a history.
    pub blur: u32,
}

/// Run condition of all that is a technique's own: whether the device has what it needs.
pub(crate) fn possible<T: Technique>(support: Option<Res<GiSupport>>) -> bool {
    support.is_some_and(|support| support.technique(GiTechnique::of::<T>()).is_none())
}
