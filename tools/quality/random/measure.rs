//! A random scene with every technique and preset: lit, as a furnace, and sealed.

use std::collections::BTreeSet;

use bevy::prelude::World;
use bevy_gi::{
    GiSettingsRegistry, GiTechnique, GiView, SettingsEntry,
    inspector::{from_ron, to_ron},
};
use bevy_gi_tools::{
    figures::{self, Errors},
    headless::Picture,
    options::chosen_techniques,
    quality::{self, Effort, Pictures, Truth},
    scenes::random::{FURNACE_NITS, Plan, RandomScene, Variant},
    studio::Studio,
};

use super::{Case, CaseReport, DEFAULT, RandomSceneReport};
use crate::{
    Options,
    comparison::{Comparison, adapter},
    figure::Figure,
};

/// Measures a scene.
pub fn measure(
    scene: RandomScene,
    effort: &Effort,
    options: &Options,
) -> Result<RandomSceneReport, String> {
    let plan = Plan::new(scene);
    let mut report = lit(&plan, effort, options)?;
    furnace(&mut report, scene, effort, options)?;
    if plan.has_roof {
        sealed(&mut report, &plan, effort, options)?;
    }
    Ok(report)
}

fn open(scene: RandomScene, effort: &Effort, options: &Options) -> Result<Studio, String> {
    quality::open_named(&scene.to_string(), effort, &options.settings)
}

/// The scene as it was drawn, against the path tracer.
fn lit(plan: &Plan, effort: &Effort, options: &Options) -> Result<RandomSceneReport, String> {
    let studio = open(plan.scene, effort, options)?;
    let mut comparison = Comparison::new(studio, effort, &options.cache)?;
    let settings = Defaults::of(comparison.studio.world())?;
    let mut cases = cases(comparison.studio.world(), options)?;
    let off = Case {
        technique: GiTechnique::OFF,
        preset: None,
    };
    // Without light, there is something to compare with.
    cases.insert(0, off);
    let [truth, _] = comparison.seen();
    let mut report = RandomSceneReport {
        name: plan.scene.to_string(),
        kind: plan.scene.kind.name().into(),
        about: plan.about.clone(),
        adapter: adapter(&mut comparison.studio),
        truth,
        noise: comparison.truth.noise(),
        cases: Vec::new(),
    };
    for case in cases {
        settings.choose(&mut comparison.studio, &case)?;
        let mut pictures = quality::shoot(&mut comparison.studio, effort);
        if plan.has_rect_light() {
            pictures.full = with_direct_light_of(&comparison.truth, &pictures);
        }
        let compared = comparison.compare(&pictures);
        let [seen, _] = compared.seen;
        report.cases.push(CaseReport {
            case,
            seen,
            figures: compared.figures,
        });
    }
    Ok(report)
}

/// The path tracer's direct light with a technique's indirect light: where Bevy draws a light otherwise, see
/// [`Plan::has_rect_light`], that is no error of the technique.
fn with_direct_light_of(truth: &Truth, pictures: &Pictures) -> Picture {
    let Pictures { full, indirect } = &truth.pictures;
    let direct = full.clone().combined(indirect, |full, part| full - part);
    direct.combined(&pictures.indirect, |direct, indirect| direct + indirect)
}

/// The same geometry as a furnace: nothing need be traced.
fn furnace(
    report: &mut RandomSceneReport,
    scene: RandomScene,
    effort: &Effort,
    options: &Options,
) -> Result<(), String> {
    let mut studio = open(scene.variant(Variant::Furnace), effort, options)?;
    let settings = Defaults::of(studio.world())?;
    let mut wanted = None;
    for case in &mut report.cases {
        settings.choose(&mut studio, &case.case)?;
        let pictures = quality::shoot(&mut studio, effort);
        if case.case.technique.is_off() {
            // The first: what it lacks is what must be reflected.
            wanted = Some(reflected(&pictures));
            continue;
        }
        let ours = figures::blocks(&pictures.indirect);
        let errors = wanted
            .as_ref()
            .and_then(|wanted| Errors::new(&ours, wanted));
        if let Some(errors) = errors {
            let relative = errors.relative.iter().filter(|error| !error.is_nan());
            let worst = relative.fold(0.0f32, |worst, error| worst.max(error.abs()));
            case.figures.push((Figure::FurnaceMean, errors.mean_ratio));
            case.figures.push((Figure::FurnaceWorst, worst));
        }
    }
    Ok(())
}

