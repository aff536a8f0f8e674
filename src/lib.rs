//! Real-time global illumination for [Bevy](https://bevy.org) on ordinary GPUs: light that bounces,
//! without ray-tracing hardware and without baking.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_gi::prelude::*;
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, GiPlugins))
//!     .add_systems(Startup, |mut commands: Commands| {
//!         commands.spawn((Camera3d::default(), GiCamera::default()));
//!         // Where light is computed: metres; the Transform places it.
//!         commands.spawn(GiVolume::new(Vec3::new(20.0, 10.0, 12.0)));
//!     })
//!     .run();
//! ```
//!
//! # Techniques
//!
//! | [`GiTechnique`] | module | idea |
//! |---|---|---|
//! | `"hints"`, the default | [`technique::hints`] | a coarse lattice of points holds the light, surfaces interpolate |
//! | `"vct"` | [`technique::vct`] | voxelize, light, filter, trace cones per pixel: glossy reflections |
//!
//! # How it hangs together
//!
//! [`GiSystems`] is the frame as one list. [`scene`] captures what light sees: voxels, shadow maps,
//! lights and sky. A [`technique`] turns that into a cache, and looks it up per pixel. The rest,
//! the same for all techniques, accumulates over frames, brings the light to full resolution, and
//! adds it to the camera's HDR target.
//!
//! # Units
//!
//! Everything is photometric, linear, Rec. 709: directional lights in lux, point and spot lights in
//! candela (Bevy's lumens over 4 pi), emission and caches in nits. Exposure is applied once, at the
//! end, as Bevy does. A closed room with walls of albedo 1/2 that emit 1 nit has 2 nits.
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
mod overlay;
mod plugins;
#[cfg(feature = "reference")]
pub mod reference;
pub mod scene;
mod schedule;
mod settings;
mod surface;
pub mod technique;
mod technique_plugin;
#[cfg(test)]
mod wgsl_tests;

pub use camera::GiCamera;
pub use debug::{GiDebugSettings, GiSlice, GiView, HintView};
pub use gpu::{
    caps::GiSupport,
    statistics::{GiStatistics, last_frame},
};
pub use plugins::GiPlugins;
pub use scene::{
    cascades::GiCascades,
    lights::GiLight,
    material::{GiMaterial, GiMaterialPlugin},
    probes::{ProbePin, ProbePlacement, ProbeSet},
    visibility::NotGiCaster,
    volume::GiVolume,
};
pub use schedule::{GiPrepare, GiSystems};
pub use settings::{
    EmissiveUnits, FieldRange, GatherResolution, GiHistory, GiQuality, GiSettings,
    GiSettingsRegistry, GiSky, GiTechnique, GiTechniques, LightShare, SettingsEntry,
    SettingsValues, TechniqueEntry,
};
pub use technique::{
    hints::{
        HintBounce, HintOcclusion, HintReconstruction, HintSampling, RadianceHints,
        RadianceHintsSettings, ShOrder,
    },
    vct::{ConeLayout, VoxelConeTracing, VoxelConeTracingSettings},
};
pub use technique_plugin::TechniquePlugin;

/// What an app usually needs.
pub mod prelude {
    pub use crate::{
        GiCamera, GiCascades, GiDebugSettings, GiHistory, GiLight, GiMaterialPlugin, GiPlugins,
        GiQuality, GiSettings, GiSky, GiTechnique, GiTechniques, GiView, GiVolume, NotGiCaster,
        ProbeSet, RadianceHints, RadianceHintsSettings, TechniquePlugin, VoxelConeTracing,
        VoxelConeTracingSettings,
    };
}
