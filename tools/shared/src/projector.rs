//! Pictures as they are seen: exposed, and tone-mapped by Bevy itself.

use bevy::{
    camera::{Hdr, visibility::RenderLayers},
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
    render::render_resource::TextureFormat,
};

use crate::{
    headless::{Headless, Picture, image_target},
    overlay::{self, Overlay, OverlaySettings},
};

/// A camera that sees nothing but a picture.
pub struct Projector {
    overlay: Handle<Overlay>,
    target: Handle<Image>,
}

/// A camera that shows what lies on a layer, tone-mapped.
pub fn camera(target: &Handle<Image>, order: isize, layer: RenderLayers) -> impl Bundle + use<> {
    (
        Camera3d::default(),
        Camera { order, ..default() },
        Hdr,
        Msaa::Off,
        image_target(target),
        Tonemapping::TonyMcMapface,
        DebandDither::Disabled,
        layer,
    )
}

impl Projector {
    /// For pictures of `size` pixels.
    pub fn new(headless: &mut Headless, size: UVec2) -> Self {
        let target = headless.target(size, TextureFormat::Rgba8UnormSrgb);
        let world = headless.app.world_mut();
        let overlay = Overlay {
            settings: OverlaySettings::left(1.0),
            left: default(),
            right: default(),
        };
        let overlay = world.resource_mut::<Assets<Overlay>>().add(overlay);
        // A layer that the scene's camera does not see.
        let layer = RenderLayers::layer(1);
        let bundle = overlay::bundle(&mut world.resource_mut::<Assets<Mesh>>(), overlay.clone());
        world.spawn((bundle, layer.clone()));
        world.spawn(camera(&target, 1, layer));
        Self { overlay, target }
    }

    /// What is seen of luminances, exposed by `exposure`: encoded, 8 bit.
    pub fn picture(&self, headless: &mut Headless, nits: &Picture, exposure: f32) -> Picture {
        let exposed = nits.clone().scaled(exposure);
        let world = headless.app.world_mut();
        let image = overlay::texture(&exposed);
        let image = world.resource_mut::<Assets<Image>>().add(image);
        let mut overlays = world.resource_mut::<Assets<Overlay>>();
        if let Some(mut overlay) = overlays.get_mut(&self.overlay) {
            overlay.left = image.clone();
            overlay.right = image;
        }
        headless.wait_until(|_| true);
        headless.picture(&self.target)
    }
}