/// Light that the surfaces of a furnace must reflect, from its picture without global illumination; black in blocks
/// that they do not cover, since the sky reflects nothing.
fn reflected(off: &Pictures) -> figures::Blocks {
    let missing = off
        .full
        .clone()
        .combined(&off.full, |emitted, _| FURNACE_NITS - emitted);
    let mut blocks = figures::blocks(&missing);
    for block in &mut blocks.values {
        // Half of the light is emitted; what shows some sky has less to miss.
        if figures::luminance(block) < 0.45 * FURNACE_NITS {
            *block = [0.0; 3];
        }
    }
    blocks
}

/// The same geometry with all openings closed and all lamps off, on a bright day: all that is seen has leaked.
fn sealed(
    report: &mut RandomSceneReport,
    plan: &Plan,
    effort: &Effort,
    options: &Options,
) -> Result<(), String> {
    let mut studio = open(plan.scene.variant(Variant::Sealed), effort, options)?;
    let settings = Defaults::of(studio.world())?;
    for case in &mut report.cases {
        if case.case.technique.is_off() {
            continue;
        }
        settings.choose(&mut studio, &case.case)?;
        studio.show(GiView::Indirect);
        studio.settle(effort.frames);
        let nits = figures::mean(&studio.picture()) / studio.exposure;
        case.figures
            .push((Figure::Leakage, nits / plan.outside_nits.max(1e-6)));
    }
    Ok(())
}

/// The settings before any preset.
struct Defaults(String);

impl Defaults {
    fn of(world: &World) -> Result<Self, String> {
        to_ron(world).map(Self)
    }

    /// Chooses a technique, and a preset or none.
    fn choose(&self, studio: &mut Studio, case: &Case) -> Result<(), String> {
        from_ron(studio.world(), &self.0)?;
        quality::choose(studio, case.technique);
        let Some(preset) = &case.preset else {
            return Ok(());
        };
        let world = studio.world();
        let registry = world.resource::<GiSettingsRegistry>().clone();
        match registry.apply_preset(world, preset) {
            true => Ok(()),
            false => Err(format!("{} has no preset '{preset}'", case.technique)),
        }
    }
}

/// Every technique that is asked for, with every preset of it that is asked for.
fn cases(world: &World, options: &Options) -> Result<Vec<Case>, String> {
    let registry = world.resource::<GiSettingsRegistry>();
    let mut cases = Vec::new();
    for technique in chosen_techniques(world, &options.techniques)? {
        if technique.is_off() {
            continue;
        }
        let known: BTreeSet<&str> = registry
            .active(technique)
            .flat_map(SettingsEntry::presets)
            .collect();
        let mut named: Vec<&str> = options.presets.iter().map(String::as_str).collect();
        if named.is_empty() {
            named.push(DEFAULT);
        }
        if named.contains(&ALL) {
            named = known.iter().copied().collect();
        }
        for name in named {
            if name != DEFAULT && !known.contains(name) {
                let known: Vec<_> = known.into_iter().collect();
                return Err(format!(
                    "--presets {name}: {technique} has no such preset; there are: {DEFAULT}, {ALL}, {}",
                    known.join(", ")
                ));
            }
            cases.push(Case {
                technique,
                preset: (name != DEFAULT).then(|| name.into()),
            });
        }
    }
    Ok(cases)
}

/// Every preset.
const ALL: &str = "all";
