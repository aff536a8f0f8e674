//! `SceneLights`: every light that bounces, in photometric units, in one GPU buffer.
//!
//! Bevy extracts and shadows only lights that some camera sees. These lights are extracted separately, so that
//! light from behind the camera bounces too. Kinds and falloffs are those of Bevy
//! (`bevy_pbr/src/render/pbr_lighting.wgsl`), so that direct and bounced light agree.

use std::f32::consts::PI;

use bevy::{
    app::{App, Plugin},
    camera::visibility::{InheritedVisibility, RenderLayers},
    color::{Color, ColorToComponents},
    ecs::{prelude::*, system::SystemParam},
    light::{DirectionalLight, PointLight, RectLight, SpotLight},
    log::warn,
    math::{
        Vec3, Vec3A,
        bounding::{Aabb3d, BoundingVolume},
    },
    reflect::prelude::*,
    render::{
        Extract, ExtractSchedule, RenderApp,
        render_resource::{ShaderType, StorageBuffer},
    },
    transform::components::GlobalTransform,
};
use serde::{Deserialize, Serialize};

use super::viewers::Viewers;
use crate::scene::{
    bounds::overlaps,
    volume::{Grid, VolumeGrid},
};
use crate::{
    gpu::statistics::GiStatistics,
    settings::{Clamp, GiSettings, Parameters, ParametersKind, SettingsComponentPlugin},
};

/// How a light takes part in global illumination.
///
/// Optional: every Bevy light takes part at full strength, unless [`GiSettings::auto_lights`] is off.
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct GiLight {
    /// Factor on the bounced light. Direct light is not affected. 1 is physical. Range 0..=16, default 1.
    pub intensity: f32,
    /// Whether bounced light is shadowed by a shadow map. Default `true`. Turning it off saves the map.
    /// Techniques that use reflective shadow maps have shadows in any case.
    pub shadows: bool,
    /// Size of the light's reflective shadow maps, texels along the side, rounded up to a power of two. 0 takes
    /// [`GiCaptureSettings::rsm_size`](crate::GiCaptureSettings::rsm_size). Range 0, 64..=2048, default 0. Cost: all maps take the memory of the largest.
    pub rsm_size: u32,
    /// Minimum number of frames between two updates of the light's reflective shadow maps. Range 1..=256,
    /// default 1. Cost: inversely proportional, while the light or the surfaces in its view move.
    pub rsm_interval: u32,
}

impl GiLight {
    /// A light that does not bounce.
    pub const OFF: Self = Self {
        intensity: 0.0,
        shadows: false,
        rsm_size: 0,
        rsm_interval: 1,
    };
}

impl Default for GiLight {
    fn default() -> Self {
        Self {
            intensity: 1.0,
            shadows: true,
            rsm_size: 0,
            rsm_interval: 1,
        }
    }
}

impl Parameters for GiLight {
    const KIND: ParametersKind = ParametersKind::Scene;

    fn clamp(&mut self, c: &mut Clamp) {
        c.float("intensity", &mut self.intensity, 0.0, 16.0);
        if self.rsm_size != 0 {
            self.rsm_size = self.rsm_size.max(64);
        }
        c.int("rsm_size", &mut self.rsm_size, 0, 2048).unit("px");
        c.int("rsm_interval", &mut self.rsm_interval, 1, 256)
            .unit("frames");
    }
}

/// Kinds of [`GpuLight`]. WGSL gets them as shader definitions, see `shader_defs`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LightKind {
    /// `color` in lux.
    Directional,
    /// `color` in candela.
    Point,
    /// `color` in candela.
    Spot,
    /// `color` in nits, on one side.
    Rect,
}

/// A light on the GPU.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub struct GpuLight {
    /// Metres.
    pub position: Vec3,
    /// A [`LightKind`].
    pub kind: u32,
    /// Lux, candela or nits, see [`LightKind`]. Linear Rec. 709.
    pub color: Vec3,
    /// Metres. The light ends there, as in Bevy.
    pub range: f32,
    /// Unit vector in which the light travels.
    pub direction: Vec3,
    /// Cosine of the cone inside which a spot is not dimmed.
    pub cos_inner: f32,
    /// Half of a rect light's width, metres, as a vector.
    pub half_width: Vec3,
    /// Cosine of the cone outside of which a spot is dark.
    pub cos_outer: f32,
    /// Half of a rect light's height, metres, as a vector.
    pub half_height: Vec3,
    /// First of its light maps, or -1 if nothing casts shadows.
    pub shadow: i32,
    /// Distance along an axis of its maps within which surfaces neither receive nor block the light of a point
    /// or spot light, as in Bevy (`shadow_map_near_z`). Metres. Less in small volumes, so that a doll's house
    /// is not part of its own lamp.
    pub near: f32,
}

impl GpuLight {
    /// Whether the light is infinitely far away.
    pub fn is_directional(&self) -> bool {
        self.kind == LightKind::Directional as u32
    }

    /// The same light, but for its colour and strength.
    pub(crate) fn without_color(&self) -> Self {
        Self {
            color: Vec3::ZERO,
            ..*self
        }
    }
}

