//! A window.

use bevy::prelude::*;

use crate::scenes::asset_folder;

/// An app with all of Bevy, a window of a size, and assets from wherever they lie.
pub fn app(title: &str, size: UVec2) -> App {
    let mut app = App::new();
    app.add_plugins(
        DefaultPlugins
            .set(AssetPlugin {
                file_path: asset_folder(),
                unapproved_path_mode: bevy::asset::UnapprovedPathMode::Allow,
                ..default()
            })
            .set(WindowPlugin {
                primary_window: Some(Window {
                    title: title.into(),
                    resolution: (size.x, size.y).into(),
                    ..default()
                }),
                ..default()
            }),
    );
    app
}
