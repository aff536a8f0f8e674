//! What the crate's GPU resources occupy, by name.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

use bevy::{
    app::{App, Plugin},
    ecs::prelude::*,
    render::{
        RenderApp,
        render_resource::{Buffer, BufferDescriptor, BufferUsages, Texture},
        renderer::RenderDevice,
    },
};

/// Bytes by resource name. The same in both worlds.
///
/// Names are those of the resource's debug label without the leading `gi/`. Resources that several
/// volumes or cameras have one each of share a name; the last one made counts.
#[derive(Resource, Clone, Default, Debug)]
pub struct GpuMemory(Arc<Mutex<BTreeMap<String, u64>>>);

impl GpuMemory {
    /// Notes the size of a buffer.
    pub(crate) fn bytes(&mut self, name: &str, bytes: u64) {
        self.0
            .lock()
            .unwrap_or_else(|e| e.into_inner())
            .insert(name.into(), bytes);
    }

    /// Notes the size of a texture, from its format, size and levels.
    pub(crate) fn texture(&mut self, name: &str, texture: &Texture) {
        let size = texture.size();
        let texel = texture.format().block_copy_size(None).unwrap_or(4) as u64;
        let is_3d = texture.dimension() == bevy::render::render_resource::TextureDimension::D3;
        let bytes: u64 = (0..texture.mip_level_count())
            .map(|level| {
                let side = |n: u32| u64::from((n >> level).max(1));
                let depth = if is_3d {
                    side(size.depth_or_array_layers)
                } else {
                    u64::from(size.depth_or_array_layers)
                };
                side(size.width) * side(size.height) * depth * texel
            })
            .sum();
        self.bytes(name, bytes);
    }

    /// Makes a storage buffer named `gi/{name}`, zeroed by wgpu, and notes its size.
    pub(crate) fn storage_buffer(
        &mut self,
        device: &RenderDevice,
        name: &str,
        words: u64,
        usage: BufferUsages,
    ) -> Buffer {
        let size = words.max(4) * 4;
        self.bytes(name, size);
        device.create_buffer(&BufferDescriptor {
            label: Some(&format!("gi/{name}")),
            size,
            usage: usage | BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// All resources with their bytes.
    pub fn snapshot(&self) -> BTreeMap<String, u64> {
        self.0.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }
}

pub(crate) struct MemoryPlugin;

impl Plugin for MemoryPlugin {
    fn build(&self, app: &mut App) {
        let memory = GpuMemory::default();
        app.insert_resource(memory.clone());
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.insert_resource(memory);
        }
    }
}
