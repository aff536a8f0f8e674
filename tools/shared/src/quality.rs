//! How well a technique does: its pictures beside the truth, and its light over time.

use std::path::{Path, PathBuf};

use bevy::prelude::*;
use bevy_gi::{prelude::*, reference::ReferenceSettings};
use serde::{Deserialize, Serialize};

use crate::{
    capture,
    figures::{self, Stability, distance},
    headless::Picture,
    open::SceneOptions,
    options::{SettingsOptions, Technique},
    reference,
    scenes::{Scene, sealed},
    studio::{Film, Studio},
};

/// How much is rendered.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub size: UVec2,
    /// Frames before a picture is taken, 1/60 s each.
    pub frames: u32,
    /// Paths a pixel of the truth.
    pub paths: u32,
    /// Frames over which a still picture is watched, and a camera pans.
    pub still_frames: u32,
    /// Frames that something takes to move from one end of its way to the other.
    pub motion_frames: u32,
    /// Frames that are watched after something has changed.
    pub watched_frames: u32,
    /// Voxels along a volume, at most.
    pub resolution: u32,
    /// Steps of a voxel by which a wall is moved, to look for leaks.
    pub phases: u32,
}

impl Effort {
    /// What the tests take.
    pub const QUICK: Self = Self {
        size: UVec2::new(160, 96),
        frames: 40,
        paths: 256,
        still_frames: 24,
        motion_frames: 24,
        watched_frames: 40,
        resolution: 96,
        phases: 2,
    };
    /// What documents state.
    pub const FULL: Self = Self {
        size: UVec2::new(320, 184),
        frames: 80,
        paths: 1024,
        still_frames: 300,
        motion_frames: 60,
        watched_frames: 90,
        resolution: 128,
        phases: 8,
    };
}

/// Opens a bundled scene.
pub fn open(scene: &Scene, effort: &Effort, settings: &SettingsOptions) -> Result<Studio, String> {
    open_named(scene.name, effort, settings)
}

/// Opens what a command line names: a bundled scene, one that is drawn at random, or a glTF file.
pub fn open_named(
    name: &str,
    effort: &Effort,
    settings: &SettingsOptions,
) -> Result<Studio, String> {
    let options = SceneOptions::named(name);
    let mut studio = Studio::open(options, effort.size, Film::Linear, |world| {
        // Nothing here is drawn forward; the light that only that would get takes time.
        world.resource_mut::<GiSettings>().forward_light = false;
        settings.apply(world, Some(Technique::Gi(GiTechnique::OFF)))
    })?;
    let world = studio.world();
    let mut volumes = world.query::<&mut GiVolume>();
    for mut volume in volumes.iter_mut(world) {
        volume.resolution = volume.resolution.min(effort.resolution);
    }
    Ok(studio)
}

/// Shows another technique from the next frame on.
pub fn choose(studio: &mut Studio, technique: GiTechnique) {
    studio.world().resource_mut::<GiSettings>().technique = technique;
}

/// Pictures of a scene, nits.
pub struct Pictures {
    pub full: Picture,
    pub indirect: Picture,
}

/// Pictures of the path tracer.
pub struct Truth {
    pub pictures: Pictures,
    /// Indirect light from the first half of the paths alone. It is as far off the whole as the whole is
    /// off what infinitely many paths would show.
    pub half: Picture,
}

impl Truth {
    /// Relative RMSE of the truth itself, from its noise.
    pub fn noise(&self) -> f32 {
        let half = figures::blocks(&self.half);
        let whole = figures::blocks(&self.pictures.indirect);
        figures::Errors::new(&half, &whole).map_or(0.0, |errors| errors.relative_rmse)
    }
}

/// Where truths are kept.
pub fn cache_folder() -> PathBuf {
    let cache = std::env::var_os("XDG_CACHE_HOME")
        .map(PathBuf::from)
        .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))
        .unwrap_or_else(std::env::temp_dir);
    cache.join("bevy_gi/reference")
}

