//! A scene with every technique.

use std::path::Path;

use bevy_gi::GiTechnique;
use bevy_gi_tools::{
    capture,
    options::chosen_techniques,
    quality::{self, Curve, Effort},
    scenes::Scene,
    studio::Studio,
};
use serde::{Deserialize, Serialize};

use crate::{
    Options,
    comparison::{Comparison, adapter, write_exr},
    figure::{Figure, Seen, find},
};

/// What a row of the table is of.
#[derive(Clone)]
pub enum Subject {
    Bundled(Scene),
    /// The path of a glTF file, looked at as the viewer does.
    File(String),
}

impl Subject {
    /// As in tables and in names of files.
    pub fn name(&self) -> String {
        match self {
            Self::Bundled(scene) => scene.name.into(),
            Self::File(path) => {
                let stem = Path::new(path).file_stem().unwrap_or_default();
                let is_plain = |c: char| c.is_alphanumeric() || c == '-' || c == '.';
                let name = stem.to_string_lossy();
                name.replace(|c: char| !is_plain(c), "_")
            }
        }
    }

    pub fn about(&self) -> String {
        match self {
            Self::Bundled(scene) => scene.about.into(),
            Self::File(path) => format!("the file {path}"),
        }
    }

    /// As on the viewer's command line.
    pub fn argument(&self) -> &str {
        match self {
            Self::Bundled(scene) => scene.name,
            Self::File(path) => path,
        }
    }
}

/// Everything that was measured.
pub struct Report {
    pub effort: Effort,
    /// Settings that are not the default ones, as on the command line.
    pub settings: Vec<String>,
    pub scenes: Vec<SceneReport>,
}

#[derive(Serialize, Deserialize)]
pub struct SceneReport {
    pub name: String,
    pub about: String,
    /// Name and driver of the GPU.
    pub adapter: String,
    /// The picture, and its indirect light alone.
    pub truth: [Seen; 2],
    /// Relative RMSE of the truth itself.
    pub noise: f32,
    pub techniques: Vec<TechniqueReport>,
}

#[derive(Serialize, Deserialize)]
pub struct TechniqueReport {
    pub technique: GiTechnique,
    /// The picture, and its indirect light alone.
    pub seen: [Seen; 2],
    pub flip_map: Seen,
    pub heat_map: Option<Seen>,
    /// Relative errors of blocks, without those where there is no truth.
    pub errors: Vec<f32>,
    /// By what is watched.
    pub curves: Vec<(String, Curve)>,
    pub figures: Vec<(Figure, f32)>,
}

impl TechniqueReport {
    pub fn get(&self, figure: Figure) -> Option<f32> {
        find(&self.figures, figure)
    }
}

/// Measures a scene.
pub fn measure(
    subject: &Subject,
    effort: &Effort,
    options: &Options,
) -> Result<SceneReport, String> {
    let name = subject.name();
    let studio = quality::open_named(subject.argument(), effort, &options.settings)?;
    let mut comparison = Comparison::new(studio, effort, &options.cache)?;
    write_exr(&options.out, &name, "reference", &comparison.truth.pictures)?;
    let mut report = SceneReport {
        about: subject.about(),
        adapter: adapter(&mut comparison.studio),
        truth: comparison.seen(),
        noise: comparison.truth.noise(),
        techniques: Vec::new(),
        name,
    };
    let mut without = 0.0;
    let mut techniques = chosen_techniques(comparison.studio.world(), &options.techniques)?;
    techniques.retain(|technique| !technique.is_off());
    // Without light, there is something to compare with.
    techniques.insert(0, GiTechnique::OFF);
    for technique in techniques {
        let studio = &mut comparison.studio;
        quality::choose(studio, technique);
        let pictures = quality::shoot(studio, effort);
        write_exr(&options.out, &report.name, technique.name(), &pictures)?;
        let mut figures = Vec::new();
        let mut curves = Vec::new();
        studio.headless.steps(effort.frames / 2);
        if technique == GiTechnique::OFF {
            without = capture::frame_ms(&studio.headless);
        } else {
            cost(studio, without, &mut figures);
            if let Subject::Bundled(scene) = subject {
                over_time(scene, studio, effort, &mut figures, &mut curves);
                if scene.leaks {
                    let leaks = quality::leaks(technique, effort, &options.settings)?;
                    let leaks = leaks.into_iter().enumerate();
                    figures.extend(leaks.map(|(wall, leak)| (Figure::Leak(wall), leak)));
                }
            }
        }
        let compared = comparison.compare(&pictures);
        figures.extend(compared.figures);
        report.techniques.push(TechniqueReport {
            technique,
            seen: compared.seen,
            flip_map: compared.flip_map,
            heat_map: compared.heat_map,
            errors: compared.errors,
            curves,
            figures,
        });
    }
    Ok(report)
}

fn cost(studio: &Studio, without: f64, figures: &mut Vec<(Figure, f32)>) {
    let ms = capture::gi_ms(&studio.headless, without);
    let stats = capture::statistics(&studio.headless);
    let bytes = stats["memory_total_bytes"].as_f64().unwrap_or(0.0);
    figures.push((Figure::GpuMs, ms as f32));
    figures.push((Figure::MemoryMib, (bytes / 1048576.0) as f32));
}

fn over_time(
    scene: &Scene,
    studio: &mut Studio,
    effort: &Effort,
    figures: &mut Vec<(Figure, f32)>,
    curves: &mut Vec<(String, Curve)>,
) {
    if scene.watched {
        figures.push((Figure::Still, quality::stability(studio, effort)));
        figures.push((Figure::Pan, quality::pan(studio, effort)));
        let [off, on] = quality::reaction(studio, effort);
        figures.push((Figure::ReactionOff, off.frames_to_90_percent() as f32));
        figures.push((Figure::ReactionOn, on.frames_to_90_percent() as f32));
        curves.push(("lamp off".into(), off));
        curves.push(("lamp on".into(), on));
    }
    if let Some(motion) = scene.motion {
        let following = quality::following(studio, motion, effort);
        let settling = following.curve.frames_to_90_percent();
        figures.push((Figure::Lag, following.lag));
        figures.push((Figure::Settling, settling as f32));
        curves.push(("after moving".into(), following.curve));
        studio.settle(effort.frames);
        let at_once = Effort {
            motion_frames: 1,
            ..*effort
        };
        let jump = quality::following(studio, motion, &at_once).curve;
        figures.push((Figure::Jump, jump.frames_to_90_percent() as f32));
        curves.push(("moved at once".into(), jump));
    }
}
