//! Shaders anew from the crate's sources, while an app runs.

use std::path::{Path, PathBuf};

use bevy::{
    asset::{AssetServer, Assets, io::embedded::EmbeddedAssetRegistry},
    ecs::prelude::*,
    shader::Shader,
};

/// Where the crate was built.
fn sources() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/src"))
}

/// Whether the sources lie there.
pub(super) fn can_reload() -> bool {
    sources().is_dir()
}

/// Reads all shaders of the crate again. Says how many, and which could not be read.
pub(super) fn reload(world: &World) -> String {
    let server = world.resource::<AssetServer>();
    let embedded = world.resource::<EmbeddedAssetRegistry>();
    let (mut count, mut failed) = (0, String::new());
    for (id, _) in world.resource::<Assets<Shader>>().iter() {
        let Some(path) = server.get_path(id) else {
            continue;
        };
        let Ok(file) = path.path().strip_prefix(env!("CARGO_PKG_NAME")) else {
            continue;
        };
        let file: PathBuf = sources().join(file);
        match std::fs::read(&file) {
            Ok(text) => {
                embedded.insert_asset(file, path.path(), text);
                server.reload(path.into_owned());
                count += 1;
            }
            Err(error) => failed += &format!("; {}: {error}", file.display()),
        }
    }
    format!("{count} shaders reloaded{failed}")
}
