//! [`GiView`]: what a debug view shows.

use bevy::{reflect::prelude::*, shader::ShaderDefVal};
use serde::{Deserialize, Serialize};

/// What GI cameras show. Views named *unexposed* show plain numbers, without exposure and tone mapping.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum GiView {
    /// The picture.
    #[default]
    Full,
    /// The picture without indirect light, as with the technique off.
    Direct,
    /// Indirect light alone, diffuse and specular.
    Indirect,
    /// Diffuse indirect light.
    Diffuse,
    /// Specular indirect light.
    Specular,
    /// Diffuse indirect light before it is multiplied by the albedo: `E / pi`.
    Irradiance,
    /// Diffuse albedo, unexposed.
    Albedo,
    /// Shading normal in world space, `n / 2 + 1/2`, unexposed.
    Normal,
    /// Perceptual roughness, unexposed.
    Roughness,
    /// Factor of the material's occlusion and Bevy's SSAO on diffuse indirect light, unexposed.
    Occlusion,
    /// Screen-space motion since the last frame, unexposed.
    Motion,
    /// Number of frames accumulated in the indirect light of each pixel, unexposed.
    History,
    /// Which pixels are gathered, and how well the gathered pixels around every other pixel represent it,
    /// unexposed.
    Gather,
    /// Weight with which volumes light each pixel, unexposed.
    Coverage,
    /// Albedo of voxels, unexposed.
    VoxelAlbedo,
    /// Normal of voxels, `n / 2 + 1/2`, unexposed.
    VoxelNormal,
    /// Emission of voxels.
    VoxelEmission,
    /// Radiance of cells of voxels towards the viewer. Only for techniques that store it: voxel cone tracing.
    VoxelRadiance,
    /// Opacity of cells of voxels along the view direction, unexposed. Only for techniques that store it: voxel
    /// cone tracing.
    VoxelOpacity,
    /// Ambient occlusion by cones: part of the hemisphere above each surface that no voxels block, weighted by the
    /// cosine, unexposed. The volume's border blocks nothing.
    AmbientOcclusion,
    /// All shadow maps, side by side: depth from each light, unexposed.
    ShadowMaps,
    /// All reflective shadow maps: light of each lamp that the surfaces in its view reflect.
    RsmFlux,
    /// All reflective shadow maps: normals, `n / 2 + 1/2`, unexposed.
    RsmNormal,
    /// All reflective shadow maps: albedo, unexposed.
    RsmAlbedo,
    /// All reflective shadow maps: depth, unexposed.
    RsmDepth,
}

/// The part of the crate that draws a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Painter {
    /// Nobody: it is Bevy's picture.
    Bevy,
    /// The composite, in place of adding light.
    Composite,
    /// The pass that shows the surfaces in voxels.
    Voxels,
    /// The same pass, with the technique's own cells.
    Technique,
    /// The pass that traces cones through the opacity of volumes.
    Opacity,
    /// The pass that shows what lights see.
    LightMaps,
}

impl GiView {
    /// Every view, in the order in which examples cycle through them.
    pub const ALL: [Self; 25] = [
        Self::Full,
        Self::Direct,
        Self::Indirect,
        Self::Diffuse,
        Self::Specular,
        Self::Irradiance,
        Self::Albedo,
        Self::Normal,
        Self::Roughness,
        Self::Occlusion,
        Self::Motion,
        Self::History,
        Self::Gather,
        Self::Coverage,
        Self::VoxelAlbedo,
        Self::VoxelNormal,
        Self::VoxelEmission,
        Self::VoxelRadiance,
        Self::VoxelOpacity,
        Self::AmbientOcclusion,
        Self::ShadowMaps,
        Self::RsmFlux,
        Self::RsmNormal,
        Self::RsmAlbedo,
        Self::RsmDepth,
    ];

