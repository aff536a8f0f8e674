//! A scene with every technique.

use base64::{Engine, prelude::BASE64_STANDARD};
use bevy::render::renderer::RenderAdapterInfo;
use bevy_gi::GiTechnique;
use bevy_gi_tools::{
    capture,
    figures::{self, Errors},
    headless::Picture,
    options::chosen_techniques,
    projector::Projector,
    quality::{self, Curve, Effort, Pictures, WALLS},
    scenes::Scene,
    studio::Studio,
};
use serde::{Deserialize, Serialize};

use crate::Options;

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

/// A picture as it is seen: a PNG file, in base 64.
#[derive(Serialize, Deserialize)]
pub struct Seen(pub String);

impl From<&Picture> for Seen {
    fn from(picture: &Picture) -> Self {
        Self(BASE64_STANDARD.encode(capture::png(picture)))
    }
}

/// What is measured.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    MeanRatio,
    RelativeRmse,
    MedianError,
    Flip,
    GpuMs,
    MemoryMib,
    Still,
    Pan,
    ReactionOff,
    ReactionOn,
    Lag,
    Settling,
    Jump,
    /// By the wall's index in [`WALLS`].
    Leak(usize),
}

impl Figure {
    /// As in tables.
    pub fn name(self) -> String {
        match self {
            Self::MeanRatio => "mean ratio".into(),
            Self::RelativeRmse => "relative RMSE".into(),
            Self::MedianError => "median error".into(),
            Self::Flip => "FLIP".into(),
            Self::GpuMs => "GI, ms a frame".into(),
            Self::MemoryMib => "GI, MiB".into(),
            Self::Still => "still picture: temporal deviation".into(),
            Self::Pan => "slow pan: largest change a frame".into(),
            Self::ReactionOff => "lamp off: frames to 90 %".into(),
            Self::ReactionOn => "lamp on: frames to 90 %".into(),
            Self::Lag => "moving: relative RMSE to the settled picture".into(),
            Self::Settling => "after moving: frames to 90 %".into(),
            Self::Jump => "moved at once: frames to 90 %".into(),
            Self::Leak(wall) => format!("leak through {} voxels of wall", WALLS[wall]),
        }
    }

    pub fn format(self, value: f32) -> String {
        match self {
            Self::Still | Self::Pan | Self::Leak(_) => format!("{:.2} %", 100.0 * value),
            Self::ReactionOff | Self::ReactionOn | Self::Settling | Self::Jump => {
                format!("{value:.0}")
            }
            Self::GpuMs | Self::MemoryMib => format!("{value:.1}"),
            _ => format!("{value:.3}"),
        }
    }

    /// Whether it belongs into the table of errors, of which each scene is a row.
    pub fn is_of_picture(self) -> bool {
        matches!(
            self,
            Self::MeanRatio
                | Self::RelativeRmse
                | Self::MedianError
                | Self::Flip
                | Self::GpuMs
                | Self::MemoryMib
        )
    }
}

impl TechniqueReport {
    pub fn get(&self, figure: Figure) -> Option<f32> {
        let found = self.figures.iter().find(|(f, _)| *f == figure);
        found.map(|(_, value)| *value)
    }
}

/// Measures a scene.
pub fn measure(scene: &Scene, effort: &Effort, options: &Options) -> Result<SceneReport, String> {
    let exr = |technique: &str, pictures: &Pictures| {
        let folder = options.out.join("exr");
        let path = |view| folder.join(format!("{}_{technique}_{view}.exr", scene.name));
        capture::write(&pictures.full, &path("full"))?;
        capture::write(&pictures.indirect, &path("indirect"))
    };
    let mut studio = quality::open(scene, effort, &options.settings)?;
    let adapter = studio.world().get_resource::<RenderAdapterInfo>();
    let adapter = adapter.map(|info| format!("{} ({})", info.name, info.driver_info));
    let truth = quality::truth(&mut studio, effort.paths, &options.cache)?;
    exr("reference", &truth.pictures)?;
    let projector = Projector::new(&mut studio.headless, effort.size);
    let exposure = studio.exposure;
    let seen = |studio: &mut Studio, pictures: &Pictures| {
        [&pictures.full, &pictures.indirect]
            .map(|picture| projector.picture(&mut studio.headless, picture, exposure))
    };
    let seen_truth = seen(&mut studio, &truth.pictures);
    let mut report = SceneReport {
        name: scene.name.into(),
        about: scene.about.into(),
        adapter: adapter.unwrap_or_default(),
        truth: [0, 1].map(|i| Seen::from(&seen_truth[i])),
        noise: truth.noise(),
        techniques: Vec::new(),
    };
    let blocks = figures::blocks(&truth.pictures.indirect);
    let mut without = 0.0;
    let mut techniques = chosen_techniques(studio.world(), &options.techniques)?;
    techniques.retain(|technique| !technique.is_off());
    // Without light, there is something to compare with.
    techniques.insert(0, GiTechnique::OFF);
    for technique in techniques {
        quality::choose(&mut studio, technique);
        let pictures = quality::shoot(&mut studio, effort);
        exr(technique.name(), &pictures)?;
        let mut figures = Vec::new();
        let mut curves = Vec::new();
        studio.headless.steps(effort.frames / 2);
        if technique == GiTechnique::OFF {
            without = capture::frame_ms(&studio.headless);
        } else {
            cost(&studio, without, &mut figures);
            over_time(scene, &mut studio, effort, &mut figures, &mut curves);
            if scene.leaks {
                let leaks = quality::leaks(technique, effort, &options.settings)?;
                let leaks = leaks.into_iter().enumerate();
                figures.extend(leaks.map(|(wall, leak)| (Figure::Leak(wall), leak)));
            }
        }
        let errors = Errors::new(&figures::blocks(&pictures.indirect), &blocks);
        if let Some(errors) = &errors {
            figures.push((Figure::MeanRatio, errors.mean_ratio));
            figures.push((Figure::RelativeRmse, errors.relative_rmse));
            figures.push((Figure::MedianError, errors.median_error));
        }
        let seen = seen(&mut studio, &pictures);
        let (flip, flip_map) = figures::flip_of(&seen[0], &seen_truth[0]);
        figures.push((Figure::Flip, flip));
        let heat_map = errors.as_ref().map(|e| figures::heat_map(e, blocks.size));
        let relative = errors.map_or(Vec::new(), |errors| errors.relative);
        report.techniques.push(TechniqueReport {
            technique,
            seen: [0, 1].map(|i| Seen::from(&seen[i])),
            flip_map: Seen::from(&flip_map),
            heat_map: heat_map.as_ref().map(Seen::from),
            errors: relative.into_iter().filter(|e| !e.is_nan()).collect(),
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
