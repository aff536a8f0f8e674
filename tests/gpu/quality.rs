//! Every technique against the path tracer, as `cargo xtask quality --quick` measures it.

use bevy_gi::GiTechnique;

use crate::common::{
    figures::{Errors, blocks},
    options::{SettingsOptions, chosen_techniques},
    quality::{self, Effort},
    scenes::{self, Scene},
};

/// Errors of indirect light of each technique but `off`.
fn errors(scene: &Scene, effort: &Effort) -> Vec<(GiTechnique, Errors)> {
    let settings = SettingsOptions::default();
    let mut studio = quality::open(scene, effort, &settings).expect("the scene opens");
    let truth = quality::truth(&mut studio, effort.paths, &quality::cache_folder());
    let truth = truth.expect("the truth can be traced");
    let truth_blocks = blocks(&truth.pictures.indirect);
    let techniques = chosen_techniques(studio.world(), &[]).expect("all are there");
    techniques
        .into_iter()
        .map(|technique| {
            quality::choose(&mut studio, technique);
            let pictures = quality::shoot(&mut studio, effort);
            let errors = Errors::new(&blocks(&pictures.indirect), &truth_blocks);
            (technique, errors.expect("the truth is not black"))
        })
        .collect()
}

/// Light that bounces under a bulb, light of the sky, light of what shines, light that comes through a door or around
/// corners.
#[test]
fn techniques_agree_with_the_truth() {
    let effort = Effort {
        paths: 128,
        // The bounds are of the default.
        resolution: Effort::FULL.resolution,
        ..Effort::QUICK
    };
    // Mean within, relative RMSE below: the project's goals for Cornell. The others have more of what a
    // grid of voxels cannot see: the sky between pillars, mirrors in a floor.
    for (name, mean, rmse) in [
        ("cornell", 0.15, 0.35),
        ("cornell_area", 0.15, 0.35),
        ("sky_court", 0.15, 0.35),
        ("two_rooms", 0.15, 0.35),
        ("tunnel", 0.2, 0.35),
        ("glossy_floor", 0.25, 0.45),
    ] {
        let scene = scenes::find(name).expect("the scene is bundled");
        for (technique, errors) in errors(&scene, &effort) {
            println!(
                "{name}, {}: mean ratio {:.3}, relative RMSE {:.3}, median error {:.3}",
                technique.name(),
                errors.mean_ratio,
                errors.relative_rmse,
                errors.median_error
            );
            assert!(
                (errors.mean_ratio - 1.0).abs() < mean,
                "{name}: {}",
                errors.mean_ratio
            );
            assert!(
                errors.relative_rmse < rmse,
                "{name}: {}",
                errors.relative_rmse
            );
        }
    }
}
