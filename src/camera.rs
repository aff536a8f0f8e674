//! [`GiCamera`]: enables global illumination for a camera, and says how it shows it. [`PrimaryGiCamera`]: the one
//! that counts where only one can.

use bevy::{
    app::{App, Plugin, PostUpdate},
    camera::{Camera, Camera3d, Hdr},
    core_pipeline::prepass::{DeferredPrepass, DepthPrepass, MotionVectorPrepass},
    ecs::prelude::*,
    light::{AmbientLight, EnvironmentMapLight},
    log::{info, info_once},
    pbr::{DefaultOpaqueRendererMethod, check_views_need_specialization},
    reflect::prelude::*,
    render::{
        Extract, ExtractSchedule, MainWorld, Render, RenderApp, RenderSystems,
        sync_component::{SyncComponent, SyncComponentPlugin},
        sync_world::RenderEntity,
        view::Msaa,
    },
    transform::TransformSystems,
};
use serde::{Deserialize, Serialize};

use crate::{
    gpu::caps::{GiSupport, supported},
    settings::{
        Clamp, GiQuality, GiSettings, GiTechnique, GiTechniques, Lookup, Parameters,
        ParametersKind, Preset, SettingsComponentPlugin,
    },
};

/// Resolution at which indirect light is gathered, relative to that of the camera.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
pub enum GatherResolution {
    /// One gathered pixel per pixel.
    Full,
    /// One gathered pixel per 2x2 pixels.
    Half,
    /// One gathered pixel per 4x4 pixels.
    #[default]
    Quarter,
}

