//! The Cornell box: against a path tracer, twice the same, colours where they belong, and the cost
//! of standing still.

use std::path::Path;

use bevy::prelude::*;
use bevy_gi::prelude::*;

use crate::{
    common::{
        capture::read_exr,
        figures::{Blocks, Errors, blocks, luminance},
        headless::{Headless, Picture},
        scenes::cornell,
    },
    support::{
        CONES, HINTS, TECHNIQUES, app, app_on, assert_sane, camera, choose, settle, show, slab,
        spawn_coarse_cornell, spawn_cornell,
    },
};

const SIZE: UVec2 = UVec2::new(320, 184);

fn look(headless: &mut Headless, size: UVec2) -> (Entity, Handle<Image>) {
    let view = cornell::view();
    camera(headless, size, view.eye, view.look, view.fov)
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

/// The mean of indirect light is within `mean` of the path tracer's, and the relative RMSE is below `rmse`.
fn agrees_with_the_path_tracer(
    picture: &Picture,
    technique: GiTechnique,
    (mean, rmse): (f32, f32),
) {
    let (mut ours, mut truth) = (blocks(picture), truth());
    // The truth has no bulb; its blocks are left out.
    for bulb in [4 * 320 / 8 + 19, 4 * 320 / 8 + 20] {
        ours.values[bulb] = [0.0; 3];
        truth.values[bulb] = [0.0; 3];
    }
    let errors = Errors::new(&ours, &truth).expect("the pictures are of one size");
    println!(
        "cornell, {technique:?}: mean indirect / truth {:.3}, relative RMSE {:.3}",
        errors.mean_ratio, errors.relative_rmse
    );
    let apart = (errors.mean_ratio - 1.0).abs();
    assert!(apart < mean, "{technique:?}: mean off by {apart}");
    assert!(errors.relative_rmse < rmse, "{technique:?}: {errors:?}");
}

/// White boxes take colour from the walls.
fn colours_bleed(picture: &Picture, technique: GiTechnique) {
    let red_green = |x: u32, y: u32| {
        let p = picture.pixels[(y * SIZE.x + x) as usize];
        p[0] / p[1]
    };
    // The tall box' side that faces the red wall, and the short box' that faces the green one.
    let (left, right) = (red_green(121, 110), red_green(206, 140));
    println!(
        "{technique:?}: red over green beside the red wall {left:.2}, beside the green wall {right:.2}"
    );
    assert!(left > 1.3, "{technique:?}: {left}");
    assert!(right < 0.77, "{technique:?}: {right}");
}

/// In a still scene, nothing is captured or lit again: those passes report no new time.
fn rests(headless: &mut Headless, technique: GiTechnique) {
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
    for (path, age) in measured(headless) {
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

/// Every view is finite and not negative.
fn every_view_is_sane(headless: &mut Headless) {
    let (_, target) = look(headless, SIZE / 4);
    for view in GiView::ALL {
        show(headless, view);
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
            lit > 60 || empty.contains(&view),
            "{} is empty",
            view.name()
        );
    }
}

#[test]
fn indirect_light_is_right_and_then_costs_only_the_gather() {
    let mut headless = app();
    spawn_cornell(&mut headless);
    let (camera, target) = look(&mut headless, SIZE);
    // The means are those of the project's quality goals; the relative RMSE is 0.07 and 0.19.
    for (technique, bounds) in [(HINTS, (0.05, 0.1)), (CONES, (0.15, 0.25))] {
        choose(&mut headless, technique);
        show(&mut headless, GiView::Indirect);
        settle(&mut headless, 48);
        let picture = headless.picture(&target);
        assert_sane(&picture, "cornell");
        agrees_with_the_path_tracer(&picture, technique, bounds);
        colours_bleed(&picture, technique);
        rests(&mut headless, technique);
    }
    headless.app.world_mut().despawn(camera);
    every_view_is_sane(&mut headless);
}

/// Two runs give the same bytes, though one of them is in an app that has shown other things before.
#[test]
fn two_runs_give_the_same_bytes() {
    let bits = |pixels: &[[f32; 4]]| -> Vec<u32> {
        pixels.iter().flatten().map(|c| c.to_bits()).collect()
    };
    for technique in TECHNIQUES {
        let run = |headless: &mut Headless| {
            // What differs once does so with few voxels as well.
            spawn_coarse_cornell(headless, 48, 12);
            let (_, target) = look(headless, SIZE / 2);
            choose(headless, technique);
            settle(headless, 20);
            headless.picture(&target).pixels
        };
        let mut used = app();
        slab(&mut used, Vec3::NEG_ONE, Vec3::ONE, &Handle::default());
        used.steps(2);
        drop(used);
        let a = run(&mut app());
        let b = run(&mut app_on(default(), |_| {}));
        assert!(a.iter().any(|p| luminance(p) > 0.0));
        let same = bits(&a) == bits(&b);
        assert!(same, "the pictures of two runs with {technique:?} differ");
    }
}
