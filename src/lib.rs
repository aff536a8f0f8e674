//! Real-time global illumination for [Bevy](https://bevy.org) on ordinary GPUs.
#![warn(missing_docs)]

mod apply;
mod camera;
mod debug;
mod forward_views;
mod gpu;
mod plugins;
pub mod scene;
mod schedule;
mod settings;
mod surface;
pub mod technique;

pub use camera::GiCamera;
pub use debug::{GiDebugSettings, GiView};
pub use gpu::{caps::GiSupport, memory::GpuMemory};
pub use plugins::GiPlugins;
pub use scene::{lights::GiLight, visibility::NotGiCaster, volume::GiVolume};
pub use schedule::GiSystems;
pub use settings::{
    EmissiveUnits, GatherResolution, GiHistory, GiQuality, GiSettings, GiSky, GiTechnique,
};
pub use technique::vct::{ConeLayout, VoxelConeTracingSettings};

/// What an app usually needs.
pub mod prelude {
    pub use crate::{
        GiCamera, GiDebugSettings, GiHistory, GiLight, GiPlugins, GiQuality, GiSettings, GiSky,
        GiTechnique, GiView, GiVolume, NotGiCaster, VoxelConeTracingSettings,
    };
}