    /// Lower-case name, as in the viewer's `--view`.
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
            Self::Occlusion => "occlusion",
            Self::Motion => "motion",
            Self::History => "history",
            Self::Gather => "gather",
            Self::Coverage => "coverage",
            Self::VoxelAlbedo => "voxel-albedo",
            Self::VoxelNormal => "voxel-normal",
            Self::VoxelEmission => "voxel-emission",
            Self::VoxelRadiance => "voxel-radiance",
            Self::VoxelOpacity => "voxel-opacity",
            Self::AmbientOcclusion => "ambient-occlusion",
            Self::ShadowMaps => "shadow-maps",
            Self::RsmFlux => "rsm-flux",
            Self::RsmNormal => "rsm-normal",
            Self::RsmAlbedo => "rsm-albedo",
            Self::RsmDepth => "rsm-depth",
        }
    }

    /// Meaning of the colours, with their range.
    pub const fn legend(self) -> &'static str {
        match self {
            Self::Full => "the picture, exposed",
            Self::Direct => "the picture without indirect light, exposed",
            Self::Indirect => "indirect light, diffuse and specular, exposed",
            Self::Diffuse => "diffuse indirect light, exposed",
            Self::Specular => "specular indirect light, exposed",
            Self::Irradiance => "indirect irradiance over pi, before the albedo, exposed",
            Self::Albedo => "diffuse albedo, 0 to 1",
            Self::Normal => "shading normal in the world: grey is 0, red +x, green +y, blue +z",
            Self::Roughness => "perceptual roughness: black 0, white 1",
            Self::Occlusion => {
                "ambient occlusion of material and SSAO: black 0 (none left), white 1 (all left)"
            }
            Self::Motion => {
                "motion since the last frame: grey 0, red +16 px to the right, green +16 px down, black -16 px"
            }
            Self::History => "frames in the history: black 1, white as many as the settings allow",
            Self::Gather => {
                "white: gathered pixels; others: green if the gathered ones around show their surface, red if not"
            }
            Self::Coverage => "part of the pixel that volumes light: black 0, white 1",
            Self::VoxelAlbedo => "albedo of voxels, 0 to 1",
            Self::VoxelNormal => "normal of voxels: grey is 0, red +x, green +y, blue +z",
            Self::VoxelEmission => "emission of voxels, exposed",
            Self::VoxelRadiance => {
                "light that cells of voxels send to the viewer, exposed (voxel cone tracing has them)"
            }
            Self::VoxelOpacity => {
                "opacity of cells along the view: black 0, white 1 (voxel cone tracing has them)"
            }
            Self::AmbientOcclusion => {
                "part of the hemisphere above that no voxels block: black 0, white 1"
            }
            Self::ShadowMaps => {
                "depth seen from each light, a tile a map: white near, black far or nothing"
            }
            Self::RsmFlux => {
                "light that lit surfaces send on, as each light sees them, a tile a map, exposed"
            }
            Self::RsmNormal => {
                "normals as each light sees them: grey is 0, red +x, green +y, blue +z"
            }
            Self::RsmAlbedo => "albedo as each light sees it, 0 to 1",
            Self::RsmDepth => {
                "depth of the reflective shadow maps: white near, black far or nothing"
            }
        }
    }

    /// The view with this [`name`](Self::name).
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|view| view.name() == name)
    }

    /// Whether the view shows luminances, which are exposed, rather than plain numbers.
    pub const fn is_luminance(self) -> bool {
        matches!(
            self,
            Self::Full
                | Self::Direct
                | Self::Indirect
                | Self::Diffuse
                | Self::Specular
                | Self::Irradiance
                | Self::VoxelEmission
                | Self::VoxelRadiance
                | Self::RsmFlux
        )
    }

    /// Who draws it.
    pub(crate) const fn painter(self) -> Painter {
        match self {
            Self::Direct => Painter::Bevy,
            Self::VoxelAlbedo | Self::VoxelNormal | Self::VoxelEmission => Painter::Voxels,
            Self::VoxelRadiance | Self::VoxelOpacity => Painter::Technique,
            Self::AmbientOcclusion => Painter::Opacity,
            Self::ShadowMaps
            | Self::RsmFlux
            | Self::RsmNormal
            | Self::RsmAlbedo
            | Self::RsmDepth => Painter::LightMaps,
            _ => Painter::Composite,
        }
    }

    /// `VIEW_<NAME>` for each view, for shaders.
    pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
        Self::ALL
            .iter()
            .map(|view| {
                let name = view.name().to_uppercase().replace('-', "_");
                ShaderDefVal::UInt(format!("VIEW_{name}"), *view as u32)
            })
            .collect()
    }
}

/// What the spheres of hints show, see [`GiDebugSettings::show_hints`](crate::GiDebugSettings::show_hints).
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintView {
    /// All light, exposed.
    #[default]
    Light,
    /// Light of lamps after one bounce, exposed.
    FirstBounce,
    /// Light of emissive surfaces, exposed.
    Emission,
    /// Light of the sky, exposed.
    Sky,
    /// Light one bounce after the first bounce, emission and the sky, exposed.
    SecondBounce,
    /// Light of all later bounces, exposed.
    LaterBounces,
    /// Distance of the nearest surface that lights the hint, relative to the reach: black 0, white 1 or more.
    Nearest,
    /// Distance of the farthest surface that lights the hint, relative to the reach: black 0, white 1 or more.
    Farthest,
    /// Visibility between the hint and the picked hint as estimated by equation 11: black 0, white 1.
    Visibility,
    /// Probability that light comes from around the hint, `1 - nearest` (equation 9 before normalisation):
    /// black 0, white 1.
    Confidence,
    /// Mean albedo of the surfaces around the hint, used for coloured bounces between hints.
    Albedo,
    /// Ringing of the spherical harmonics: negative irradiance, relative to the irradiance of the same light
    /// from all directions. Black 0, red 1.
    Negative,
    /// Where light would leak without [`ProbeSet::visibility`](crate::ProbeSet::visibility): share of the six
    /// neighbours that the hint does not see. Black 0, red 1.
    Leak,
}

impl HintView {
    /// Meaning of the colours, with their range.
    pub const fn legend(self) -> &'static str {
        match self {
            Self::Light => "all light that arrives from each side, exposed",
            Self::FirstBounce => "light of lamps that has bounced once, exposed",
            Self::Emission => "light of emissive surfaces, exposed",
            Self::Sky => "light of the sky, exposed",
            Self::SecondBounce => "light that has bounced once more, exposed",
            Self::LaterBounces => "light that has bounced more often, exposed",
            Self::Nearest => {
                "the nearest of what lights the hint: black at hand, white at the reach"
            }
            Self::Farthest => {
                "the farthest of what lights the hint: black at hand, white at the reach"
            }
            Self::Visibility => "guessed visibility of the picked hint: black 0, white 1",
            Self::Confidence => "1 - nearest: black 0, white 1",
            Self::Albedo => "mean albedo around, 0 to 1",
            Self::Negative => "irradiance below zero, over that of the mean light: black 0, red 1",
            Self::Leak => "part of the six neighbours that the hint does not see: black 0, red 1",
        }
    }
}

/// A slice through voxels, perpendicular to a world axis.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum GiSlice {
    /// No slice: voxels are shown as cubes.
    #[default]
    None,
    /// The yz plane.
    X,
    /// The xz plane.
    Y,
    /// The xy plane.
    Z,
}
