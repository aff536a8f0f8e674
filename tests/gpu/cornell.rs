//! The Cornell box: against a path tracer, twice the same, colours where they belong, and the cost
//! of standing still.

use std::path::Path;

use bevy::prelude::*;
use bevy_gi::prelude::*;

use crate::{
    common::{
        capture::read_exr,
        figures::{Blocks, Errors, blocks, luminance},
        headless::Headless,
        scenes::cornell,
    },
    support::{CONES, HINTS, app, assert_sane, camera, choose, settle, show, spawn_cornell},
};

const SIZE: UVec2 = UVec2::new(320, 184);

fn cornell_box() -> (Headless, Handle<Image>) {
    let mut headless = app();
    spawn_cornell(&mut headless);
    let view = cornell::view();
    let (_, target) = camera(&mut headless, SIZE, view.eye, view.look, view.fov);
    (headless, target)
}

/// `tests/truth/cornell.exr`, made by `cornell.py` beside it with Mitsuba 3: indirect light, means
/// of 8x8 pixels, nits.
fn truth() -> Blocks {
    let picture =
        read_exr(Path::new("tests/truth/cornell.exr")).expect("the truth is in the repository");
    let values = picture.pixels.iter().map(|[r, g, b, _]| [*r, *g, *b]);
    Blocks {
        size: picture.size,
        values: values.collect(),
    }
}

/// Mean of a technique's indirect light over that of the truth, and relative RMSE.
fn errors(technique: GiTechnique) -> [f32; 2] {
    let (mut headless, target) = cornell_box();
    choose(&mut headless, technique);
    show(&mut headless, GiView::Indirect);
    settle(&mut headless, 60);
    let picture = headless.picture(&target);
    assert_sane(&picture, "cornell");
    let (mut ours, mut truth) = (blocks(&picture), truth());
    // The truth has no bulb; its blocks are left out.
    for bulb in [4 * 320 / 8 + 19, 4 * 320 / 8 + 20] {
        ours.values[bulb] = [0.0; 3];
        truth.values[bulb] = [0.0; 3];
    }
    let errors = Errors::new(&ours, &truth).expect("the pictures are of one size");
    let (ratio, rmse) = (errors.mean_ratio, errors.relative_rmse);
    println!("cornell, {technique:?}: mean indirect / truth {ratio:.3}, relative RMSE {rmse:.3}");
    [ratio, rmse]
}

// The bounds are those of the project's quality goals for each technique.

#[test]
fn indirect_light_agrees_with_the_path_tracer() {
    let [ratio, rmse] = errors(CONES);
    assert!((ratio - 1.0).abs() < 0.15, "mean {ratio} of the truth");
    assert!(rmse < 0.35, "relative RMSE {rmse}");
}

#[test]
fn light_of_hints_agrees_with_the_path_tracer() {
    let [ratio, rmse] = errors(HINTS);
    assert!((ratio - 1.0).abs() < 0.05, "mean {ratio} of the truth");
    assert!(rmse < 0.25, "relative RMSE {rmse}");
}

#[test]
fn two_runs_give_the_same_bytes() {
    let run = |technique| {
        let (mut headless, target) = cornell_box();
        choose(&mut headless, technique);
        settle(&mut headless, 20);
        headless.picture(&target).pixels
    };
    let bits = |pixels: &[[f32; 4]]| -> Vec<u32> {
        pixels.iter().flatten().map(|c| c.to_bits()).collect()
    };
    for technique in [CONES, HINTS] {
        let (a, b) = (run(technique), run(technique));
        assert!(a.iter().any(|p| luminance(p) > 0.0));
        let same = bits(&a) == bits(&b);
        assert!(same, "the pictures of two runs with {technique:?} differ");
    }
}

#[test]
fn white_boxes_take_colour_from_the_walls() {
    let (mut headless, target) = cornell_box();
    show(&mut headless, GiView::Indirect);
    settle(&mut headless, 40);
    let picture = headless.picture(&target);
    let red_green = |x: u32, y: u32| {
        let p = picture.pixels[(y * SIZE.x + x) as usize];
        p[0] / p[1]
    };
    // The tall box' side that faces the red wall, and the short box' that faces the green one.
    let (left, right) = (red_green(121, 110), red_green(206, 140));
    println!("red over green beside the red wall {left:.2}, beside the green wall {right:.2}");
    assert!(left > 1.3, "{left}");
    assert!(right < 0.77, "{right}");
}

#[test]
fn every_view_is_finite_and_not_negative() {
    let (mut headless, target) = cornell_box();
    settle(&mut headless, 10);
    for view in GiView::ALL {
        show(&mut headless, view);
        headless.steps(2);
        let picture = headless.picture(&target);
        assert_sane(&picture, view.name());
        let lit = picture
            .pixels
            .iter()
            .filter(|p| luminance(*p) > 0.0)
            .count();
        // The Cornell box under its bulb has nothing that is polished or shines; all else shows something.
        let empty = [GiView::Specular, GiView::VoxelEmission];
        assert!(
            lit > 1000 || empty.contains(&view),
            "{} is empty",
            view.name()
        );
    }
}

/// In a still scene, nothing is captured or lit again: those passes report no new time.
fn check_rest(technique: GiTechnique) {
    let (mut headless, _target) = cornell_box();
    choose(&mut headless, technique);
    settle(&mut headless, 60);
    let measured = |headless: &Headless| -> std::collections::BTreeMap<String, u64> {
        headless
            .diagnostics()
            .iter()
            .filter(|d| d.path().as_str().ends_with("elapsed_cpu"))
            .filter_map(|d| {
                let time = d.measurement()?.time;
                let age = std::time::Instant::now().duration_since(time).as_millis() as u64;
                Some((d.path().as_str().into(), age))
            })
            .collect()
    };
    let start = std::time::Instant::now();
    headless.steps(8);
    let spent = start.elapsed().as_millis() as u64;
    for (path, age) in measured(&headless) {
        let per_frame = path.contains("gather") || path.contains("gi/apply");
        if path.contains("render/gi/") && !per_frame {
            assert!(
                age > spent,
                "{path} ran {age} ms ago, within the last 8 frames"
            );
        }
        if path.contains(&format!("gi/{}/gather", technique.name())) {
            assert!(age <= spent, "the gather runs each frame");
        }
    }
}

#[test]
fn a_still_scene_costs_only_the_gather() {
    check_rest(CONES);
}

#[test]
fn a_still_scene_costs_only_the_gather_of_hints() {
    check_rest(HINTS);
}
