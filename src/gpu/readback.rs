//! A few words from the GPU, some frames late. Nothing waits for them.

use std::sync::{
    Arc, Mutex,
    atomic::{AtomicBool, Ordering},
};

use bevy::render::{
    render_resource::{Buffer, BufferDescriptor, BufferUsages, CommandEncoder, MapMode},
    renderer::RenderDevice,
};

/// Reads the start of a buffer back, one copy at a time.
pub(crate) struct Readback {
    staging: Buffer,
    state: Arc<Mutex<State>>,
    /// Whether a copy was asked for while another was under way.
    owed: AtomicBool,
}

#[derive(Default)]
enum State {
    #[default]
    Idle,
    /// The copy is recorded, and must be submitted before it is mapped.
    Copied,
    Mapping,
    Mapped,
}

impl Readback {
    pub fn new(device: &RenderDevice, words: u32) -> Self {
        Self {
            staging: device.create_buffer(&BufferDescriptor {
                label: Some("gi/readback"),
                size: u64::from(words) * 4,
                usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
            state: Default::default(),
            owed: AtomicBool::new(false),
        }
    }

    /// Records a copy; while one is under way, it is [owed](Self::is_owed) instead.
    pub fn copy(&self, encoder: &mut CommandEncoder, source: &Buffer) {
        let mut state = self.lock();
        let idle = matches!(*state, State::Idle);
        if idle {
            encoder.copy_buffer_to_buffer(source, 0, &self.staging, 0, self.staging.size());
            *state = State::Copied;
        }
        self.owed.store(!idle, Ordering::Relaxed);
    }

    /// Whether what was copied last is older than what should have been.
    pub fn is_owed(&self) -> bool {
        self.owed.load(Ordering::Relaxed)
    }

    /// Once a frame, after submission: what has arrived.
    pub fn poll(&self) -> Option<Vec<u32>> {
        let mut state = self.lock();
        match *state {
            State::Copied => {
                *state = State::Mapping;
                let shared = self.state.clone();
                self.staging
                    .slice(..)
                    .map_async(MapMode::Read, move |result| {
                        let mut state = shared.lock().unwrap_or_else(|e| e.into_inner());
                        *state = match result {
                            Ok(()) => State::Mapped,
                            Err(_) => State::Idle,
                        };
                    });
                None
            }
            State::Mapped => {
                let words = {
                    let bytes = self.staging.slice(..).get_mapped_range();
                    bytemuck::pod_collect_to_vec(&bytes)
                };
                self.staging.unmap();
                *state = State::Idle;
                Some(words)
            }
            State::Idle | State::Mapping => None,
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }
}
