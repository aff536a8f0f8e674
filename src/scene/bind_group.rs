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
    light_maps::{GpuLightMaps, SceneLightMaps, prepare_bind_groups},
    opacity::{OpacityTextures, SceneOpacity},
    volume::{ExtractedVolume, GpuVolume, with_volume},
    world::{
        lights::{GpuLight, GpuLights, SceneLights},
        sky::{GpuSky, SceneSky},
    },
};
use crate::{
    gpu::layout::{GroupLayout, filtered, storage_read, uniform},
    schedule::GiPrepare,
};

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
                    prepare_scene_bind_groups
                        .in_set(GiPrepare::Bindings)
                        .after(prepare_bind_groups),
                ),
            );
    }
}

/// Layout of group 1; `bindings.wgsl` is its twin.
pub fn scene_layout() -> GroupLayout {
    GroupLayout::new(
        "gi/scene",
        // Debug views look it up, too.
        ShaderStages::COMPUTE | ShaderStages::FRAGMENT,
    )
    .with("volume", uniform::<GpuVolume>())
    .with("lights", storage_read::<GpuLights>())
    .with("light_maps", storage_read::<GpuLightMaps>())
    .with("light_depth", texture_2d_array(TextureSampleType::Depth))
    .with("depth_sampler", sampler(SamplerBindingType::Comparison))
    .with("sky", uniform::<GpuSky>())
    .with("sky_map", texture_cube(filtered()))
    .with("sky_sampler", sampler(SamplerBindingType::Filtering))
    .with("opacity_cells", texture_3d(filtered()))
    .with("opacity_sampler", sampler(SamplerBindingType::Filtering))
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
    let layout = scene_layout();
    for (entity, volume, own) in &volumes {
        let mut uniform = UniformBuffer::from(volume.gpu());
        uniform.write_buffer(&device, &queue);
        let bind_group = layout
            .bind(&device, &cache)
            .with("volume", &uniform)
            .with("lights", lights.clone())
            .with("light_maps", light_maps.clone())
            .with("light_depth", depth)
            .with("depth_sampler", depth_sampler)
            .with("sky", sky_uniform.clone())
            .with("sky_map", sky_map)
            .with("sky_sampler", sky_sampler)
            .with("opacity_cells", own.map_or(&opacity.none, |own| &own.view))
            .with("opacity_sampler", &opacity.sampler)
            .build();
        commands.entity(entity).insert(SceneBindGroup(bind_group));
    }
}
