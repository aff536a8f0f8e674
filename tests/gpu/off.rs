//! A camera that shows no global illumination renders as without the plugin, byte for byte.

use bevy::{
    camera::Hdr,
    core_pipeline::{
        prepass::{DeferredPrepass, DepthPrepass, MotionVectorPrepass},
        tonemapping::{DebandDither, Tonemapping},
    },
    pbr::DefaultOpaqueRendererMethod,
    prelude::*,
    render::render_resource::TextureFormat,
};
use bevy_gi::prelude::*;

use crate::{
    common::{
        headless::{Headless, image_target},
        scenes::cornell,
    },
    support::spawn_cornell,
};

/// Renders the Cornell box with a camera made by `spawn`.
fn render(with_plugin: bool, spawn: impl Fn(&mut EntityWorldMut)) -> Vec<u32> {
    let mut headless = Headless::new(|app| {
        if with_plugin {
            app.add_plugins(GiPlugins);
            app.world_mut().resource_mut::<GiSettings>().replace_ambient = true;
        }
    });
    spawn_cornell(&mut headless);
    let target = headless.target(UVec2::new(160, 96), TextureFormat::Rgba32Float);
    let view = cornell::view();
    let mut camera = headless.app.world_mut().spawn((
        Camera3d::default(),
        image_target(&target),
        Tonemapping::None,
        DebandDither::Disabled,
        bevy::camera::Exposure { ev100: view.ev100 },
        Transform::from_translation(view.eye).looking_at(view.look, Vec3::Y),
    ));
    spawn(&mut camera);
    assert!(headless.wait_until(|_| true));
    headless.steps(4);
    let pixels = headless.picture(&target).pixels;
    assert!(pixels.iter().any(|p| p[0] > 0.01), "something is seen");
    pixels.iter().flatten().map(|c| c.to_bits()).collect()
}

#[test]
fn a_camera_without_the_component_is_untouched() {
    let (with, without) = (render(true, |_| {}), render(false, |_| {}));
    let different = with.iter().zip(&without).filter(|(a, b)| a != b).count();
    assert_eq!(different, 0, "values of {} that differ", with.len());
}

/// Ambient light that a camera's own GI stood in for comes back with `GiTechnique::OFF`.
#[test]
fn switching_off_gives_the_ambient_light_back() {
    let [switched, never_on] = [true, false].map(|on_first| {
        let mut headless = Headless::new(|app| {
            app.add_plugins(GiPlugins);
            let mut settings = app.world_mut().resource_mut::<GiSettings>();
            settings.replace_ambient = true;
            if !on_first {
                settings.technique = GiTechnique::OFF;
            }
        });
        spawn_cornell(&mut headless);
        let target = headless.target(UVec2::new(80, 48), TextureFormat::Rgba32Float);
        let view = cornell::view();
        headless.app.world_mut().spawn((
            Camera3d::default(),
            GiCamera::default(),
            image_target(&target),
            Tonemapping::None,
            DebandDither::Disabled,
            bevy::camera::Exposure { ev100: view.ev100 },
            Transform::from_translation(view.eye).looking_at(view.look, Vec3::Y),
        ));
        assert!(headless.wait_until(|_| true));
        let world = headless.app.world_mut();
        world.resource_mut::<GiSettings>().technique = GiTechnique::OFF;
        headless.steps(4);
        headless.picture(&target).pixels
    });
    assert!(switched == never_on);
}

#[test]
fn a_camera_that_is_off_is_untouched() {
    // Without the plugin, a camera of the same making: HDR, deferred, no MSAA.
    let bare = render(false, |camera| {
        camera.insert((
            Hdr,
            DepthPrepass,
            MotionVectorPrepass,
            DeferredPrepass,
            Msaa::Off,
        ));
        camera.world_scope(|world| {
            world.insert_resource(DefaultOpaqueRendererMethod::deferred());
        });
    });
    let off = render(true, |camera| {
        camera.insert(GiCamera::with_technique(GiTechnique::OFF));
    });
    assert!(bare == off);
}
