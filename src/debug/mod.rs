//! Debug views: parts of the light and of the surfaces, in place of the picture.

use bevy::{
    app::{App, Plugin},
    ecs::prelude::*,
    reflect::prelude::*,
    render::extract_resource::{ExtractResource, ExtractResourcePlugin},
    shader::ShaderDefVal,
};
use serde::{Deserialize, Serialize};

/// What GI cameras show.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum GiView {
    /// The picture.
    #[default]
    Full,
    /// The picture without indirect light: what is shown with the technique off.
    Direct,
    /// Indirect light alone, diffuse and specular.
    Indirect,
    /// Its diffuse part.
    Diffuse,
    /// Its specular part.
    Specular,
    /// Diffuse indirect light before the albedo: `E / pi`.
    Irradiance,
    /// Diffuse albedo, unexposed.
    Albedo,
    /// Shading normal in the world, `n / 2 + 1/2`, unexposed.
    Normal,
    /// Perceptual roughness, unexposed.
    Roughness,
    /// Part of each pixel that some volume lights, unexposed.
    Coverage,
}

impl GiView {
    /// Every view, in the order in which keys go through them.
    pub const ALL: [Self; 10] = [
        Self::Full,
        Self::Direct,
        Self::Indirect,
        Self::Diffuse,
        Self::Specular,
        Self::Irradiance,
        Self::Albedo,
        Self::Normal,
        Self::Roughness,
        Self::Coverage,
    ];

    /// Lower-case name, as used by the viewer's `--view`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Diffuse => "diffuse",
            Self::Specular => "specular",
            Self::Irradiance => "irradiance",
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Roughness => "roughness",
            Self::Coverage => "coverage",
        }
    }

    /// The view of that [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|view| view.name() == name)
    }

    /// Whether it shows luminances, which are exposed, rather than plain numbers.
    pub const fn is_luminance(self) -> bool {
        matches!(
            self,
            Self::Full
                | Self::Direct
                | Self::Indirect
                | Self::Diffuse
                | Self::Specular
                | Self::Irradiance
        )
    }

    /// `VIEW_<NAME>` for each view, for `composite.wgsl`.
    pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
        Self::ALL
            .iter()
            .map(|view| {
                let name = format!("VIEW_{}", view.name().to_uppercase());
                ShaderDefVal::UInt(name, *view as u32)
            })
            .collect()
    }
}

/// What to show for debugging. The same for all GI cameras; those whose technique is off show their
/// picture.
#[derive(
    Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, Default, PartialEq,
)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct GiDebugSettings {
    /// What GI cameras show. Default: the picture.
    pub view: GiView,
}

pub(crate) struct DebugPlugin;

impl Plugin for DebugPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<GiDebugSettings>()
            .add_plugins(ExtractResourcePlugin::<GiDebugSettings>::default());
    }
}