impl GatherResolution {
    /// Pixels per gathered pixel along each axis: 1, 2 or 4.
    pub const fn divisor(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

/// A camera with this component shows global illumination.
///
/// It brings what it needs: an HDR target, the depth, motion-vector and deferred prepasses, and MSAA off
/// (Bevy's deferred renderer does not support MSAA). Where that overrides a choice of the camera, the log says
/// so once.
///
/// # Several cameras
///
/// Light is computed once for all GI cameras, since it does not depend on the viewpoint. An object takes part
/// if some active GI camera would see it in view: meshes and lights on the `RenderLayers` of any of these
/// cameras. Of meshes with a `VisibilityRange`, those take part that the [primary camera](PrimaryGiCamera) would
/// see; one level of detail replaces the next in the middle of their margins.
/// Cameras whose layers differ therefore share the light of all of these layers. As in Bevy, a mesh casts
/// shadows only from lights with which it shares a layer.
///
/// Cameras side by side each have a `Camera::viewport`, and all but the first clear nothing.
///
/// # Overlay cameras
///
/// A camera that renders over this one on the same target, for example for the user interface, has a higher
/// `Camera::order` and clears nothing. With `Hdr` and `Msaa::Off` it shares this camera's texture. Otherwise it
/// is blended over the picture from a texture of its own.
///
/// ```no_run
/// # use bevy::{camera::Hdr, prelude::*, render::view::Msaa};
/// # use bevy_gi::prelude::*;
/// fn setup(mut commands: Commands) {
///     commands.spawn((Camera3d::default(), GiCamera::default()));
///     let over = Camera { order: 1, clear_color: ClearColorConfig::None, ..default() };
///     commands.spawn((Camera2d, over, Hdr, Msaa::Off));
/// }
/// ```
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
#[require(Camera3d, Hdr, DepthPrepass, MotionVectorPrepass, DeferredPrepass)]
#[serde(default, deny_unknown_fields)]
pub struct GiCamera {
    /// Technique of this camera. `None`, the default, follows [`GiSettings::technique`]. Each technique in use
    /// computes its own light.
    pub technique: Option<GiTechnique>,
    /// Factor on the indirect light that is added to the picture. 1 is physical. Range 0..=16, default 1. It
    /// does not affect the bounces themselves, so light cannot grow without bound. Forward-rendered objects are
    /// lit with the factor of the [primary camera](PrimaryGiCamera). No cost.
    pub strength: f32,
    /// Resolution at which indirect light is gathered. Default [`GatherResolution::Quarter`]. Cost: the gather
    /// is proportional to the number of gathered pixels.
    pub resolution: GatherResolution,
    /// Maximum number of frames accumulated in each gathered pixel, 1 = no accumulation. Range 1..=128, default
    /// 64. Reduced automatically while light changes, as far as the noise of the technique allows (cones: to 8,
    /// hints: to 2). Higher values are more stable. Cost: two reads and two writes per gathered pixel.
    pub history_frames: u32,
    /// Radius of the spatial filter in gathered pixels, 0 = no filter. The filter averages light over the same
    /// surface. Range 0..=3, default 1. One more while light changes, if the gather of the technique is noisy
    /// (cones). Higher values are smoother and less detailed. Cost: proportional to `(2 r + 1)^2`.
    pub denoise_radius: u32,
    /// Drops what this camera has accumulated, in the next frame, and is then false again. For a cut or a
    /// teleport of the camera. The light of the scene stays as it is; [`GiHistory`](crate::GiHistory) drops that,
    /// too. Default `false`.
    #[serde(skip)]
    pub reset: bool,
}

impl Default for GiCamera {
    fn default() -> Self {
        Self::new()
    }
}

impl GiCamera {
    const fn new() -> Self {
        Self {
            technique: None,
            strength: 1.0,
            resolution: GatherResolution::Quarter,
            history_frames: 64,
            denoise_radius: 1,
            reset: false,
        }
    }

    /// A camera that always uses `technique`.
    pub const fn with_technique(technique: GiTechnique) -> Self {
        Self {
            technique: Some(technique),
            ..Self::new()
        }
    }

    /// The same camera with the resolution of a quality level (a quarter, a quarter, half or full), and with the
    /// default history and filter.
    pub const fn with_quality(self, quality: GiQuality) -> Self {
        let resolution = match quality {
            GiQuality::Low | GiQuality::Medium => GatherResolution::Quarter,
            GiQuality::High => GatherResolution::Half,
            GiQuality::Ultra => GatherResolution::Full,
        };
        let Self {
            history_frames,
            denoise_radius,
            ..
        } = Self::new();
        Self {
            resolution,
            history_frames,
            denoise_radius,
            ..self
        }
    }

    /// The same camera with a gather for each pixel, no accumulation and no filter, as in the papers of the
    /// techniques.
    pub const fn unfiltered(self) -> Self {
        Self {
            resolution: GatherResolution::Full,
            history_frames: 1,
            denoise_radius: 0,
            ..self
        }
    }

    /// The technique that this camera shows: its own or that of the settings, or [`GiTechnique::OFF`] where the
    /// device cannot run it.
    pub fn active_technique(&self, settings: &GiSettings, support: &GiSupport) -> GiTechnique {
        support.in_force(self.technique.unwrap_or(settings.technique))
    }
}

impl Parameters for GiCamera {
    const KIND: ParametersKind = ParametersKind::Camera;

    fn clamp(&mut self, c: &mut Clamp) {
        c.float("strength", &mut self.strength, 0.0, 16.0);
        c.int("history_frames", &mut self.history_frames, 1, 128)
            .unit("frames");
        c.int("denoise_radius", &mut self.denoise_radius, 0, 3)
            .unit("px");
    }

    fn presets() -> Vec<Preset<Self>> {
        let mut presets =
            GiQuality::presets(|camera: &mut Self, quality| *camera = camera.with_quality(quality));
        presets.push(Preset::new(GiQuality::PAPER, |camera: &mut Self| {
            *camera = camera.unfiltered();
        }));
        presets
    }

    /// Each camera keeps its technique: which one that is belongs to the camera, and not to a file.
    fn load(&mut self, saved: Self) {
        *self = Self {
            technique: self.technique,
            reset: self.reset,
            ..saved
        };
    }

    fn saved_entity(world: &World) -> Option<Entity> {
        let primary = world.get_resource::<PrimaryGiCamera>()?.0;
        let is_one = |camera: &Entity| world.get::<Self>(*camera).is_some();
        primary.filter(is_one).or_else(|| {
            // Before the first frame, or while all of them are inactive.
            world
                .try_query_filtered::<Entity, With<Self>>()?
                .iter(world)
                .next()
        })
    }
}

/// The GI camera that counts where only one can: the active one with the lowest `Camera::order`; of several with
/// that order, the one whose entity has the lowest index. `None` if none is active.
///
/// Its sky, its exposure and its position are those of the light that all cameras share: it is the camera of
/// [`GiSky::Camera`](crate::GiSky::Camera) and [`EmissiveUnits::AsSeen`](crate::EmissiveUnits::AsSeen), and the one
/// that volumes follow.
///
/// It is found once a frame, in `PostUpdate` before transforms are propagated. In the render world, it is the
/// camera's entity there.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PrimaryGiCamera(pub Option<Entity>);

impl PrimaryGiCamera {
    /// The primary one of these GI cameras.
    pub fn of<'a>(cameras: impl IntoIterator<Item = (Entity, &'a Camera)>) -> Self {
        let active = cameras.into_iter().filter(|(_, camera)| camera.is_active);
        let first = active.min_by_key(|(entity, camera)| (camera.order, entity.index_u32()));
        Self(first.map(|(entity, _)| entity))
    }
}

