//! What the crate's GPU resources occupy, and what it counts, by name.

use std::{
    collections::{BTreeMap, VecDeque},
    ops::Deref,
    sync::{Arc, Mutex, MutexGuard},
};

use bevy::{
    app::{App, Plugin},
    diagnostic::{Diagnostic, DiagnosticMeasurement},
    ecs::prelude::*,
    render::{
        RenderApp,
        render_resource::{Buffer, BufferDescriptor, BufferUsages, Texture, TextureDimension},
        renderer::RenderDevice,
    },
};

/// Bytes and counts by name. The same in both worlds.
///
/// Names of resources are those of their debug labels without the leading `gi/`. What several
/// volumes or cameras have one each of is added up.
#[derive(Resource, Clone, Default, Debug)]
pub struct GiStatistics(Arc<Mutex<Figures>>);

#[derive(Default, Debug)]
struct Figures {
    memory: BTreeMap<&'static str, u64>,
    counts: BTreeMap<&'static str, u64>,
    warnings: VecDeque<String>,
}

/// What a pass took in the last frame in which it ran, and when that was known; milliseconds. Bevy's
/// [`RenderDiagnosticsPlugin`](bevy::render::diagnostic::RenderDiagnosticsPlugin) has a measurement for each time
/// that it ran in a frame, so the last one alone is not all.
pub fn last_frame(diagnostic: &Diagnostic) -> Option<DiagnosticMeasurement> {
    let time = diagnostic.measurement()?.time;
    let measured = diagnostic.measurements();
    let value = measured.filter(|m| m.time == time).map(|m| m.value).sum();
    Some(DiagnosticMeasurement { time, value })
}

/// Most warnings that are remembered.
const WARNINGS: usize = 16;

impl GiStatistics {
    fn lock(&self) -> MutexGuard<'_, Figures> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Bytes of GPU memory by resource.
    pub fn memory(&self) -> BTreeMap<&'static str, u64> {
        self.lock().memory.clone()
    }

    /// Counts, for example of voxels with a surface. They come from the GPU some frames late.
    pub fn counts(&self) -> BTreeMap<&'static str, u64> {
        self.lock().counts.clone()
    }

    /// The latest warnings, oldest first: what was clamped, and what does not fit. All of them were
    /// logged, too.
    pub fn warnings(&self) -> Vec<String> {
        self.lock().warnings.iter().cloned().collect()
    }

    /// Remembers warnings; one that is known already moves to the end.
    pub(crate) fn warn(&self, new: Vec<String>) {
        if new.is_empty() {
            return;
        }
        let warnings = &mut self.lock().warnings;
        for warning in new {
            warnings.retain(|old| *old != warning);
            warnings.push_back(warning);
        }
        let excess = warnings.len().saturating_sub(WARNINGS);
        warnings.drain(..excess);
    }

    /// Forgets all warnings.
    pub fn clear_warnings(&self) {
        self.lock().warnings.clear();
    }

    /// Sets a count, such as that of hints in all volumes.
    pub fn count(&self, name: &'static str, value: u64) {
        self.lock().counts.insert(name, value);
    }

    /// Counts `bytes` for as long as the result lives.
    fn track<T>(&self, name: &'static str, bytes: u64, resource: T) -> Tracked<T> {
        *self.lock().memory.entry(name).or_default() += bytes;
        Tracked {
            resource,
            share: Arc::new(Share {
                statistics: self.clone(),
                name,
                bytes,
            }),
        }
    }

    /// Counts the bytes of a texture, from its format, size and levels, for as long as the result lives. `name` is
    /// that of the resource, such as `"hints/coefficients"`.
    pub fn texture(&self, name: &'static str, texture: Texture) -> Tracked<Texture> {
        let size = texture.size();
        let texel = texture.format().block_copy_size(None).unwrap_or(4) as u64;
        let is_3d = texture.dimension() == TextureDimension::D3;
        let bytes = (0..texture.mip_level_count())
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
        self.track(name, bytes, texture)
    }

    /// Makes a storage buffer of `words` `u32`, labelled `gi/{name}` and zeroed by wgpu. Its bytes count for as long
    /// as the result lives.
    pub fn storage_buffer(
        &self,
        device: &RenderDevice,
        name: &'static str,
        words: u64,
        usage: BufferUsages,
    ) -> Tracked<Buffer> {
        let size = words.max(4) * 4;
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some(&format!("gi/{name}")),
            size,
            usage: usage | BufferUsages::STORAGE | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.track(name, size, buffer)
    }
}

/// A GPU resource whose bytes count in [`GiStatistics`] while it lives.
#[derive(Clone)]
pub struct Tracked<T> {
    resource: T,
    /// Takes its bytes back when the last clone is dropped.
    share: Arc<Share>,
}

impl<T> Tracked<T> {
    /// Something that keeps the resource alive in its place: a view of a texture.
    pub fn map<U>(self, f: impl FnOnce(&T) -> U) -> Tracked<U> {
        Tracked {
            resource: f(&self.resource),
            share: self.share,
        }
    }
}

impl<T> Deref for Tracked<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.resource
    }
}

struct Share {
    statistics: GiStatistics,
    name: &'static str,
    bytes: u64,
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut figures = self.statistics.lock();
        if let Some(bytes) = figures.memory.get_mut(self.name) {
            *bytes = bytes.saturating_sub(self.bytes);
            if *bytes == 0 {
                figures.memory.remove(self.name);
            }
        }
    }
}

pub(crate) struct StatisticsPlugin;

impl Plugin for StatisticsPlugin {
    fn build(&self, app: &mut App) {
        let statistics = GiStatistics::default();
        app.insert_resource(statistics.clone());
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app.insert_resource(statistics);
        }
    }
}
