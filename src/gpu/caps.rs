//! What the adapter must offer, and the sentence that says what is missing.

use bevy::{
    app::App,
    ecs::prelude::*,
    log::error,
    render::{
        RenderApp,
        render_resource::{TextureFormat, TextureUsages},
        renderer::{RenderAdapter, RenderDevice},
    },
};

/// Whether global illumination can run here. Inserted into both worlds.
///
/// Where it cannot, cameras render as with [`GiTechnique::Off`](crate::GiTechnique::Off).
#[derive(Resource, Clone, Debug, PartialEq, Eq)]
pub enum GiSupport {
    /// Everything needed is there.
    Supported,
    /// One sentence: what is missing, and how to get it.
    Unsupported(String),
}

impl GiSupport {
    /// Whether everything needed is there.
    pub fn is_supported(&self) -> bool {
        *self == Self::Supported
    }
}

/// Run condition of every pass.
pub(crate) fn supported(support: Option<Res<GiSupport>>) -> bool {
    support.is_some_and(|support| support.is_supported())
}

/// Inspects the adapter. Called once, when there is one.
pub(crate) fn detect(app: &mut App) {
    let support = match app.get_sub_app(RenderApp) {
        None => GiSupport::Unsupported(
            "bevy_gi is off: the app has no renderer (RenderPlugin is missing, or no graphics \
             adapter was found; on Linux install `mesa-vulkan-drivers`)"
                .into(),
        ),
        Some(render_app) => match (
            render_app.world().get_resource::<RenderDevice>(),
            render_app.world().get_resource::<RenderAdapter>(),
        ) {
            (Some(device), Some(adapter)) => match missing(device, adapter) {
                Some(what) => GiSupport::Unsupported(format!(
                    "bevy_gi is off: the adapter '{}' lacks {what}; a newer driver may have it, \
                     and Vulkan, Metal or DX12 rather than OpenGL do",
                    adapter.get_info().name
                )),
                None => GiSupport::Supported,
            },
            _ => GiSupport::Unsupported("bevy_gi is off: there is no graphics device".into()),
        },
    };
    if let GiSupport::Unsupported(why) = &support {
        error!("{why}");
    }
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app.insert_resource(support.clone());
    }
    app.insert_resource(support);
}

/// What the passes need beyond the least that WebGPU guarantees.
fn missing(device: &RenderDevice, adapter: &RenderAdapter) -> Option<&'static str> {
    let downlevel = adapter.get_downlevel_capabilities().flags;
    let can = |flag: &str| downlevel.iter_names().any(|(name, _)| name == flag);
    let limits = device.limits();
    let storage = adapter
        .get_texture_format_features(TextureFormat::Rgba16Float)
        .allowed_usages
        .contains(TextureUsages::STORAGE_BINDING);
    [
        (can("COMPUTE_SHADERS"), "compute shaders"),
        (
            can("FRAGMENT_WRITABLE_STORAGE"),
            "storage buffers that fragment shaders can write",
        ),
        (can("INDIRECT_EXECUTION"), "indirect dispatch"),
        (storage, "Rgba16Float storage textures"),
        (
            limits.max_storage_buffers_per_shader_stage >= 8,
            "8 storage buffers per shader stage",
        ),
        (
            limits.max_storage_textures_per_shader_stage >= 4,
            "4 storage textures per shader stage",
        ),
        (
            limits.max_texture_dimension_3d >= 1024,
            "3D textures of 1024 texels",
        ),
        (
            limits.max_compute_invocations_per_workgroup >= 256,
            "workgroups of 256 threads",
        ),
    ]
    .into_iter()
    .find_map(|(there, what)| (!there).then_some(what))
}
