//! Whether there is anything to render with.

use std::panic::{catch_unwind, set_hook, take_hook};

use bevy::{
    render::{
        renderer::{RenderAdapterInfo, initialize_renderer},
        settings::WgpuSettings,
    },
    tasks::block_on,
};

/// Ends the program with one sentence if there is no graphics adapter.
pub fn require() {
    if let Err(error) = find() {
        eprintln!("{error}");
        std::process::exit(1);
    }
}

/// The graphics adapter; one sentence if there is none. Bevy itself panics then, before any plugin runs.
pub fn find() -> Result<RenderAdapterInfo, String> {
    let settings = WgpuSettings::default();
    let Some(backends) = settings.backends else {
        return Err("the environment variable WGPU_BACKEND names no backend of this system".into());
    };
    let hook = take_hook();
    set_hook(Box::new(|_| {}));
    let found = catch_unwind(|| block_on(initialize_renderer(backends, None, &settings)).2);
    set_hook(hook);
    found.map_err(|_| {
        "there is no graphics adapter; on Debian and Ubuntu, `apt-get install mesa-vulkan-drivers` \
         brings one in software"
            .into()
    })
}
