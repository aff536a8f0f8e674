//! What a technique stores: a [`Cache`] for each volume, and a [`ViewCache`] for each camera.

use bevy::{
    ecs::{component::Mutable, prelude::*},
    math::UVec2,
    render::{
        render_resource::{BindGroup, PipelineCache},
        renderer::{RenderDevice, RenderQueue},
        view::ExtractedView,
    },
};

use crate::{
    camera::GiCamera,
    gpu::{compute::Recorder, statistics::GiStatistics},
    scene::{
        bind_group::LightingVersion, light_maps::SceneLightMaps, probes::SceneProbes,
        units::LightUnits, volume::ExtractedVolume, voxels::SceneVoxels,
    },
    settings::{GiCaptureSettings, GiSettings},
    surface::depth::CameraDepth,
};

use super::Technique;

/// Everything that the cache of a volume is computed from, in one frame.
pub struct Frame<'a, T: Technique> {
    /// Parameters of the technique.
    pub settings: &'a T::Settings,
    /// How the scene is lit.
    pub gi: &'a GiSettings,
    /// Budget of the capture.
    pub capture: &'a GiCaptureSettings,
    /// What is shown of the technique in debug views.
    pub debug: &'a T::Debug,
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

/// Everything that the cache of a camera is computed from, in one frame.
pub struct ViewFrame<'a, T: Technique> {
    /// Parameters of the technique.
    pub settings: &'a T::Settings,
    /// How the scene is lit.
    pub gi: &'a GiSettings,
    /// Budget of the capture.
    pub capture: &'a GiCaptureSettings,
    /// What is shown of the technique in debug views.
    pub debug: &'a T::Debug,
    /// Number of calls of [`GiHistory::reset`](crate::GiHistory::reset) so far.
    pub history: u32,
    /// The camera.
    pub view: &'a ExtractedView,
    /// Settings of the camera.
    pub camera: &'a GiCamera,
    /// Pixels of its viewport.
    pub size: UVec2,
    /// What all lights see: shadow maps and reflective shadow maps.
    pub light_maps: &'a SceneLightMaps,
    /// Changes whenever the direct light changes.
    pub lighting: LightingVersion,
    /// Units of stored light.
    pub units: &'a LightUnits,
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

/// Inputs of [`ViewCache::record`].
#[derive(Clone, Copy)]
pub struct ViewInputs<'a> {
    /// Bind group 0, with [`surface_layout`](super::surface_layout): what the camera sees.
    pub surface: &'a BindGroup,
    /// Dynamic offset of group 0.
    pub offset: u32,
    /// Bind group 1 for each volume that the camera sees, the finest first: the scene, with that volume.
    pub scenes: &'a [&'a BindGroup],
    /// What all lights see: shadow maps and reflective shadow maps.
    pub light_maps: &'a SceneLightMaps,
}

/// The light that a technique stores for one camera: a component of the camera's entity in the render world.
///
/// It is made once pipelines and surfaces exist, and removed when the camera does not use the technique any more.
pub trait ViewCache<T: Technique>: Component<Mutability = Mutable> + Sized {
    /// Allocates memory for a camera. `None` while an input is missing.
    fn new(frame: &ViewFrame<T>) -> Option<Self>;

    /// Whether the memory is what [`new`](Self::new) would allocate. If not, the cache is made anew. Default: always.
    fn fits(&self, _frame: &ViewFrame<T>) -> bool {
        true
    }

    /// Decides what this frame computes, and makes bind groups for it. Returns how the camera treats its history
    /// while the light of the cache changes; `None` if it has settled.
    fn update(&mut self, frame: &ViewFrame<T>) -> Option<Settling>;

    /// Records the passes of this frame, after the camera's prepass and before its gather. Default: none.
    fn record(&self, _pipelines: &T::Pipelines, _inputs: ViewInputs, _recorder: &mut Recorder) {}

    /// Bind group 2 of a gather that looks up [`Lookup::PerView`](super::Lookup::PerView). `None` before there is light to look up.
    fn bind_group(&self) -> Option<&BindGroup>;
}

/// The cache of a technique that stores nothing for volumes, or nothing for cameras. It is never made.
#[derive(Component)]
pub enum NoCache {}

impl<T: Technique> Cache<T> for NoCache {
    fn new(_: &Frame<T>) -> Option<Self> {
        None
    }

    fn update(&mut self, _: &Frame<T>) -> Activity {
        match *self {}
    }

    fn bind_group(&self) -> Option<&BindGroup> {
        match *self {}
    }
}

impl<T: Technique> ViewCache<T> for NoCache {
    fn new(_: &ViewFrame<T>) -> Option<Self> {
        None
    }

    fn update(&mut self, _: &ViewFrame<T>) -> Option<Settling> {
        match *self {}
    }

    fn bind_group(&self) -> Option<&BindGroup> {
        match *self {}
    }
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

/// How a camera treats its history in this frame: by all caches that light it. A component of its entity.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct ViewSettling(pub Option<Settling>);

/// How cameras treat their history while the light of a cache changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settling {
    /// Maximum number of accumulated frames meanwhile. As few as the noise of the gather allows.
    pub history_frames: u32,
    /// Gathered pixels that are added to the radius of the spatial filter meanwhile, against the noise of so
    /// short a history.
    pub blur: u32,
}

impl Settling {
    /// What suits both: the shorter history, and the larger filter.
    pub(crate) fn with(self, other: Self) -> Self {
        Self {
            history_frames: self.history_frames.min(other.history_frames),
            blur: self.blur.max(other.blur),
        }
    }
}
