//! The sky: what unblocked light paths see.
//!
//! Caches are shared by all cameras, so there is one sky: that of the primary GI camera.

use bevy::{
    app::{App, Plugin},
    asset::AssetId,
    color::ColorToComponents,
    ecs::prelude::*,
    image::Image,
    light::{AmbientLight, EnvironmentMapLight, GlobalAmbientLight, Skybox},
    math::{Quat, Vec3, Vec4},
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup,
        render_asset::RenderAssets,
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

use crate::{
    camera::PrimaryGiCamera,
    schedule::GiPrepare,
    settings::{GiSettings, GiSky},
};

/// The sky in WGSL.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuSky {
    /// Unit quaternion from world to map.
    pub rotation: Vec4,
    /// Nits, from everywhere.
    pub constant: Vec3,
    /// Nits per unit of the map.
    pub brightness: f32,
    /// Mip levels of the map.
    pub levels: f32,
}

/// The sky, in the render world.
#[derive(Resource, Default)]
pub(crate) struct SceneSky {
    pub gpu: GpuSky,
    pub map: Option<AssetId<Image>>,
    /// The map, or a black one; and what identifies it.
    pub view: Option<TextureView>,
    pub buffer: UniformBuffer<GpuSky>,
    /// Bilinear, between levels too.
    pub sampler: Option<Sampler>,
    /// Grows whenever the sky changes.
    pub version: u64,
}

#[derive(Resource)]
struct BlackCube(TextureView);

pub(crate) struct SkyPlugin;

impl Plugin for SkyPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SceneSky>()
            .add_systems(RenderStartup, init_black_cube)
            .add_systems(ExtractSchedule, extract_sky)
            .add_systems(Render, prepare_sky.in_set(GiPrepare::Lights));
    }
}

fn init_black_cube(mut commands: Commands, device: Res<RenderDevice>) {
    // New textures are zero, in wgpu.
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("gi/scene/black_sky"),
        size: Extent3d {
            width: 1,
            height: 1,
            depth_or_array_layers: 6,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8Unorm,
        usage: TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    commands.insert_resource(BlackCube(texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::Cube),
        ..Default::default()
    })));
}

type CameraSky = (
    Option<&'static EnvironmentMapLight>,
    Option<&'static Skybox>,
    Option<&'static AmbientLight>,
);

fn extract_sky(
    settings: Extract<Res<GiSettings>>,
    global_ambient: Extract<Option<Res<GlobalAmbientLight>>>,
    primary: Extract<Res<PrimaryGiCamera>>,
    cameras: Extract<Query<CameraSky>>,
    mut sky: ResMut<SceneSky>,
) {
    let mut gpu = GpuSky {
        rotation: Quat::IDENTITY.into(),
        levels: 1.0,
        ..Default::default()
    };
    let mut map = None;
    let camera = primary.0.and_then(|camera| cameras.get(camera).ok());
    match settings.sky {
        GiSky::Black => {}
        GiSky::Constant(color) => gpu.constant = color.to_vec3(),
        GiSky::Camera => {
            if let Some((environment, skybox, ambient)) = camera {
                if let Some(light) = environment {
                    map = Some(light.specular_map.id());
                    gpu.brightness = light.intensity;
                    gpu.rotation = light.rotation.inverse().into();
                } else if let Some((skybox, image)) =
                    skybox.and_then(|s| Some((s, s.image.as_ref()?)))
                {
                    map = Some(image.id());
                    gpu.brightness = skybox.brightness;
                    gpu.rotation = skybox.rotation.inverse().into();
                } else if settings.replace_ambient {
                    let (color, brightness) = match (ambient, global_ambient.as_ref()) {
                        (Some(a), _) => (a.color, a.brightness),
                        (None, Some(a)) => (a.color, a.brightness),
                        (None, None) => Default::default(),
                    };
                    gpu.constant = color.to_linear().to_vec3() * brightness;
                }
            }
        }
    }
    if !gpu.brightness.is_finite() || !gpu.constant.is_finite() {
        gpu = GpuSky::default();
        map = None;
    }
    // The number of levels is known only once the map is on the GPU.
    gpu.levels = sky.gpu.levels;
    if gpu != sky.gpu || map != sky.map {
        sky.gpu = gpu;
        sky.map = map;
        sky.version += 1;
    }
}

fn prepare_sky(
    mut sky: ResMut<SceneSky>,
    black: Res<BlackCube>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut written: Local<Option<u64>>,
) {
    sky.sampler.get_or_insert_with(|| {
        device.create_sampler(&SamplerDescriptor {
            label: Some("gi/scene/sky_sampler"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: MipmapFilterMode::Linear,
            ..Default::default()
        })
    });
    let image = sky.map.and_then(|id| images.get(id)).filter(|image| {
        image
            .texture_view_descriptor
            .as_ref()
            .is_some_and(|v| v.dimension == Some(TextureViewDimension::Cube))
    });
    let (view, levels) = match image {
        Some(image) => (
            image.texture_view.clone(),
            image.texture_descriptor.mip_level_count as f32,
        ),
        None => (black.0.clone(), 1.0),
    };
    if sky.gpu.levels != levels || sky.view.as_ref().map(|v| v.id()) != Some(view.id()) {
        sky.gpu.levels = levels;
        sky.view = Some(view);
        sky.version += 1;
    }
    if written.replace(sky.version) != Some(sky.version) {
        let gpu = sky.gpu;
        sky.buffer.set(gpu);
        sky.buffer.write_buffer(&device, &queue);
    }
}