/// The truth of what a studio's camera sees: from `cache`, or traced.
pub fn truth(studio: &mut Studio, paths: u32, cache: &Path) -> Result<Truth, String> {
    let (camera, size) = (studio.camera, studio.size);
    let settings = *studio.world().resource::<ReferenceSettings>();
    let mut traced = reference::prepare(studio.world(), camera, size, settings)?;
    let folder = cache.join(format!("{:016x}_{paths}", traced.fingerprint()));
    let names = ["full", "indirect", "half"].map(|name| folder.join(name).with_extension("exr"));
    let mut read = names.iter().map(|name| capture::read_exr(name));
    if let (Some(Ok(full)), Some(Ok(indirect)), Some(Ok(half))) =
        (read.next(), read.next(), read.next())
    {
        return Ok(Truth {
            pictures: Pictures { full, indirect },
            half,
        });
    }
    let mut indirect = |paths| {
        if reference::refine(&mut traced, paths) {
            reference::picture(&traced, GiView::Indirect)
        } else {
            Err("interrupted".into())
        }
    };
    let half = indirect(paths / 2)?;
    let indirect = indirect(paths)?;
    let full = reference::picture(&traced, GiView::Full)?;
    for (picture, name) in [&full, &indirect, &half].into_iter().zip(&names) {
        capture::write(picture, name)?;
    }
    Ok(Truth {
        pictures: Pictures { full, indirect },
        half,
    })
}

/// What the technique at hand makes of a scene, once it has settled.
pub fn shoot(studio: &mut Studio, effort: &Effort) -> Pictures {
    studio.show(GiView::Full);
    studio.settle(effort.frames);
    let full = nits(studio);
    let off = studio.world().resource::<GiSettings>().technique == GiTechnique::OFF;
    let indirect = if off {
        // Cameras whose technique is off show their picture, whatever the view.
        full.clone().scaled(0.0)
    } else {
        studio.show(GiView::Indirect);
        studio.headless.steps(2);
        nits(studio)
    };
    Pictures { full, indirect }
}

fn nits(studio: &mut Studio) -> Picture {
    let exposure = studio.exposure;
    studio.picture().scaled(1.0 / exposure)
}

/// Temporal deviation of a settled picture's indirect light, over its mean.
pub fn stability(studio: &mut Studio, effort: &Effort) -> f32 {
    studio.show(GiView::Indirect);
    studio.headless.steps(2);
    let mut stability = Stability::new(studio.size);
    let target = studio.target.clone();
    studio.headless.record(
        &target,
        effort.still_frames,
        |_, _| {},
        |_, picture| {
            stability.add(&picture);
        },
    );
    stability.deviation()
}

/// Degrees by which the camera turns in a frame of a slow pan: 6 degrees a second.
const PAN: f32 = 0.1;

/// Largest change of settled light from one frame to the next, while the camera turns slowly: mean
/// over blocks of 8x8 pixels, over the mean light.
pub fn pan(studio: &mut Studio, effort: &Effort) -> f32 {
    studio.show(GiView::Irradiance);
    studio.headless.steps(2);
    let (target, camera) = (studio.target.clone(), studio.camera);
    let mut last: Option<figures::Blocks> = None;
    let mut largest = 0.0f32;
    let turn = |world: &mut World, _| {
        if let Some(mut transform) = world.get_mut::<Transform>(camera) {
            transform.rotate_y(PAN.to_radians());
        }
    };
    let frames = effort.still_frames.min(120);
    studio.headless.record(&target, frames, turn, |_, picture| {
        let now = figures::blocks(&picture);
        if let Some(last) = &last {
            let (mut change, mut total) = (0.0, 0.0);
            for (a, b) in now.values.iter().zip(&last.values) {
                change += (figures::luminance(a) - figures::luminance(b)).abs();
                total += figures::luminance(b);
            }
            largest = largest.max(change / total.max(1e-12));
        }
        last = Some(now);
    });
    // Back to where it was.
    let world = studio.world();
    if let Some(mut transform) = world.get_mut::<Transform>(camera) {
        transform.rotate_y(-(PAN * frames as f32).to_radians());
    }
    largest
}

/// How far indirect light is off what it comes to, frame by frame.
#[derive(Serialize, Deserialize)]
pub struct Curve {
    /// Distances to the last picture, as a part of the first one's.
    pub distances: Vec<f32>,
}

impl Curve {
    pub fn frames_to_90_percent(&self) -> u32 {
        figures::frames_to_90_percent(&self.distances)
    }
}

