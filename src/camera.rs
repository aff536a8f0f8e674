//! [`GiCamera`]: enables global illumination for a camera.

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
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        sync_component::{SyncComponent, SyncComponentPlugin},
        sync_world::RenderEntity,
        view::Msaa,
    },
};
use serde::{Deserialize, Serialize};

use crate::{
    gpu::caps::{GiSupport, supported},
    settings::{GiSettings, GiTechnique},
};

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
/// cameras. Of meshes with a `VisibilityRange`, those take part that the primary camera would see, which is the
/// active one with the lowest `order`; one level of detail replaces the next in the middle of their margins.
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
#[derive(Component, Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq, Serialize, Deserialize)]
#[require(Camera3d, Hdr, DepthPrepass, MotionVectorPrepass, DeferredPrepass)]
#[serde(default)]
pub struct GiCamera {
    /// Technique of this camera. `None`, the default, follows [`GiSettings::technique`].
    pub technique: Option<GiTechnique>,
}

impl GiCamera {
    /// A camera that always uses `technique`.
    pub const fn with_technique(technique: GiTechnique) -> Self {
        Self {
            technique: Some(technique),
        }
    }

    /// The technique that this camera shows: its own or that of the settings, or [`GiTechnique::OFF`] where the
    /// device cannot run it.
    pub fn active_technique(&self, settings: &GiSettings, support: &GiSupport) -> GiTechnique {
        support.in_force(self.technique.unwrap_or(settings.technique))
    }
}

/// A [`GiCamera`] in the render world.
#[derive(Component, Clone, Debug)]
pub struct ExtractedGiCamera {
    /// The technique that it shows.
    pub(crate) technique: GiTechnique,
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
) {
    for (entity, gi, camera, ambient) in &cameras {
        let mut entity = commands.entity(entity);
        if camera.is_active {
            entity.insert(ExtractedGiCamera {
                technique: gi.active_technique(&settings, &support),
                ambient: ambient.cloned(),
            });
        } else {
            entity.remove::<ExtractedGiCamera>();
        }
    }
}

/// Registers [`GiCamera`] and what it does to a camera.
pub(crate) struct GiCameraPlugin;

impl Plugin for GiCameraPlugin {
    fn build(&self, app: &mut App) {
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
        app.add_observer(turn_msaa_off)
            .add_systems(PostUpdate, warn_about_format);
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.add_systems(ExtractSchedule, extract_cameras);
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
