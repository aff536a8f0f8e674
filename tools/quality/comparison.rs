//! A scene that is open, beside its truth.

use std::path::Path;

use bevy::render::renderer::RenderAdapterInfo;
use bevy_gi_tools::{
    capture,
    figures::{self, Blocks, Errors},
    headless::Picture,
    projector::Projector,
    quality::{self, Effort, Pictures, Truth},
    studio::Studio,
};

use crate::figure::{Figure, Seen};

/// A studio, and what the path tracer makes of its picture.
pub struct Comparison {
    pub studio: Studio,
    pub truth: Truth,
    /// The truth as it is seen: the picture, and its indirect light alone.
    seen_truth: [Picture; 2],
    projector: Projector,
    blocks: Blocks,
}

/// What a technique's pictures are beside the truth.
pub struct Compared {
    /// The picture, and its indirect light alone.
    pub seen: [Seen; 2],
    pub flip_map: Seen,
    pub heat_map: Option<Seen>,
    /// Relative errors of blocks, without those where there is no truth.
    pub errors: Vec<f32>,
    /// Errors of indirect light, and FLIP.
    pub figures: Vec<(Figure, f32)>,
}

impl Comparison {
    pub fn new(mut studio: Studio, effort: &Effort, cache: &Path) -> Result<Self, String> {
        let truth = quality::truth(&mut studio, effort.paths, cache)?;
        let projector = Projector::new(&mut studio.headless, effort.size);
        let seen_truth = see(&projector, &mut studio, &truth.pictures);
        Ok(Self {
            blocks: figures::blocks(&truth.pictures.indirect),
            studio,
            truth,
            seen_truth,
            projector,
        })
    }

    /// The truth as it is seen, as files.
    pub fn seen(&self) -> [Seen; 2] {
        self.seen_truth.each_ref().map(Seen::from)
    }

    /// Compares pictures of the same camera.
    pub fn compare(&mut self, pictures: &Pictures) -> Compared {
        let seen = see(&self.projector, &mut self.studio, pictures);
        let errors = Errors::new(&figures::blocks(&pictures.indirect), &self.blocks);
        let mut figures = Vec::new();
        if let Some(errors) = &errors {
            figures.push((Figure::MeanRatio, errors.mean_ratio));
            figures.push((Figure::RelativeRmse, errors.relative_rmse));
            figures.push((Figure::MedianError, errors.median_error));
        }
        let (flip, flip_map) = figures::flip_of(&seen[0], &self.seen_truth[0]);
        figures.push((Figure::Flip, flip));
        let heat_map = errors
            .as_ref()
            .map(|errors| figures::heat_map(errors, self.blocks.size));
        let relative = errors.map_or(Vec::new(), |errors| errors.relative);
        Compared {
            seen: seen.each_ref().map(Seen::from),
            flip_map: Seen::from(&flip_map),
            heat_map: heat_map.as_ref().map(Seen::from),
            errors: relative.into_iter().filter(|e| !e.is_nan()).collect(),
            figures,
        }
    }
}

/// The picture and its indirect light, as they are seen.
fn see(projector: &Projector, studio: &mut Studio, pictures: &Pictures) -> [Picture; 2] {
    let exposure = studio.exposure;
    [&pictures.full, &pictures.indirect]
        .map(|picture| projector.picture(&mut studio.headless, picture, exposure))
}

/// Name and driver of the GPU that a studio renders on.
pub fn adapter(studio: &mut Studio) -> String {
    let info = studio.world().get_resource::<RenderAdapterInfo>();
    info.map_or(String::new(), |info| {
        format!("{} ({})", info.name, info.driver_info)
    })
}

/// Writes luminances into the folder of EXR files.
pub fn write_exr(
    out: &Path,
    name: &str,
    technique: &str,
    pictures: &Pictures,
) -> Result<(), String> {
    let folder = out.join("exr");
    let path = |view| folder.join(format!("{name}_{technique}_{view}.exr"));
    capture::write(&pictures.full, &path("full"))?;
    capture::write(&pictures.indirect, &path("indirect"))
}
