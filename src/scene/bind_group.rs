//! Group 1 of every pass: the scene's lights, their maps, the sky, and the grid of one volume.

use bevy::{
    app::{App, Plugin},
    ecs::prelude::*,
    render::{
        Render, RenderApp,
        render_resource::{binding_types::*, *},
        renderer::{RenderDevice, RenderQueue},
    },
    shader::load_shader_library,
};

use super::{
    light_maps::SceneLightMaps,
    lights::{GpuLight, GpuLights, SceneLights},
    opacity::{OpacityTextures, SceneOpacity},
    sky::{GpuSky, SceneSky},
    volume::{ExtractedVolume, GpuVolume, with_volume},
};
use crate::schedule::GiPrepare;

/// Group 1, for a volume.
#[derive(Component)]
pub struct SceneBindGroup(pub(crate) BindGroup);

/// Numbers that grow whenever light arrives differently.
#[derive(Resource, Default, Clone, Copy, PartialEq, Eq, Debug)]
pub struct LightingVersion {
    /// Lights themselves.
    pub lights: u64,
    /// Their shadow maps.
    pub shadows: u64,
    /// The sky.
    pub sky: u64,
}

pub(crate) struct SceneBindGroupPlugin;

impl Plugin for SceneBindGroupPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "types.wgsl");
        load_shader_library!(app, "bindings.wgsl");
        load_shader_library!(app, "lights.wgsl");
        load_shader_library!(app, "sky.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<LightingVersion>()
            .add_observer(with_volume::<SceneBindGroup>)
            .add_systems(
                Render,
                (
                    write_lights.in_set(GiPrepare::Lights),
                    prepare_scene_bind_groups.in_set(GiPrepare::Bindings),
                ),
            );
    }
}

/// Layout of group 1; `bindings.wgsl` is its twin.
pub fn scene_layout() -> BindGroupLayoutDescriptor {
    BindGroupLayoutDescriptor::new(
        "gi/scene",
        &BindGroupLayoutEntries::sequential(
            // Debug views look it up, too.
            ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
            (
                uniform_buffer::<GpuVolume>(false),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                texture_2d_array(TextureSampleType::Depth),
                sampler(SamplerBindingType::Comparison),
                uniform_buffer::<GpuSky>(false),
                texture_cube(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                texture_3d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
            ),
        ),
    )
}

/// Brings the buffer of lights up to date, now that it is known which shadow maps each has.
fn write_lights(
    mut scene: ResMut<SceneLights>,
    maps: Res<SceneLightMaps>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut written: Local<Option<Vec<GpuLight>>>,
) {
    let lights = scene.lights.iter().enumerate();
    let mut array: Vec<_> = lights
        .map(|(number, light)| GpuLight {
            shadow: maps.first_shadow(number),
            ..light.gpu
        })
        .collect();
    if written.as_ref() == Some(&array) {
        return;
    }
    *written = Some(array.clone());
    let count = array.len() as u32;
    array.push(GpuLight::default());
    scene.buffer.set(GpuLights { count, array });
    scene.buffer.write_buffer(&device, &queue);
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn prepare_scene_bind_groups(
    mut commands: Commands,
    volumes: Query<(Entity, &ExtractedVolume, Option<&SceneOpacity>)>,
    opacity: Option<Res<OpacityTextures>>,
    lights: Res<SceneLights>,
    maps: Res<SceneLightMaps>,
    sky: Res<SceneSky>,
    mut version: ResMut<LightingVersion>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    *version = LightingVersion {
        lights: lights.version,
        shadows: maps.shadow_version,
        sky: sky.version,
    };
    let (
        Some(lights),
        Some(light_maps),
        Some(depth),
        Some(depth_sampler),
        Some(sky_uniform),
        Some(sky_map),
        Some(sky_sampler),
        Some(opacity),
    ) = (
        lights.buffer.binding(),
        maps.gpu.binding(),
        maps.depth(),
        &maps.sampler,
        sky.buffer.binding(),
        &sky.view,
        &sky.sampler,
        &opacity,
    )
    else {
        return;
    };
    if volumes.is_empty() {
        return;
    }
    let layout = cache.get_bind_group_layout(&scene_layout());
    for (entity, volume, own) in &volumes {
        let mut uniform = UniformBuffer::from(volume.gpu());
        uniform.write_buffer(&device, &queue);
        let bind_group = device.create_bind_group(
            "gi/scene",
            &layout,
            &BindGroupEntries::sequential((
                &uniform,
                lights.clone(),
                light_maps.clone(),
                depth,
                depth_sampler,
                sky_uniform.clone(),
                sky_map,
                sky_sampler,
                own.map_or(&opacity.none, |own| &own.view),
                &opacity.sampler,
            )),
        );
        commands.entity(entity).insert(SceneBindGroup(bind_group));
    }
}