impl GpuLight {
    /// Area of a rect light, square metres.
    pub fn area(&self) -> f32 {
        4.0 * self.half_width.length() * self.half_height.length()
    }
}

/// A light that takes part in global illumination.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneLight {
    /// Entity in the main world.
    pub entity: Entity,
    /// Render layers. As in Bevy, only meshes that share one of them block the light.
    pub layers: RenderLayers,
    /// Its GPU data, but for `shadow`, which [`light_maps`](crate::scene::light_maps) decides.
    pub gpu: GpuLight,
    /// Whether it asks for shadow maps.
    pub shadows: bool,
    /// Size of its reflective shadow maps in texels, if it differs from the settings.
    pub rsm_size: Option<u32>,
    /// Minimum number of frames between two updates of its reflective shadow maps.
    pub rsm_interval: u32,
}

impl SceneLight {
    /// How far it gets; `None`: everywhere.
    pub(crate) fn reach(&self) -> Option<Aabb3d> {
        let lamp = !self.gpu.is_directional();
        lamp.then(|| Aabb3d::new(self.gpu.position, Vec3::splat(self.gpu.range)))
    }

    /// Luminous flux of the strongest colour, lumens; of a directional light its illuminance, lux.
    pub(crate) fn power(&self) -> f32 {
        let gpu = &self.gpu;
        let unit = match gpu.kind {
            kind if kind == LightKind::Point as u32 => 4.0 * PI,
            kind if kind == LightKind::Spot as u32 => 2.0 * PI * (1.0 - gpu.cos_outer),
            kind if kind == LightKind::Rect as u32 => PI * gpu.area(),
            _ => 1.0,
        };
        unit * gpu.color.max_element()
    }
}

/// All lights that take part, in the render world.
#[derive(Resource, Default)]
pub struct SceneLights {
    /// Directional lights first, then the others by luminous flux.
    pub lights: Vec<SceneLight>,
    /// Grows whenever a light changes.
    pub version: u64,
    /// `array<GpuLight>`, with a dark one at its end so that it is never empty.
    pub buffer: StorageBuffer<GpuLights>,
}

/// The buffer behind [`SceneLights::buffer`].
#[derive(ShaderType, Default)]
pub struct GpuLights {
    /// Lights in `array`.
    pub count: u32,
    /// The lights.
    #[shader(size(runtime))]
    pub array: Vec<GpuLight>,
}

pub(crate) struct LightsPlugin;

impl Plugin for LightsPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins(SettingsComponentPlugin::<GiLight>::default());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .init_resource::<SceneLights>()
            .add_systems(ExtractSchedule, extract_lights);
    }
}

type LightQuery<'w, 's, L> = Query<
    'w,
    's,
    (
        Entity,
        &'static L,
        &'static GlobalTransform,
        &'static InheritedVisibility,
        Option<&'static RenderLayers>,
        Option<&'static GiLight>,
    ),
>;

/// A light of Bevy's, as ours.
trait ToGpuLight: Component {
    fn to_gpu(&self, transform: &GlobalTransform) -> GpuLight;
}

fn rgb(color: Color, factor: f32) -> Vec3 {
    color.to_linear().to_vec3().max(Vec3::ZERO) * factor
}

/// Where a light looks; 0 if its transform is without size, which Bevy's own `forward` does not bear.
fn forward(transform: &GlobalTransform) -> Vec3 {
    Vec3::from(transform.affine().matrix3 * Vec3A::NEG_Z).normalize_or_zero()
}

impl ToGpuLight for DirectionalLight {
    fn to_gpu(&self, transform: &GlobalTransform) -> GpuLight {
        GpuLight {
            kind: LightKind::Directional as u32,
            color: rgb(self.color, self.illuminance),
            direction: forward(transform),
            ..Default::default()
        }
    }
}

impl ToGpuLight for PointLight {
    fn to_gpu(&self, transform: &GlobalTransform) -> GpuLight {
        GpuLight {
            kind: LightKind::Point as u32,
            position: transform.translation(),
            // Bevy: lumens over the sphere's solid angle.
            color: rgb(self.color, self.intensity / (4.0 * PI)),
            range: self.range,
            near: self.shadow_map_near_z,
            direction: forward(transform),
            ..Default::default()
        }
    }
}

impl ToGpuLight for SpotLight {
    fn to_gpu(&self, transform: &GlobalTransform) -> GpuLight {
        GpuLight {
            kind: LightKind::Spot as u32,
            position: transform.translation(),
            // Bevy divides a spot's lumens by the whole sphere too.
            color: rgb(self.color, self.intensity / (4.0 * PI)),
            range: self.range,
            near: self.shadow_map_near_z,
            direction: forward(transform),
            cos_inner: self.inner_angle.cos(),
            cos_outer: self.outer_angle.cos(),
            ..Default::default()
        }
    }
}

