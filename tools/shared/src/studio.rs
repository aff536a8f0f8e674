//! A scene that is loaded and looked at without a window.

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
    render::render_resource::TextureFormat,
};
use bevy_gi::{GiSupport, prelude::*};

use crate::{
    headless::{Headless, Picture, image_target},
    open::{self, OpenPlugin, Opened, SceneOptions},
};

pub struct Studio {
    pub headless: Headless,
    pub camera: Entity,
    pub target: Handle<Image>,
    pub size: UVec2,
    /// Factor from nits to what the target holds.
    pub exposure: f32,
}

/// What the camera's picture is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Film {
    /// Exposed luminances, as numbers.
    Linear,
    /// Exposed luminances, encoded, 8 bit.
    Encoded,
    /// As seen: tone-mapped, encoded, 8 bit.
    Seen,
}

impl Studio {
    /// Opens a scene in an app that `configure` has set up, and waits until everything is loaded.
    pub fn open(
        scene: SceneOptions,
        size: UVec2,
        film: Film,
        configure: impl FnOnce(&mut World) -> Result<(), String>,
    ) -> Result<Self, String> {
        let mut configured = Ok(());
        let mut headless = Headless::new(|app| {
            app.add_plugins(GiPlugins);
            configured = configure(app.world_mut())
                .and_then(|()| OpenPlugin::new(scene))
                .map(|plugin| {
                    app.add_plugins(plugin);
                });
        });
        configured?;
        let world = headless.app.world();
        let technique = world.resource::<GiSettings>().technique;
        if let Some(why) = world.resource::<GiSupport>().technique(technique) {
            eprintln!("{why}");
        }
        let target = headless.target(
            size,
            match film {
                Film::Linear => TextureFormat::Rgba32Float,
                Film::Encoded | Film::Seen => TextureFormat::Rgba8UnormSrgb,
            },
        );
        let camera = headless
            .app
            .world_mut()
            .spawn((
                open::camera(),
                image_target(&target),
                match film {
                    Film::Linear | Film::Encoded => Tonemapping::None,
                    Film::Seen => Tonemapping::TonyMcMapface,
                },
                DebandDither::Disabled,
            ))
            .id();
        let loaded = headless.wait_until(|world| {
            let opened = world.resource::<Opened>();
            opened.ready || opened.error.is_some()
        });
        let world = headless.app.world();
        if let Some(error) = &world.resource::<Opened>().error {
            return Err(error.clone());
        }
        if !loaded {
            return Err("the scene did not finish loading".into());
        }
        if let Some(error) = headless.pipeline_errors().first() {
            return Err(format!("a shader failed: {error}"));
        }
        let exposure = world.get::<Exposure>(camera).copied();
        Ok(Self {
            exposure: exposure.unwrap_or_default().exposure(),
            headless,
            camera,
            target,
            size,
        })
    }

    pub fn world(&mut self) -> &mut World {
        self.headless.app.world_mut()
    }

    /// Shows a view from the next frame on.
    pub fn show(&mut self, view: GiView) {
        self.world().resource_mut::<GiDebugSettings>().view = view;
    }

    /// Starts history afresh and renders so many frames: nothing depends on how long loading took.
    pub fn settle(&mut self, frames: u32) {
        self.world().resource_mut::<GiHistory>().reset();
        self.headless.steps(frames);
    }

    /// What the camera's target shows now.
    pub fn picture(&mut self) -> Picture {
        self.headless.picture(&self.target.clone())
    }
}
