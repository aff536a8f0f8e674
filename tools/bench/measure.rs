//! All cases, one after the other.

use std::time::Instant;

use bevy::{
    camera::primitives::Aabb, math::Vec3A, prelude::*, render::renderer::RenderAdapterInfo,
};
use bevy_gi::{GiSettingsRegistry, prelude::*};
use bevy_gi_tools::{
    capture,
    open::SceneOptions,
    options::{SettingsOptions, chosen_techniques},
    quality::dim,
    scenes::{self, Scene},
    studio::{Film, Studio},
};
use wgpu::DeviceType;

use crate::{
    Options,
    sweep::{self, Point},
};

/// Everything that was measured.
#[derive(serde::Serialize)]
pub struct Results {
    pub adapter: String,
    /// Whether the CPU rendered.
    pub software: bool,
    pub frames: u32,
    pub cases: Vec<Case>,
    pub sweep: Vec<Point>,
}

/// A scene with a technique, a preset, a size of the picture and one of the volume.
#[derive(serde::Serialize)]
pub struct Case {
    pub scene: String,
    pub technique: GiTechnique,
    pub preset: String,
    pub size: UVec2,
    pub voxels: u32,
    pub memory_mib: f64,
    pub situations: Vec<Measured>,
}

/// What happens meanwhile.
#[derive(serde::Serialize, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Situation {
    /// Nothing changes.
    Still,
    /// All lights change in every frame.
    Lights,
    /// A mesh moves in every frame, and all lights change.
    Moving,
}

impl Situation {
    pub const ALL: [Self; 3] = [Self::Still, Self::Lights, Self::Moving];

    pub fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Lights => "lights",
            Self::Moving => "moving",
        }
    }
}

#[derive(serde::Serialize)]
pub struct Measured {
    pub situation: Situation,
    /// Milliseconds of a frame: global illumination on the GPU (see `capture::gi_ms`; the sum of its
    /// passes' medians over frames), and what the CPU takes to record it.
    pub gi_ms: f64,
    pub gi_cpu_ms: f64,
    /// A frame without global illumination, by the wall clock.
    pub without_ms: f64,
    /// GPU milliseconds of each pass of ours: medians over the frames in which it ran.
    pub passes: Vec<(String, f64)>,
}

impl Measured {
    /// GPU milliseconds of passes together; `None` if none of them has run.
    pub fn sum(&self, names: &[&str]) -> Option<f64> {
        let passes = self.passes.iter();
        let found = passes.filter(|(name, _)| names.contains(&name.as_str()));
        found.map(|(_, ms)| *ms).reduce(|a, b| a + b)
    }
}

impl Case {
    pub fn get(&self, situation: Situation) -> Option<&Measured> {
        self.situations.iter().find(|m| m.situation == situation)
    }
}

/// What is measured, unless it is said otherwise.
struct Plan {
    presets: &'static [&'static str],
    sizes: &'static [UVec2],
    voxels: &'static [u32],
}

const ALL: Plan = Plan {
    presets: &["low", "medium", "high", "ultra", "paper"],
    sizes: &[
        UVec2::new(1280, 720),
        UVec2::new(1600, 900),
        UVec2::new(1920, 1080),
    ],
    voxels: &[64, 128, 256],
};
const QUICK: Plan = Plan {
    presets: &["low", "medium", "paper"],
    sizes: &[UVec2::new(320, 180)],
    voxels: &[64, 128],
};

fn chosen<T: Clone>(wanted: &[T], default: impl IntoIterator<Item = T>) -> Vec<T> {
    match wanted {
        [] => default.into_iter().collect(),
        some => some.to_vec(),
    }
}

/// Measures everything; `write` gets the results after each scene and size.
pub fn all(
    options: &Options,
    adapter: &RenderAdapterInfo,
    write: impl Fn(&Results) -> Result<(), String>,
) -> Result<Results, String> {
    let mut results = Results {
        adapter: format!("{} ({})", adapter.name, adapter.driver_info),
        software: adapter.device_type == DeviceType::Cpu,
        frames: options.frames,
        cases: Vec::new(),
        sweep: Vec::new(),
    };
    let plan = match options.quick || (results.software && !options.all) {
        true => QUICK,
        false => ALL,
    };
    let default = ["cornell", "sponza"].into_iter().filter_map(scenes::find);
    let scenes = chosen(&options.scenes, default);
    let names = plan.presets.iter().map(|name| (*name).to_owned());
    let presets = chosen(&options.presets, names);
    let sizes = chosen(&options.sizes, plan.sizes.iter().copied());
    let voxels = chosen(&options.voxels, plan.voxels.iter().copied());
    for scene in &scenes {
        for size in &sizes {
            let mut studio = open(scene, *size)?;
            let techniques = chosen_techniques(studio.world(), &options.techniques)?;
            let without = Situation::ALL.map(|s| without(&mut studio, s, options));
            for technique in &techniques {
                for preset in &presets {
                    for voxels in &voxels {
                        let start = Instant::now();
                        let case = measure(
                            &mut studio,
                            scene,
                            *technique,
                            preset,
                            *voxels,
                            without,
                            options,
                        )?;
                        eprintln!(
                            "{:8} {:4} {preset:7} {}x{} {voxels:3} voxels  {:5.1} s",
                            scene.name,
                            technique.name(),
                            size.x,
                            size.y,
                            start.elapsed().as_secs_f32()
                        );
                        results.cases.push(case);
                    }
                }
            }
            write(&results)?;
            // The sweeps of a paper, once a scene.
            if techniques.contains(&sweep::TECHNIQUE) && Some(size) == sizes.first() {
                let software = results.software;
                let sweep = sweep::measure(&mut studio, scene, without, software, options)?;
                results.sweep.extend(sweep);
                write(&results)?;
            }
        }
    }
    Ok(results)
}

