//! The techniques, and the contract between them and the rest.
//!
//! A technique is a folder of this module. It turns the [scene's capture](crate::scene) into one
//! cache per volume, in the set [`GiSystems::UpdateCaches`](crate::GiSystems::UpdateCaches), and
//! offers two compute shaders that look the cache up: per pixel, its *gather*, and per probe of a
//! coarse grid, its *export* for what is drawn forward. Everything after that (`apply`) is the same
//! for all. Techniques know nothing of each other.
//!
//! # The gather shader
//!
//! Workgroups of 8x8, one thread per gathered pixel. Bind groups:
//! 0 the camera's surfaces (`bevy_gi::surface`), 1 the scene (`bevy_gi::scene::bindings`), 2 the
//! technique's cache, 3 input and output (`bevy_gi::apply::gather`, which offers
//! `begin` and `store`). It writes radiances in nits: `E / pi` for diffuse light, and the
//! radiance along the mirror direction, averaged over the lobe, for specular light.
//!
//! # The export shader
//!
//! Workgroups of 4x4x4, one thread per side of a probe's ambient cube. Bind groups: 0 the probes
//! (`bevy_gi::apply::export`, which offers `exported_side` and `store`), 1 the scene, 2 the cache. It
//! writes `E / pi` in nits.

pub mod hints;
pub mod vct;

use bevy::{
    asset::{AssetServer, Handle},
    ecs::prelude::*,
    render::render_resource::{BindGroup, BindGroupLayoutDescriptor},
    shader::{Shader, ShaderDefVal},
};

use crate::{
    gpu::caps::{DeviceNeeds, GiSupport},
    scene::needs::SceneNeeds,
    settings::GiTechnique,
};

/// What every technique provides.
pub(crate) trait Technique: Send + Sync + 'static {
    /// Which one it is; its name is the second part of its passes' names.
    const TECHNIQUE: GiTechnique;
    /// Name of the gather pass.
    const GATHER: &'static str;
    /// Entry point of the gather shader.
    const GATHER_ENTRY: &'static str;
    /// Name of the export pass.
    const EXPORT: &'static str;
    /// Entry point of the export shader.
    const EXPORT_ENTRY: &'static str;
    /// What it reads of the scene's capture; nothing else is captured for it.
    const NEEDS: SceneNeeds;
    /// What it needs of the device beyond what all techniques do.
    const DEVICE: DeviceNeeds;
    /// Its cache, on the volume's entity in the render world.
    type Cache: Component + TechniqueCache;

    /// Layout of group 2 of the gather.
    fn cache_layout() -> BindGroupLayoutDescriptor;
    /// The gather shader and its definitions.
    fn gather_shader(server: &AssetServer) -> (Handle<Shader>, Vec<ShaderDefVal>);
    /// The export shader and its definitions.
    fn export_shader(server: &AssetServer) -> (Handle<Shader>, Vec<ShaderDefVal>);
}

/// Run condition of all that is a technique's own: whether the device has what it needs.
pub(crate) fn possible<T: Technique>(support: Option<Res<GiSupport>>) -> bool {
    support.is_some_and(|support| support.technique(T::TECHNIQUE).is_none())
}

/// On a volume's entity in the render world while its cache still changes: what cameras remember of
/// past frames is then worth less.
#[derive(Component, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Settling {
    /// Most past frames that a camera mixes in meanwhile: as few as the noise of the gather allows.
    pub history_frames: u32,
    /// Gathered pixels by which the spatial filter reaches farther meanwhile, for what noise so short a history
    /// leaves.
    pub blur: u32,
}

/// What the gather needs of a technique's cache.
pub(crate) trait TechniqueCache {
    /// Group 2, once there is something to look up.
    fn bind_group(&self) -> Option<&BindGroup>;
}
