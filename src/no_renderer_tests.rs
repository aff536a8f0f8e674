//! Apps without a renderer.

use bevy::{
    DefaultPlugins,
    app::{App, PluginGroup, PluginsState},
    asset::Assets,
    log::LogPlugin,
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
    shader::Shader,
    winit::WinitPlugin,
};

use crate::plugins::GiPlugins;

/// All of Bevy and of this crate, without a renderer and a window.
pub(crate) fn add_plugins(app: &mut App) {
    app.add_plugins((
        DefaultPlugins
            .set(RenderPlugin {
                render_creation: RenderCreation::Automatic(Box::new(WgpuSettings {
                    backends: None,
                    ..Default::default()
                })),
                ..Default::default()
            })
            .disable::<WinitPlugin>()
            .disable::<LogPlugin>(),
        GiPlugins,
    ));
}

/// All plugins are ready.
pub(crate) fn finish(app: &mut App) {
    while app.plugins_state() == PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
}

/// Such an app, with all shaders loaded.
pub(crate) fn app() -> App {
    let mut app = App::new();
    add_plugins(&mut app);
    finish(&mut app);
    // Other threads load them, and nobody waits.
    let (mut calm, mut before) = (0, 0);
    while calm < 100 {
        app.update();
        let shaders = app.world().resource::<Assets<Shader>>().len();
        calm = if shaders == before { calm + 1 } else { 0 };
        before = shaders;
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    app
}

/// Without a renderer the plugin says so, and the app goes on.
#[test]
fn an_app_without_a_renderer_goes_on() {
    let mut app = app();
    let support = app.world().resource::<crate::GiSupport>();
    let why = support.reason().expect("there is no renderer");
    assert!(
        why.contains("bevy_gi is off") && why.contains("mesa-vulkan-drivers"),
        "{why}"
    );
    let world = app.world_mut();
    world.spawn((
        bevy::camera::Camera3d::default(),
        crate::GiCamera::default(),
    ));
    world.spawn(crate::GiVolume::default());
    for _ in 0..3 {
        app.update();
    }
}