fn open(scene: &Scene, size: UVec2) -> Result<Studio, String> {
    let options = SceneOptions::bundled(scene);
    Studio::open(options, size, Film::Encoded, |world| {
        SettingsOptions::default().apply(world, None)
    })
}

/// What a frame takes without global illumination.
fn without(studio: &mut Studio, situation: Situation, options: &Options) -> f64 {
    studio.world().resource_mut::<GiSettings>().technique = GiTechnique::OFF;
    studio.settle(8);
    run(studio, situation, options.frames);
    capture::frame_ms(&studio.headless)
}

#[allow(clippy::too_many_arguments, reason = "what a case is made of")]
fn measure(
    studio: &mut Studio,
    scene: &Scene,
    technique: GiTechnique,
    preset: &str,
    voxels: u32,
    without: [f64; 3],
    options: &Options,
) -> Result<Case, String> {
    apply(studio.world(), technique, preset, voxels)?;
    // New buffers, new pipelines, a first look at the scene, and all bounces of it.
    studio.headless.wait_until(|_| true);
    studio.settle(48);
    let mut situations = Vec::new();
    for (situation, without) in Situation::ALL.into_iter().zip(without) {
        run(studio, situation, options.frames);
        situations.push(read(studio, situation, without));
        // Light has settled before the next one.
        studio.settle(16);
    }
    let stats = capture::statistics(&studio.headless);
    Ok(Case {
        scene: scene.name.into(),
        technique,
        preset: preset.into(),
        size: studio.size,
        voxels,
        memory_mib: stats["memory_total_bytes"].as_f64().unwrap_or(0.0) / 1048576.0,
        situations,
    })
}

/// Technique, preset and volume.
pub fn apply(
    world: &mut World,
    technique: GiTechnique,
    preset: &str,
    voxels: u32,
) -> Result<(), String> {
    world.resource_mut::<GiSettings>().technique = technique;
    let registry = world.resource::<GiSettingsRegistry>().clone();
    if !registry.apply_preset(world, preset) {
        return Err(format!("there is no preset '{preset}'"));
    }
    let mut volumes = world.query::<&mut GiVolume>();
    for mut volume in volumes.iter_mut(world) {
        volume.resolution = voxels;
    }
    Ok(())
}

/// Renders frames of a situation.
pub fn run(studio: &mut Studio, situation: Situation, frames: u32) {
    studio.headless.steps_with(frames, |world, frame| {
        change(world, situation, frame);
    });
}

/// What happens before a frame.
fn change(world: &mut World, situation: Situation, frame: u32) {
    if situation == Situation::Still {
        return;
    }
    // There and back, so that the scene stays what it is.
    dim(world, if frame.is_multiple_of(2) { 1.25 } else { 0.8 });
    if situation == Situation::Moving {
        let Some(mesh) = smallest_caster(world) else {
            return;
        };
        if let Some(mut transform) = world.get_mut::<Transform>(mesh) {
            transform.translation.y += if frame.is_multiple_of(2) { 0.01 } else { -0.01 };
        }
    }
}

/// The smallest mesh that casts: in every run the same one.
fn smallest_caster(world: &mut World) -> Option<Entity> {
    let mut meshes = world
        .query_filtered::<(Entity, &Aabb, &GlobalTransform), (With<Mesh3d>, Without<NotGiCaster>)>(
        );
    let size = |aabb: &Aabb, transform: &GlobalTransform| {
        (aabb.half_extents * Vec3A::from(transform.scale())).length()
    };
    let sizes = meshes
        .iter(world)
        .map(|(entity, aabb, transform)| (entity, size(aabb, transform)));
    let smallest = sizes.min_by(|(_, a), (_, b)| a.total_cmp(b));
    smallest.map(|(entity, _)| entity)
}

pub fn read(studio: &Studio, situation: Situation, without: f64) -> Measured {
    let stats = capture::statistics(&studio.headless);
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or(0.0);
    let ours = stats["passes"].as_object().into_iter().flatten();
    let ours: Vec<_> = ours.filter(|(name, _)| name.starts_with("gi/")).collect();
    Measured {
        situation,
        gi_ms: capture::gi_ms(&studio.headless, without),
        gi_cpu_ms: ours.iter().map(|(_, pass)| number(&pass["cpu_ms"])).sum(),
        without_ms: without,
        passes: ours
            .iter()
            .map(|(name, pass)| ((*name).clone(), number(&pass["gpu_ms_when_run"])))
            .collect(),
    }
}
