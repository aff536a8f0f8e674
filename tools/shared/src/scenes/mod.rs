//! Bundled scenes, one module each, and scenes drawn at random ([`random`]). None is made for one technique.

pub mod cellar;
pub mod cornell;
pub mod cornell_area;
pub mod emissive;
pub mod foliage;
pub mod furnace;
pub mod glossy_floor;
pub mod moving_light;
pub mod random;
pub mod sealed;
pub mod sky_court;
pub mod sponza;
pub mod spot_window;
pub mod stage;
pub mod tunnel;
pub mod two_rooms;

use std::{path::Path, sync::OnceLock};

use bevy::prelude::*;
use bevy_gi::GiTechnique;

/// Where a scene is looked at from, and how brightly.
#[derive(Resource, Clone, Copy, Debug)]
pub struct SceneView {
    pub eye: Vec3,
    pub look: Vec3,
    /// Vertical, degrees.
    pub fov: f32,
    pub ev100: f32,
    /// Metres per second of the free camera.
    pub speed: f32,
}

/// A bundled scene.
#[derive(Clone, Copy)]
pub struct Scene {
    /// As on command lines.
    pub name: &'static str,
    /// What it is a test of, in one sentence.
    pub about: &'static str,
    pub content: Content,
    pub view: fn() -> SceneView,
    /// Nits of a sky all around.
    pub sky: Option<[f32; 3]>,
    /// The technique that shows it best, where that is not the default.
    pub technique: Option<GiTechnique>,
    /// Something that moves: puts it where it is at a time of 0..=1.
    pub motion: Option<fn(&mut World, f32)>,
    /// Whether it is part of quick measurements.
    pub quick: bool,
    /// Whether its light is measured over time: how still it is, and how soon it follows its lamps.
    pub watched: bool,
    /// Whether light that passes its wall is measured: see [`sealed`].
    pub leaks: bool,
}

impl Scene {
    /// An empty one, that is only looked at.
    const PLAIN: Self = Self {
        name: "",
        about: "",
        content: Content::Built(|_| {}),
        view: || SceneView {
            eye: Vec3::Z,
            look: Vec3::ZERO,
            fov: 60.0,
            ev100: 4.0,
            speed: 1.0,
        },
        sky: None,
        technique: None,
        motion: None,
        quick: false,
        watched: false,
        leaks: false,
    };
}

/// What a scene is made of.
#[derive(Clone, Copy)]
pub enum Content {
    /// Built in code, with its volume.
    Built(fn(&mut World)),
    /// A glTF file, its path in the asset folder.
    File(&'static str),
}

/// All bundled scenes.
pub const ALL: [Scene; 14] = [
    cornell::SCENE,
    cornell_area::SCENE,
    two_rooms::SCENE,
    tunnel::SCENE,
    sky_court::SCENE,
    emissive::SCENE,
    spot_window::SCENE,
    cellar::SCENE,
    glossy_floor::SCENE,
    foliage::SCENE,
    furnace::SCENE,
    moving_light::SCENE,
    sealed::SCENE,
    sponza::SCENE,
];

/// The bundled scene of that name.
pub fn find(name: &str) -> Option<Scene> {
    ALL.into_iter().find(|scene| scene.name == name)
}

/// Names of all bundled scenes.
pub fn names() -> String {
    ALL.map(|scene| scene.name).join(", ")
}

static ASSET_FOLDER: OnceLock<String> = OnceLock::new();

/// Takes assets from a folder of one's own.
pub fn set_asset_folder(folder: &Path) {
    let _ = ASSET_FOLDER.set(folder.to_string_lossy().into_owned());
}

/// Asset folder of this repository, also when a program is started from elsewhere; or the one that was
/// set.
pub fn asset_folder() -> String {
    if let Some(folder) = ASSET_FOLDER.get() {
        return folder.clone();
    }
    let bundled = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets"));
    // Of a program that was built elsewhere, that of the working directory. Bevy takes a relative one from where the
    // program lies.
    let folder = bundled
        .canonicalize()
        .or_else(|_| Path::new("assets").canonicalize());
    folder.map_or("assets".into(), |folder| {
        folder.to_string_lossy().into_owned()
    })
}