impl ToGpuLight for RectLight {
    fn to_gpu(&self, transform: &GlobalTransform) -> GpuLight {
        let affine = transform.affine();
        let half_width = Vec3::from(affine.matrix3.x_axis) * self.width * 0.5;
        let half_height = Vec3::from(affine.matrix3.y_axis) * self.height * 0.5;
        let area = 4.0 * half_width.length() * half_height.length();
        GpuLight {
            kind: LightKind::Rect as u32,
            position: transform.translation(),
            // A diffuse emitter of one side: power = pi * area * luminance.
            color: rgb(self.color, self.intensity / (PI * area.max(1e-12))),
            range: self.range,
            direction: forward(transform),
            half_width,
            half_height,
            ..Default::default()
        }
    }
}

fn collect<L: ToGpuLight>(
    lights: &LightQuery<L>,
    viewers: &Viewers,
    auto_lights: bool,
    out: &mut Vec<SceneLight>,
) {
    for (entity, light, transform, visibility, layers, gi) in lights {
        let layers = layers.unwrap_or_default();
        if !visibility.get() || !viewers.see(layers) || (gi.is_none() && !auto_lights) {
            continue;
        }
        let share = gi.copied().unwrap_or_default();
        let mut gpu = light.to_gpu(transform);
        gpu.color *= share.intensity;
        let finite = gpu.position.is_finite()
            && gpu.color.is_finite()
            && gpu.direction != Vec3::ZERO
            && gpu.half_width.is_finite()
            && gpu.half_height.is_finite()
            && !gpu.range.is_nan();
        if finite && gpu.color.max_element() > 0.0 {
            gpu.range = gpu.range.clamp(0.0, 1e9);
            gpu.shadow = -1;
            out.push(SceneLight {
                entity,
                layers: layers.clone(),
                gpu,
                shadows: share.shadows,
                rsm_size: (share.rsm_size > 0).then_some(share.rsm_size),
                rsm_interval: share.rsm_interval,
            });
        }
    }
}

/// Every light of the main world.
#[derive(SystemParam)]
pub(crate) struct LightQueries<'w, 's> {
    directional: LightQuery<'w, 's, DirectionalLight>,
    point: LightQuery<'w, 's, PointLight>,
    spot: LightQuery<'w, 's, SpotLight>,
    rect: LightQuery<'w, 's, RectLight>,
}

impl LightQueries<'_, '_> {
    /// Those that take part.
    pub fn collect(&self, settings: &GiSettings, viewers: &Viewers) -> Vec<SceneLight> {
        let mut lights = Vec::new();
        collect(
            &self.directional,
            viewers,
            settings.auto_lights,
            &mut lights,
        );
        collect(&self.point, viewers, settings.auto_lights, &mut lights);
        collect(&self.spot, viewers, settings.auto_lights, &mut lights);
        collect(&self.rect, viewers, settings.auto_lights, &mut lights);
        lights
    }
}

/// How much of half a volume's longest side the surroundings of a lamp are at most.
const NEAR_OF_VOLUME: f32 = 0.1;

pub(crate) fn extract_lights(
    settings: Extract<Res<GiSettings>>,
    grids: Extract<Query<&VolumeGrid>>,
    viewers: Extract<Res<Viewers>>,
    lights: Extract<LightQueries>,
    mut scene: ResMut<SceneLights>,
) {
    let mut lights = lights.collect(&settings, &viewers);
    let volumes: Vec<_> = grids.iter().filter_map(|grid| grid.0).collect();
    for light in &mut lights {
        let Some(lit) = light.reach() else { continue };
        let reached = volumes.iter().map(Grid::bounds);
        let reached = reached.filter(|volume| overlaps(&lit, volume));
        let radii = reached.map(|volume| volume.half_size().max_element());
        let smallest = radii.fold(f32::MAX, f32::min);
        light.gpu.near = light.gpu.near.min(NEAR_OF_VOLUME * smallest);
    }
    // The entity makes the order, and so the sums, repeatable.
    lights.sort_by(|a, b| {
        let sun = |l: &SceneLight| l.gpu.is_directional();
        (sun(b).cmp(&sun(a)))
            .then(b.power().total_cmp(&a.power()))
            .then(a.entity.cmp(&b.entity))
    });
    if lights != scene.lights {
        scene.lights = lights;
        scene.version += 1;
    }
}

/// Says that lights go without maps, and what follows.
pub(crate) fn warn_of_lights(statistics: &GiStatistics, without: usize) {
    if without > 0 {
        let warning = format!(
            "{without} lights do not bounce: even the smallest maps of all lights do not fit into the memory of \
             GiCaptureSettings.max_shadow_maps"
        );
        if !statistics.warnings().contains(&warning) {
            warn!("{warning}");
        }
        statistics.warn(vec![warning]);
    }
}

/// For `lights.wgsl`.
pub(crate) fn shader_defs() -> [bevy::shader::ShaderDefVal; 4] {
    use bevy::shader::ShaderDefVal::UInt;
    [
        UInt("LIGHT_DIRECTIONAL".into(), LightKind::Directional as u32),
        UInt("LIGHT_POINT".into(), LightKind::Point as u32),
        UInt("LIGHT_SPOT".into(), LightKind::Spot as u32),
        UInt("LIGHT_RECT".into(), LightKind::Rect as u32),
    ]
}
