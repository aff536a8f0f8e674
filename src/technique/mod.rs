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
//! 4. A compute shader, the *export*, looks the cache up for each of a coarse grid of ambient cubes that light
//!    forward-rendered objects.
//! 5. Each camera has a [`ViewCache`] of the technique, if it has such. It is like the cache of a volume, and is
//!    recorded in [`GiSystems::UpdateViewCaches`](crate::GiSystems::UpdateViewCaches), when the camera's surfaces
//!    are known.
//! 6. Another compute shader, the *gather*, looks up light for each gathered pixel: in the caches of volumes, or in
//!    that of the camera ([`Lookup`]).
//!
//! What a technique does not have is [`NoCache`], [`NoPipelines`] or [`NoDebug`].
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
//! | 2 | the technique's cache, of a volume or of the camera | its own |
//! | 3 | input and output | `bevy_gi::apply::gather`, with `begin` and `store` |
//!
//! It writes radiances in nits: `E / pi` for diffuse light, and for specular light the radiance along the
//! mirror direction, averaged over the lobe.
//!
//! A [`TechniqueView`] may have another such shader, which runs in its place while the view is shown.
//!
//! # The export shader
//!
//! Workgroups of 4x4x4 ([`block::CUBE`]), one thread per side of an ambient cube. Bind groups:
//!
//! | group | holds | WGSL module |
//! |---|---|---|
//! | 0 | the ambient cubes | `bevy_gi::apply::export`, with `exported_side` and `store` |
//! | 1 | the scene, with the volume | `bevy_gi::scene::bindings` |
//! | 2 | the technique's cache | its own |
//!
//! It writes `E / pi` in nits.

mod cache;
pub mod hints;
pub mod vct;

pub(crate) use cache::ViewSettling;
pub use cache::{
    Activity, Cache, Frame, Inputs, NoCache, Settling, ViewCache, ViewFrame, ViewInputs,
};

use bevy::{
    app::App,
    asset::{AssetServer, Handle},
    ecs::prelude::*,
    reflect::prelude::*,
    render::{extract_resource::ExtractResource, render_resource::PipelineCache},
    shader::{Shader, ShaderDefVal},
};

use crate::{debug::GiView, gpu::caps::GiSupport, settings::GiTechnique};
pub use crate::{
    gpu::{
        caps::DeviceNeeds,
        compute::{ComputePass, Dispatch, Recorder, block},
        layout::{
            Binding, GroupBuilder, GroupLayout, dynamic_uniform, filtered, loaded, storage_read,
            storage_write, uniform,
        },
        statistics::{GiStatistics, Tracked},
    },
    scene::{
        bind_group::{LightingVersion, SceneBindGroup, scene_layout},
        needs::SceneNeeds,
    },
    settings::{Clamp, Lookup, Parameters, Preset},
    surface::surface_layout,
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
    /// What is shown of it in debug views, a resource; or [`NoDebug`].
    type Debug: Parameters + Resource + ExtractResource<Source = Self::Debug>;
    /// Compute pipelines; or [`NoPipelines`].
    type Pipelines: Pipelines;
    /// The light that it stores for a volume; or [`NoCache`].
    type Cache: Cache<Self>;
    /// The light that it stores for a camera; or [`NoCache`].
    type ViewCache: ViewCache<Self>;

    /// Where the gather looks light up. Default: in the caches of volumes.
    const LOOKUP: Lookup = Lookup::PerVolume;
    /// Debug views that only this technique has, see [`GiView`]. Default: none.
    const VIEWS: &'static [TechniqueView] = &[];

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

    /// The export shader. Default: none, and forward-rendered objects have no light of this technique. An export
    /// looks up the caches of volumes.
    fn export(_: &AssetServer) -> Option<LookupShader> {
        None
    }
}

/// A debug view that only one technique has.
#[derive(Clone, Copy)]
pub struct TechniqueView {
    /// Its name.
    pub view: GiView,
    /// Meaning of the colours, with their range.
    pub legend: &'static str,
    /// Whether it shows luminances, which are exposed, rather than plain numbers.
    pub is_luminance: bool,
    /// The shader that gathers it. `None`: the technique draws it over the picture.
    pub(crate) shader: Option<fn(&AssetServer) -> LookupShader>,
}

impl TechniqueView {
    /// A view that is gathered: `shader` runs in place of the gather, with the same groups. What it stores as diffuse
    /// light is shown as it is, without albedo.
    pub const fn gathered(
        view: GiView,
        legend: &'static str,
        is_luminance: bool,
        shader: fn(&AssetServer) -> LookupShader,
    ) -> Self {
        Self {
            view,
            legend,
            is_luminance,
            shader: Some(shader),
        }
    }

    /// A view of cells, which the technique adds to volumes as a `VoxelView`.
    pub(crate) const fn cells(view: GiView, legend: &'static str, is_luminance: bool) -> Self {
        Self {
            view,
            legend,
            is_luminance,
            shader: None,
        }
    }
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

/// The debug settings of a technique that has none.
#[derive(Resource, Reflect, ExtractResource, Clone, Default)]
pub struct NoDebug {}

impl Parameters for NoDebug {}

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

/// Run condition of all that is a technique's own: whether the device has what it needs.
pub(crate) fn possible<T: Technique>(support: Option<Res<GiSupport>>) -> bool {
    support.is_some_and(|support| support.technique(GiTechnique::of::<T>()).is_none())
}
