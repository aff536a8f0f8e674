//! Pictures in place of what a camera sees.

use bevy::{
    asset::{RenderAssetUsages, embedded_asset},
    camera::visibility::NoFrustumCulling,
    light::{NotShadowCaster, NotShadowReceiver},
    prelude::*,
    render::render_resource::{AsBindGroup, Extent3d, ShaderType, TextureDimension, TextureFormat},
    shader::ShaderRef,
};
use bevy_gi::NotGiCaster;

use crate::headless::Picture;

/// How two pictures are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Layout {
    /// The left one.
    #[default]
    Left,
    /// Left and right of a line.
    Wipe,
    /// The middle of both.
    SideBySide,
    /// How far the left is off the right: blue too dark, red too bright, by 8x8 pixels.
    Heat,
    /// The right one.
    Right,
}

#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub struct OverlaySettings {
    /// Factors from the pictures' values to those of the camera's target.
    pub scale: Vec2,
    /// Where a wipe stands, 0..1 from the left.
    pub split: f32,
    /// A [`Layout`].
    pub mode: u32,
}

impl OverlaySettings {
    /// The left picture alone, times a factor.
    pub fn left(scale: f32) -> Self {
        Self {
            scale: Vec2::splat(scale),
            split: 0.0,
            mode: Layout::Left as u32,
        }
    }
}

/// Draws [`Overlay`]s.
pub struct OverlayPlugin;

impl Plugin for OverlayPlugin {
    fn build(&self, app: &mut App) {
        embedded_asset!(app, "overlay.wgsl");
        app.add_plugins(MaterialPlugin::<Overlay>::default());
    }
}

const SHADER: &str = "embedded://bevy_gi_tools/overlay.wgsl";

/// Covers the whole picture of a camera, whatever the transform.
#[derive(Asset, TypePath, AsBindGroup, Clone, Debug, PartialEq)]
pub struct Overlay {
    #[uniform(0)]
    pub settings: OverlaySettings,
    #[texture(1)]
    pub left: Handle<Image>,
    #[texture(2)]
    pub right: Handle<Image>,
}

impl Material for Overlay {
    fn vertex_shader() -> ShaderRef {
        SHADER.into()
    }
    fn fragment_shader() -> ShaderRef {
        SHADER.into()
    }
    fn enable_prepass() -> bool {
        false
    }
    fn enable_shadows() -> bool {
        false
    }
}

/// What is needed to draw an [`Overlay`].
pub fn bundle(meshes: &mut Assets<Mesh>, overlay: Handle<Overlay>) -> impl Bundle {
    (
        Mesh3d(meshes.add(Rectangle::new(2.0, 2.0))),
        MeshMaterial3d(overlay),
        NoFrustumCulling,
        NotShadowCaster,
        NotShadowReceiver,
        NotGiCaster,
    )
}

/// A picture as a texture in half precision.
pub fn texture(picture: &Picture) -> Image {
    Image::new(
        Extent3d {
            width: picture.size.x,
            height: picture.size.y,
            depth_or_array_layers: 1,
        },
        TextureDimension::D2,
        picture
            .pixels
            .iter()
            .flatten()
            .flat_map(|c| half::f16::from_f32(c.min(65504.0)).to_le_bytes())
            .collect(),
        TextureFormat::Rgba16Float,
        RenderAssetUsages::default(),
    )
}
