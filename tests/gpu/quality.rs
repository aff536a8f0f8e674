//! Every technique against the path tracer, as `cargo xtask quality --quick` measures it.

use bevy_gi::{GiQuality, GiSettingsRegistry, GiTechnique};

use crate::{
    common::{
        figures::{Errors, blocks},
        options::{SettingsOptions, chosen_techniques},
        quality::{self, Effort},
        scenes,
        studio::Studio,
    },
    support::{CONES, HINTS},
};

const EFFORT: Effort = Effort {
    paths: 128,
    ..Effort::QUICK
};

fn errors(studio: &mut Studio, effort: &Effort, truth: &quality::Truth) -> Errors {
    let pictures = quality::shoot(studio, effort);
    let errors = Errors::new(
        &blocks(&pictures.indirect),
        &blocks(&truth.pictures.indirect),
    );
    errors.expect("the truth is not black")
}

/// How far a technique may be off in a scene.
struct Bound {
    technique: GiTechnique,
    /// The mean of indirect light over the truth's.
    mean: [f32; 2],
    /// Relative RMSE of means over 8x8 pixels.
    rmse: f32,
}

const fn bound(technique: GiTechnique, mean: [f32; 2], rmse: f32) -> Bound {
    Bound {
        technique,
        mean,
        rmse,
    }
}

/// Light of what shines, light of the sky, light that comes through a door or around corners, and mirrors. (The Cornell box
/// under its bulb is held against a truth of another program's: `cornell.rs`.)
///
/// Bounds of the relative RMSE are a third above what was measured, so that none may get much worse unseen.
#[test]
fn techniques_agree_with_the_truth() {
    let scenes: [(&str, [Bound; 2]); 5] = [
        (
            "cornell_area",
            [
                bound(CONES, [0.75, 1.05], 0.45),
                bound(HINTS, [0.95, 1.2], 0.3),
            ],
        ),
        (
            "sky_court",
            [
                bound(CONES, [0.8, 1.05], 0.21),
                bound(HINTS, [0.93, 1.07], 0.1),
            ],
        ),
        (
            "two_rooms",
            [
                bound(CONES, [0.75, 1.1], 0.36),
                bound(HINTS, [0.85, 1.1], 0.33),
            ],
        ),
        (
            "tunnel",
            [
                bound(CONES, [0.72, 1.1], 0.42),
                bound(HINTS, [0.9, 1.1], 0.25),
            ],
        ),
        (
            "glossy_floor",
            [
                bound(CONES, [0.8, 1.1], 0.28),
                bound(HINTS, [0.8, 1.1], 0.38),
            ],
        ),
    ];
    for (name, bounds) in scenes {
        let scene = scenes::find(name).expect("the scene is bundled");
        let mut studio =
            quality::open(&scene, &EFFORT, &SettingsOptions::default()).expect("the scene opens");
        let truth = quality::truth(&mut studio, EFFORT.paths, &quality::cache_folder());
        let truth = truth.expect("the truth can be traced");
        let techniques = chosen_techniques(studio.world(), &[]).expect("all are there");
        assert_eq!(techniques, bounds.each_ref().map(|bound| bound.technique));
        for Bound {
            technique,
            mean: [least, most],
            rmse,
        } in bounds
        {
            quality::choose(&mut studio, technique);
            let errors = errors(&mut studio, &EFFORT, &truth);
            let what = format!(
                "{name}, {technique}: mean ratio {:.3}, relative RMSE {:.3}, median error {:.3}",
                errors.mean_ratio, errors.relative_rmse, errors.median_error
            );
            println!("{what}");
            assert!((least..=most).contains(&errors.mean_ratio), "{what}");
            assert!(errors.relative_rmse < rmse, "{what}");
        }
    }
}

/// The higher a quality level, the closer to the truth.
#[test]
fn presets_are_in_the_order_of_their_errors() {
    let effort = Effort {
        // The levels leave it as it is, and it costs most.
        resolution: 64,
        ..EFFORT
    };
    let scene = scenes::find("two_rooms").expect("the scene is bundled");
    let mut studio =
        quality::open(&scene, &effort, &SettingsOptions::default()).expect("the scene opens");
    let truth = quality::truth(&mut studio, effort.paths, &quality::cache_folder());
    let truth = truth.expect("the truth can be traced");
    for technique in [CONES, HINTS] {
        quality::choose(&mut studio, technique);
        let errors = GiQuality::ALL.map(|level| {
            let world = studio.world();
            let registry = world.resource::<GiSettingsRegistry>().clone();
            assert!(registry.apply_preset(world, level.name()));
            errors(&mut studio, &effort, &truth).relative_rmse
        });
        println!("{technique}: relative RMSE of the levels {errors:.3?}");
        // Of the lowest level, only that the highest is better: in so small a picture, two bands of spherical harmonics hide
        // more noise than they blur.
        let [low, medium, high, ultra] = errors;
        assert!(
            ultra < high && high < medium && ultra < low,
            "{technique}: {errors:?}"
        );
    }
}