fn find_primary(
    cameras: Query<(Entity, &Camera), With<GiCamera>>,
    mut primary: ResMut<PrimaryGiCamera>,
) {
    primary.set_if_neq(PrimaryGiCamera::of(cameras));
}

fn extract_primary(
    main: Extract<Res<PrimaryGiCamera>>,
    entities: Extract<Query<RenderEntity>>,
    mut primary: ResMut<PrimaryGiCamera>,
) {
    let entity = main.0.and_then(|entity| entities.get(entity).ok());
    primary.set_if_neq(PrimaryGiCamera(entity));
}

/// A [`GiCamera`] in the render world.
#[derive(Component, Clone, Debug)]
pub struct ExtractedGiCamera {
    /// The technique that it shows.
    pub(crate) technique: GiTechnique,
    /// Where the gather of this technique looks light up.
    pub(crate) lookup: Lookup,
    /// What the app has set.
    pub(crate) settings: GiCamera,
    /// The camera's own ambient light.
    ambient: Option<AmbientLight>,
}

impl SyncComponent for GiCamera {
    type Target = ExtractedGiCamera;
}

type CameraData<'a> = (
    RenderEntity,
    &'a GiCamera,
    &'a Camera,
    Option<&'a AmbientLight>,
);

fn extract_cameras(
    mut commands: Commands,
    cameras: Extract<Query<CameraData>>,
    settings: Extract<Res<GiSettings>>,
    support: Extract<Res<GiSupport>>,
    techniques: Extract<Res<GiTechniques>>,
) {
    for (entity, gi, camera, ambient) in &cameras {
        let mut entity = commands.entity(entity);
        if camera.is_active {
            let technique = gi.active_technique(&settings, &support);
            let lookup = techniques.get(technique).map(|entry| entry.lookup);
            entity.insert(ExtractedGiCamera {
                technique,
                lookup: lookup.unwrap_or_default(),
                settings: *gi,
                ambient: ambient.cloned(),
            });
        } else {
            entity.remove::<ExtractedGiCamera>();
        }
    }
}

/// What was extracted will be done.
fn clear_resets(
    mut main: ResMut<MainWorld>,
    mut cameras: Local<Option<QueryState<&mut GiCamera>>>,
) {
    let main = &mut **main;
    let cameras = cameras.get_or_insert_with(|| main.query());
    for mut camera in cameras.iter_mut(main) {
        camera.bypass_change_detection().reset = false;
    }
}

/// Registers [`GiCamera`] and what it does to a camera, and finds the [`PrimaryGiCamera`].
///
/// To configure it:
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_gi::{plugins::GiCameraPlugin, prelude::*};
/// # let mut app = App::new();
/// let cameras = GiCameraPlugin { deferred_by_default: false };
/// app.add_plugins((DefaultPlugins, GiPlugins.set(cameras)));
/// ```
pub struct GiCameraPlugin {
    /// Whether opaque `StandardMaterial`s are rendered deferred by default: whether Bevy's
    /// `DefaultOpaqueRendererMethod` is set to deferred. Default `true`. Without it, only materials whose
    /// `opaque_render_method` is `Deferred` receive light per pixel; others are lit as forward-rendered objects.
    pub deferred_by_default: bool,
}

impl Default for GiCameraPlugin {
    fn default() -> Self {
        Self {
            deferred_by_default: true,
        }
    }
}

impl GiCameraPlugin {
    fn set_deferred(app: &mut App) {
        if !app
            .world()
            .contains_resource::<DefaultOpaqueRendererMethod>()
        {
            // `MaterialPlugin` would insert the forward method later on.
            app.insert_resource(DefaultOpaqueRendererMethod::deferred());
        } else {
            app.world_mut()
                .resource_mut::<DefaultOpaqueRendererMethod>()
                .set_to_deferred();
            info!("opaque StandardMaterials are now rendered deferred by default, for GI cameras");
        }
    }
}

impl Plugin for GiCameraPlugin {
    fn build(&self, app: &mut App) {
        if self.deferred_by_default {
            Self::set_deferred(app);
        }
        app.init_resource::<PrimaryGiCamera>()
            .add_plugins(SettingsComponentPlugin::<GiCamera>::default())
            .add_systems(PostUpdate, find_primary.before(TransformSystems::Propagate));
        app.add_observer(turn_msaa_off)
            .add_systems(PostUpdate, warn_about_format);
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.init_resource::<PrimaryGiCamera>().add_systems(
            ExtractSchedule,
            (
                extract_cameras,
                extract_primary,
                clear_resets.after(extract_cameras),
            ),
        );
        render_app.add_systems(
            Render,
            replace_ambient
                .after(RenderSystems::ExtractCommands)
                .before(check_views_need_specialization)
                .run_if(supported),
        );
        // Without a renderer, it would panic where a camera is removed.
        app.add_plugins(SyncComponentPlugin::<GiCamera>::default());
    }
}