/// Watches the indirect light after `change`; `before` is what was seen until then.
fn watch(
    studio: &mut Studio,
    frames: u32,
    before: &Picture,
    change: impl FnOnce(&mut World),
) -> Curve {
    change(studio.world());
    let target = studio.target.clone();
    let mut pictures = Vec::new();
    studio.headless.record(
        &target,
        frames,
        |_, _| {},
        |_, picture| pictures.push(picture),
    );
    let last = pictures.last().expect("pictures are taken").clone();
    let whole = distance(before, &last).max(1e-12);
    let mut distances = vec![1.0];
    distances.extend(pictures.iter().map(|p| distance(p, &last) / whole));
    Curve { distances }
}

/// All of Bevy's lights times a factor.
pub fn dim(world: &mut World, factor: f32) {
    let mut points = world.query::<&mut PointLight>();
    points
        .iter_mut(world)
        .for_each(|mut l| l.intensity *= factor);
    let mut spots = world.query::<&mut SpotLight>();
    spots
        .iter_mut(world)
        .for_each(|mut l| l.intensity *= factor);
    let mut suns = world.query::<&mut DirectionalLight>();
    suns.iter_mut(world)
        .for_each(|mut l| l.illuminance *= factor);
}

/// What follows after all lamps of a settled scene are switched off, and on again.
pub fn reaction(studio: &mut Studio, effort: &Effort) -> [Curve; 2] {
    studio.show(GiView::Indirect);
    studio.headless.steps(2);
    [1e-3, 1e3].map(|factor| {
        let before = studio.picture();
        watch(studio, effort.watched_frames, &before, |world| {
            dim(world, factor)
        })
    })
}

/// How indirect light follows something that moves.
pub struct Following {
    /// Relative RMSE of the last picture of the motion against the settled one of the same place.
    pub lag: f32,
    /// What follows once it stands still.
    pub curve: Curve,
}

/// Moves what moves in a settled scene from its first to its last place, and back in the end.
pub fn following(studio: &mut Studio, motion: fn(&mut World, f32), effort: &Effort) -> Following {
    studio.show(GiView::Indirect);
    studio.headless.steps(2);
    let target = studio.target.clone();
    let mut last = None;
    let frames = effort.motion_frames;
    studio.headless.record(
        &target,
        frames,
        |world, frame| motion(world, (frame + 1) as f32 / frames as f32),
        |_, picture| last = Some(picture),
    );
    let moving = last.expect("pictures are taken");
    let curve = watch(studio, effort.watched_frames, &moving, |_| {});
    let settled = studio.picture();
    motion(studio.world(), 0.0);
    let errors = figures::Errors::new(&figures::blocks(&moving), &figures::blocks(&settled));
    Following {
        lag: errors.map_or(0.0, |errors| errors.relative_rmse),
        curve,
    }
}

/// Thicknesses of walls that light should not pass, voxels.
pub const WALLS: [f32; 3] = [0.2, 1.0, 4.0];

/// Light in a sealed room over that in the lit one beside it, for each of [`WALLS`]: the worst over
/// places of the wall on the grid of voxels.
pub fn leaks(
    technique: GiTechnique,
    effort: &Effort,
    settings: &SettingsOptions,
) -> Result<[f32; 3], String> {
    let scene = sealed::SCENE;
    let mut studio = open(
        &scene,
        &Effort {
            size: UVec2::splat(48),
            ..*effort
        },
        settings,
    )?;
    choose(&mut studio, technique);
    studio.show(GiView::Irradiance);
    Ok(WALLS.map(|voxels| {
        let mut worst = 0.0f32;
        for phase in 0..effort.phases {
            sealed::set_wall(studio.world(), voxels, phase as f32 / effort.phases as f32);
            let light = sealed::EYES.map(|eye| {
                let camera = studio.camera;
                let at = Transform::from_translation(eye).looking_at(Vec3::ZERO, Vec3::Y);
                studio.world().entity_mut(camera).insert(at);
                studio.settle(effort.frames);
                figures::mean(&studio.picture())
            });
            worst = worst.max(light[0] / light[1].max(1e-12));
        }
        worst
    }))
}
