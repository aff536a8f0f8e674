//! Cameras that draw over a GI camera, such as a `Camera2d` for the user interface: the picture below them stays.
//!
//! Cameras with one target draw into one texture of Bevy's only if they agree in format and MSAA. [`GiCamera`] brings
//! HDR and no MSAA; a plain `Camera2d` has neither, so that Bevy gives it a texture of its own, which nobody clears,
//! and then writes all of that over what the GI camera has shown. Here such a camera is a layer instead: its texture
//! starts out transparent in each frame, and is blended over the target. That is changed in the render world alone;
//! what the app has chosen stays as it is.
//!
//! [`GiCamera`]: crate::GiCamera

use bevy::{
    app::{App, Plugin},
    camera::{
        CameraMainTextureUsages, CameraOutputMode, ClearColorConfig, MsaaWriteback,
        NormalizedRenderTarget,
    },
    color::Color,
    ecs::prelude::*,
    log::info,
    platform::collections::HashMap,
    render::{
        Render, RenderApp, RenderSystems,
        camera::{ExtractedCamera, SortedCameras, sort_cameras},
        render_resource::{BlendState, TextureFormat, TextureUsages},
        sync_world::MainEntity,
        view::{ExtractedView, Msaa},
    },
};

use crate::camera::ExtractedGiCamera;

/// Keeps the picture of a GI camera below cameras that draw over it, whatever their format. Without it, all cameras
/// of a target need the same `Hdr` and `Msaa`.
#[derive(Default)]
pub struct OverlayPlugin;

impl Plugin for OverlayPlugin {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.add_systems(
            Render,
            keep_picture_below
                .in_set(RenderSystems::CreateViews)
                .after(sort_cameras),
        );
    }
}

/// What decides, with the target, which cameras draw into one texture (`bevy_render::view::MainTextureKey`).
type TextureKey = (TextureUsages, TextureFormat, Msaa);

type TargetCamera = (
    &'static mut ExtractedCamera,
    &'static ExtractedView,
    &'static CameraMainTextureUsages,
    &'static Msaa,
    &'static MainEntity,
    Has<ExtractedGiCamera>,
);

/// Turns cameras that would hide what a GI camera's target shows into layers over it.
fn keep_picture_below(
    sorted: Res<SortedCameras>,
    mut cameras: Query<TargetCamera>,
    mut told: Local<bool>,
) {
    let with_gi: Vec<_> = sorted
        .0
        .iter()
        .filter(|camera| cameras.get(camera.entity).is_ok_and(|(.., gi)| gi))
        .filter_map(|camera| camera.target.clone())
        .collect();
    // The texture that holds all that a target shows so far; none does any more once there is a layer over it.
    let mut shown: HashMap<&NormalizedRenderTarget, Option<TextureKey>> = HashMap::default();
    let mut layers = Vec::new();
    for camera in &sorted.0 {
        let Some(target) = camera.target.as_ref().filter(|t| with_gi.contains(t)) else {
            continue;
        };
        let Ok((mut camera, view, usages, msaa, main, _)) = cameras.get_mut(camera.entity) else {
            continue;
        };
        let own = (usages.0, view.target_format, *msaa);
        let hides = |below: &Option<TextureKey>| *below != Some(own);
        let draws_over = matches!(camera.clear_color, ClearColorConfig::None);
        if draws_over && shown.get(target).is_some_and(hides) {
            make_layer(&mut camera);
            shown.insert(target, None);
            layers.push(main.id());
        } else {
            shown.insert(target, Some(own));
        }
    }
    if !layers.is_empty() && !*told {
        *told = true;
        info!(
            "{layers:?}: these cameras draw over a GiCamera and differ from it in HDR or MSAA: they are blended over \
             its picture from a texture of their own. With `Hdr` and `Msaa::Off` they share its texture, which costs \
             less."
        );
    }
}

fn make_layer(camera: &mut ExtractedCamera) {
    camera.clear_color = ClearColorConfig::Custom(Color::NONE);
    // It would bring back what the layer held in the last frame.
    camera.msaa_writeback = MsaaWriteback::Off;
    if let CameraOutputMode::Write { blend_state, .. } = &mut camera.output_mode {
        // What is blended onto transparent black is multiplied by its alpha.
        blend_state.get_or_insert(BlendState::PREMULTIPLIED_ALPHA_BLENDING);
    }
}