/// MSAA cannot be a required component: the default of `Camera` itself would win.
fn turn_msaa_off(add: On<Add, GiCamera>, cameras: Query<&Msaa>, mut commands: Commands) {
    if cameras.get(add.entity).is_ok_and(|msaa| *msaa != Msaa::Off) {
        info_once!(
            "GiCamera turns MSAA off and HDR on: Bevy's deferred renderer knows no MSAA, and \
             indirect light is added in HDR. FXAA, SMAA and TAA work."
        );
    }
    commands.entity(add.entity).insert(Msaa::Off);
}

type ChangedMsaa = (With<GiCamera>, Changed<Msaa>);

/// A camera may get its MSAA back by hand; deferred rendering would then be silently off.
fn warn_about_format(cameras: Query<(Entity, &Msaa), ChangedMsaa>, mut commands: Commands) {
    for (entity, msaa) in &cameras {
        if *msaa != Msaa::Off {
            info!("{entity}: GiCamera needs Msaa::Off, which is now set again");
            commands.entity(entity).insert(Msaa::Off);
        }
    }
}

/// The ambient light that a view has when it shows no GI; `None` is the global one.
#[derive(Component)]
struct ReplacedAmbient(Option<AmbientLight>);

/// Drops the unoccluded ambient terms of cameras that show GI in their place, and gives them back.
///
/// Runs in the render world: the user's components stay as they are.
fn replace_ambient(
    mut commands: Commands,
    settings: Res<GiSettings>,
    views: Query<(Entity, &ExtractedGiCamera)>,
    replaced: Query<(Entity, &ReplacedAmbient)>,
) {
    let replaces =
        |camera: &ExtractedGiCamera| settings.replace_ambient && !camera.technique.is_off();
    for (view, camera) in &views {
        if replaces(camera) {
            commands
                .entity(view)
                .insert((
                    ReplacedAmbient(camera.ambient.clone()),
                    AmbientLight {
                        brightness: 0.0,
                        ..Default::default()
                    },
                ))
                .remove::<bevy::pbr::RenderViewLightProbes<EnvironmentMapLight>>();
        }
    }
    for (view, own) in &replaced {
        if views.get(view).is_ok_and(|(_, camera)| replaces(camera)) {
            continue;
        }
        let mut view = commands.entity(view);
        view.remove::<ReplacedAmbient>();
        match &own.0 {
            Some(ambient) => view.insert(ambient.clone()),
            None => view.remove::<AmbientLight>(),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::{check_presets, check_ranges};

    #[test]
    fn presets_are_in_range_and_survive_ron() {
        check_presets::<GiCamera>();
        check_ranges::<GiCamera>();
        // They keep what is no matter of quality.
        let mut camera = GiCamera {
            strength: 2.0,
            ..GiCamera::with_technique(GiTechnique::OFF)
        };
        for preset in GiCamera::presets() {
            preset.apply(&mut camera);
        }
        assert_eq!(
            camera,
            GiCamera {
                strength: 2.0,
                ..GiCamera::with_technique(GiTechnique::OFF).unfiltered()
            }
        );
    }

    #[test]
    fn the_primary_camera_is_active_and_of_the_lowest_order() {
        let mut world = World::new();
        let mut spawn = |order, is_active| {
            let camera = Camera {
                order,
                is_active,
                ..Default::default()
            };
            world.spawn(camera).id()
        };
        let [_, second, third, _] =
            [(0, false), (1, true), (1, true), (2, true)].map(|(o, a)| spawn(o, a));
        let mut query = world.query::<(Entity, &Camera)>();
        let primary = |world: &World, query: &mut QueryState<(Entity, &Camera)>| {
            PrimaryGiCamera::of(query.iter(world)).0
        };
        // Of equal ones, that with the lower index, in whatever order they are found.
        let lower = if second.index_u32() < third.index_u32() {
            second
        } else {
            third
        };
        assert_eq!(primary(&world, &mut query), Some(lower));
        let reversed: Vec<_> = query.iter(&world).collect();
        let reversed = reversed.into_iter().rev();
        assert_eq!(PrimaryGiCamera::of(reversed).0, Some(lower));
        for camera in [second, third] {
            world.get_mut::<Camera>(camera).unwrap().is_active = false;
        }
        assert_ne!(primary(&world, &mut query), None);
        assert_eq!(PrimaryGiCamera::of([]).0, None);
    }
}
