//! Real-time global illumination for [Bevy](https://bevy.org): bounced light without ray-tracing hardware and
//! without baking.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_gi::prelude::*;
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, GiPlugins))
//!     .add_systems(Startup, |mut commands: Commands| {
//!         commands.spawn((Camera3d::default(), GiCamera::default()));
//!         // Where light is computed. The size is in metres; a Transform places it.
//!         commands.spawn(GiVolume::new(Vec3::new(20.0, 10.0, 12.0)));
//!     })
//!     .run();
//! ```
//!
//! # Where to start
//!
//! | task | type |
//! |---|---|
//! | enable global illumination for a camera; its strength, resolution, history and filter | [`GiCamera`] |
//! | choose where it is computed | [`GiVolume`], [`GiCascades`] for large worlds, [`ProbeSet`] for the placement of probes |
//! | choose the technique, the sky, units of emission | [`GiSettings`], [`GiTechnique`] |
//! | choose the quality, and what the capture may cost | [`GiQuality`], [`GiCaptureSettings`] |
//! | tune a technique | [`RadianceHintsSettings`], [`VoxelConeTracingSettings`] |
//! | exclude a light or a mesh | [`GiLight`], [`NotGiCaster`] |
//! | let custom materials bounce light | [`GiMaterial`], [`GiMaterialPlugin`] |
//! | reset after a teleport or a cut | [`GiCamera::reset`] for a camera, [`GiHistory`] for everything |
//! | find out why it is off | [`GiSupport`] |
//! | debug and measure | [`GiDebugSettings`], [`GiView`], [`GiStatistics`], [`last_frame`] |
//! | list, save and load all parameters, or register your own | [`GiSettingsRegistry`], [`Parameters`] |
//! | write a technique | [`technique::Technique`], [`TechniquePlugin`] |
//! | leave a part of the crate out | [`plugins`] |
//!
//! # Techniques
//!
//! | name | module | idea |
//! |---|---|---|
//! | `"hints"`, the default | [`technique::hints`] | a coarse lattice of points stores light, and surfaces interpolate it |
//! | `"vct"` | [`technique::vct`] | scene is voxelized, lit and filtered, and cones are traced per pixel; glossy reflections |
//!
//! [`GiTechniques`] lists the techniques of an app, its own included.
//!
//! # Features
//!
//! | feature | adds |
//! |---|---|
//! | `inspector` | module `inspector`: an Egui panel with all parameters, times, memory and debug views |
//! | `reference` | module `reference`: a path tracer on the CPU over the same world, to compare with |
//!
//! Neither is enabled by default.
//!
//! # Architecture
//!
//! [`GiSystems`] lists the passes of a frame in order, [`GiPrepare`] the steps that prepare them. [`scene`]
//! captures the scene: voxels and their opacity, light maps, probes, lights and sky. A [`technique`] turns the
//! capture into a cache, and looks it up per pixel. The rest is the same for all techniques: light is
//! accumulated over frames, upsampled to full resolution, and added to the camera's HDR target.
//!
//! # Units
//!
//! All light is photometric, linear, with Rec. 709 primaries: directional lights in lux, point and spot lights
//! in candela (Bevy's lumens over 4 pi), rect lights, emission and caches in nits. Exposure is applied once, at the
//! end, as in Bevy. For example, a closed room with walls of albedo 1/2 that emit 1 nit has 2 nits.
#![warn(missing_docs)]

mod apply;
mod camera;
mod debug;
#[cfg(test)]
mod device_tests;
mod forward_views;
mod gpu;
#[cfg(feature = "inspector")]
pub mod inspector;
#[cfg(test)]
mod no_renderer_tests;
mod overlay;
pub mod plugins;
#[cfg(feature = "reference")]
pub mod reference;
pub mod scene;
mod schedule;
mod settings;
#[cfg(test)]
mod shader_tests;
mod surface;
pub mod technique;
mod technique_plugin;

pub use camera::{GatherResolution, GiCamera, PrimaryGiCamera};
pub use debug::{GiDebugSettings, GiSlice, GiView, GiViews, ViewEntry};
pub use gpu::{
    caps::GiSupport,
    statistics::{GiStatistics, last_frame},
};
pub use plugins::GiPlugins;
pub use scene::{
    volume::{GiCascades, GiVolume, ProbePin, ProbePlacement, ProbeSet},
    world::{
        casters::NotGiCaster,
        lights::GiLight,
        material::{GiMaterial, GiMaterialPlugin},
    },
};
pub use schedule::{GiPrepare, GiSystems};
pub use settings::{
    Clamp, EmissiveUnits, FieldRange, GiCaptureSettings, GiHistory, GiQuality, GiSettings,
    GiSettingsRegistry, GiSky, GiTechnique, GiTechniques, LightShare, Parameters, ParametersKind,
    Preset, SettingsComponentPlugin, SettingsEntry, SettingsResourcePlugin, SettingsValues,
    TechniqueEntry,
};
pub use technique::{
    hints::{
        HintAlbedo, HintBounce, HintDepthTest, HintDisk, HintExchange, HintOcclusion,
        HintReconstruction, HintSampling, HintTaps, HintView, RadianceHints,
        RadianceHintsDebugSettings, RadianceHintsSettings, ShOrder,
    },
    vct::{ConeLayout, VoxelConeTracing, VoxelConeTracingSettings},
};
pub use technique_plugin::TechniquePlugin;

/// What most apps need.
pub mod prelude {
    pub use crate::{
        GiCamera, GiCaptureSettings, GiCascades, GiDebugSettings, GiHistory, GiLight,
        GiMaterialPlugin, GiPlugins, GiQuality, GiSettings, GiSky, GiTechnique, GiTechniques,
        GiView, GiViews, GiVolume, NotGiCaster, ProbeSet, RadianceHints, RadianceHintsSettings,
        TechniquePlugin, VoxelConeTracing, VoxelConeTracingSettings,
    };
}
