//! [`Reference`]: a picture that is traced on all cores.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use bevy::math::{UVec2, Vec3};
use rayon::prelude::*;

use super::{
    film::{Film, ReferenceView},
    fingerprint,
    integrator::{self, ReferenceCamera},
    sampler::Sampler,
    scene::ReferenceScene,
    settings::ReferenceSettings,
};

/// A progressively refined picture.
pub struct Reference {
    scene: Arc<ReferenceScene>,
    settings: ReferenceSettings,
    camera: ReferenceCamera,
    film: Film,
}

impl Reference {
    /// An empty picture of `size` pixels.
    pub fn new(
        scene: Arc<ReferenceScene>,
        camera: ReferenceCamera,
        size: UVec2,
        settings: ReferenceSettings,
    ) -> Self {
        Self {
            scene,
            settings,
            camera,
            film: Film::new(size),
        }
    }

    /// Size in pixels.
    pub fn size(&self) -> UVec2 {
        self.film.size
    }

    /// The camera.
    pub fn camera(&self) -> ReferenceCamera {
        self.camera
    }

    /// A number that identifies everything on which the picture depends but its number of samples: the scene,
    /// the camera, the size, the settings, and the path tracer itself.
    pub fn fingerprint(&self) -> u64 {
        fingerprint::of(&(&*self.scene, self.camera, self.film.size, self.settings))
    }

    /// Minimum number of paths per pixel so far.
    pub fn samples(&self) -> u32 {
        self.film.pixels.iter().map(|p| p.count).min().unwrap_or(0)
    }

    /// Traces on all cores until each pixel has `samples` more paths than the current minimum. Returns soon
    /// after `stop` is set, and keeps the paths traced so far. Calls `progress` after each row.
    pub fn render(&mut self, samples: u32, stop: &AtomicBool, progress: impl Fn() + Sync) {
        let target = self.samples() + samples;
        let width = self.film.size.x.max(1);
        let Self {
            scene,
            settings,
            camera,
            film,
        } = self;
        let size = film.size;
        film.pixels
            .par_chunks_mut(width as usize)
            .enumerate()
            .for_each(|(y, row)| {
                for (x, pixel) in row.iter_mut().enumerate() {
                    if stop.load(Ordering::Relaxed) {
                        return;
                    }
                    let at = UVec2::new(x as u32, y as u32);
                    while pixel.count < target {
                        let mut sampler =
                            Sampler::new(at.y * width + at.x, pixel.count, settings.seed);
                        let sample =
                            integrator::trace(scene, settings, camera, size, at, &mut sampler);
                        pixel.add(&sample);
                    }
                }
                progress();
            });
    }

    /// The picture so far, row by row from the top.
    pub fn picture(&self, view: ReferenceView) -> Vec<Vec3> {
        self.film.picture(view)
    }
}
