//! The axes of Papaioannou 2011, figure 10 and table 2: what radiance hints cost over each of their parameters,
//! the others held.

use std::fmt::Write;

use bevy::prelude::*;
use bevy_gi::{GiStatistics, ShOrder, prelude::*};
use bevy_gi_tools::{scenes::Scene, studio::Studio};

use crate::{
    Options,
    measure::{self, Situation},
    output,
};

/// A point on an axis.
#[derive(serde::Serialize)]
pub struct Point {
    pub scene: String,
    pub axis: &'static str,
    pub value: String,
    /// Number of hints.
    pub hints: u64,
    /// Milliseconds of a frame, still and while all lights change.
    pub still_ms: f64,
    pub lights_ms: f64,
    /// Those of the paper's table 2 while all lights change: first bounce, later ones, reconstruction.
    pub parts_ms: [Option<f64>; 3],
}

/// Our passes for the columns of the paper's table 2.
const PARTS: [&[&str]; 3] = [
    &["gi/hints/lights"],
    &["gi/hints/exchange", "gi/hints/sum"],
    &["gi/hints/gather", "gi/apply/composite"],
];

/// What is held while one parameter changes.
#[derive(Clone, Copy)]
struct Base {
    grid: u32,
    samples: u32,
    order: ShOrder,
    bounces: u32,
    resolution: bevy_gi::GatherResolution,
}

/// That of the paper's figure.
const FIGURE_10: Base = Base {
    grid: 16,
    samples: 28,
    order: ShOrder::Two,
    bounces: 2,
    resolution: bevy_gi::GatherResolution::Full,
};

/// On a software driver, which has no clock for single passes: the gather would hide what so few hints cost.
const SOFTWARE: Base = Base {
    grid: 32,
    samples: 112,
    resolution: bevy_gi::GatherResolution::Quarter,
    ..FIGURE_10
};

/// A scene of the paper's table 2 that is here in some form.
struct Published {
    scene: &'static str,
    /// Hints along the longest side,
    grid: u32,
    /// and samples of each.
    samples: u32,
    /// Milliseconds of [`PARTS`] on a GeForce GTX 285, with order two and three.
    ms: [[f64; 3]; 2],
}

/// Two bounces, GI at the full size of 1024 x 1024.
const TABLE_2: [Published; 2] = [
    Published {
        scene: "cornell",
        grid: 10,
        samples: 60,
        ms: [[2.36, 0.73, 2.57], [2.94, 1.53, 5.58]],
    },
    Published {
        scene: "sponza",
        grid: 24,
        samples: 30,
        ms: [[2.26, 1.87, 2.88], [4.13, 2.79, 6.03]],
    },
];

/// The axis of the points that are cases of table 2.
const TABLE_2_AXIS: &str = "table 2: order";

/// Every point: its axis, its value, and the parameters.
fn points(scene: &str, base: Base) -> Vec<(&'static str, String, Base)> {
    use bevy_gi::GatherResolution::{Full, Half, Quarter};
    let mut points = Vec::new();
    for grid in [8, 16, 24, 32, 48] {
        points.push(("hints a side", grid.to_string(), Base { grid, ..base }));
    }
    for samples in [14, 28, 56, 112, 224] {
        points.push(("samples", samples.to_string(), Base { samples, ..base }));
    }
    for (name, order) in [("two", ShOrder::Two), ("three", ShOrder::Three)] {
        points.push(("order", name.into(), Base { order, ..base }));
    }
    for bounces in 1..=4 {
        points.push(("bounces", bounces.to_string(), Base { bounces, ..base }));
    }
    for resolution in [Full, Half, Quarter] {
        let name = format!("1/{}", resolution.divisor());
        points.push(("GI resolution", name, Base { resolution, ..base }));
    }
    for published in TABLE_2.iter().filter(|row| row.scene == scene) {
        for (name, order) in [("two", ShOrder::Two), ("three", ShOrder::Three)] {
            let of = Base {
                grid: published.grid,
                samples: published.samples,
                order,
                ..FIGURE_10
            };
            points.push((TABLE_2_AXIS, name.into(), of));
        }
    }
    points
}

/// The technique of the paper.
pub const TECHNIQUE: GiTechnique = GiTechnique::new("hints");

/// Measures all points in a scene that is open.
pub fn measure(
    studio: &mut Studio,
    scene: &Scene,
    without: [f64; 3],
    software: bool,
    options: &Options,
) -> Result<Vec<Point>, String> {
    measure::apply(studio.world(), TECHNIQUE, "paper", 64)?;
    let mut measured = Vec::new();
    let base = if software { SOFTWARE } else { FIGURE_10 };
    for (axis, value, base) in points(scene.name, base) {
        let world = studio.world();
        let mut cameras = world.query::<&mut GiCamera>();
        for mut camera in cameras.iter_mut(world) {
            camera.resolution = base.resolution;
        }
        let mut hints = world.resource_mut::<RadianceHintsSettings>();
        (hints.samples, hints.order, hints.bounces) = (base.samples, base.order, base.bounces);
        let mut volumes = world.query_filtered::<Entity, With<GiVolume>>();
        let volumes: Vec<_> = volumes.iter(world).collect();
        for volume in volumes {
            let set = ProbeSet::default().with_resolution(base.grid);
            world.entity_mut(volume).insert(set);
        }
        studio.headless.wait_until(|_| true);
        studio.settle(8);
        let [still, lights] = [Situation::Still, Situation::Lights].map(|situation| {
            measure::run(studio, situation, options.frames);
            let without = without[situation as usize];
            measure::read(studio, situation, without)
        });
        let counts = studio.world().resource::<GiStatistics>().counts();
        measured.push(Point {
            scene: scene.name.into(),
            axis,
            value,
            hints: counts.get("scene/probes").copied().unwrap_or(0),
            still_ms: still.gi_ms,
            lights_ms: lights.gi_ms,
            parts_ms: PARTS.map(|passes| lights.sum(passes).filter(|_| !software)),
        });
    }
    let world = studio.world();
    let mut sets = world.query::<&mut ProbeSet>();
    for mut set in sets.iter_mut(world) {
        *set = ProbeSet::default();
    }
    Ok(measured)
}

/// The table, as Markdown.
pub fn text(points: &[Point], software: bool) -> String {
    if points.is_empty() {
        return String::new();
    }
    let header = ["scene", "axis", "value", "hints", "GI still", "GI lights"];
    let mut table = output::table(header.map(String::from).into());
    for point in points {
        table.add_row([
            point.scene.clone(),
            point.axis.into(),
            point.value.clone(),
            point.hints.to_string(),
            format!("{:.2}", point.still_ms),
            format!("{:.2}", point.lights_ms),
        ]);
    }
    let how = match software {
        false => format!("with {}", held(FIGURE_10)),
        true => format!(
            "with {}, but table 2, which has {}",
            held(SOFTWARE),
            held(FIGURE_10)
        ),
    };
    format!(
        "Papaioannou 2011, figure 10 and table 2: preset 'paper', 64 voxels, one parameter at a time; {how}. ms.\n\n\
         {table}\n\n{}",
        table_2(points, software)
    )
}

/// The paper's table 2 beside ours, part by part.
fn table_2(points: &[Point], software: bool) -> String {
    let mut header = vec!["scene".to_owned(), "order".into()];
    for part in ["first bounce", "second", "reconstruct", "all"] {
        header.push(format!("{part}: theirs"));
        header.push("ours".into());
    }
    let mut table = output::table(header);
    for point in points.iter().filter(|point| point.axis == TABLE_2_AXIS) {
        let published = TABLE_2.iter().find(|row| row.scene == point.scene);
        let Some(published) = published else { continue };
        let theirs = published.ms[usize::from(point.value == "three")];
        let all = (theirs.iter().sum(), point.parts_ms.into_iter().sum());
        let parts = theirs.into_iter().zip(point.parts_ms).chain([all]);
        let cells = parts.flat_map(|(theirs, ours): (f64, Option<f64>)| {
            let ours = ours.map_or("not measured".into(), |ms| format!("{ms:.2}"));
            [format!("{theirs:.2}"), ours]
        });
        table.add_row(
            [point.scene.clone(), point.value.clone()]
                .into_iter()
                .chain(cells),
        );
    }
    let ours = match software {
        false => "",
        true => " Ours needs a GPU: this is a software driver.",
    };
    format!(
        "Papaioannou 2011, table 2, on a GeForce GTX 285 at 1024x1024, without what reflective shadow maps and the \
         G-buffer cost; scenes as the paper has them.{ours} ms.\n\n{table}\n"
    )
}

/// What is held, in words.
fn held(base: Base) -> String {
    format!(
        "{} hints a side, {} samples, order two, {} bounces, GI at 1/{} of the picture",
        base.grid,
        base.samples,
        base.bounces,
        base.resolution.divisor()
    )
}

/// The same, as CSV.
pub fn csv(points: &[Point]) -> String {
    let header = "scene,axis,value,hints,still_ms,lights_ms,first_ms,later_ms,reconstruct_ms";
    let mut text = format!("{header}\n");
    for p in points {
        let parts = p
            .parts_ms
            .map(|ms| ms.map_or(String::new(), |ms| ms.to_string()));
        let [first, later, reconstruct] = parts;
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{first},{later},{reconstruct}",
            p.scene, p.axis, p.value, p.hints, p.still_ms, p.lights_ms
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_to_the_totals_of_the_table() {
        for (scene, totals) in [("cornell", [5.66, 10.05]), ("sponza", [7.01, 12.95])] {
            let row = TABLE_2.iter().find(|row| row.scene == scene).unwrap();
            for (parts, total) in row.ms.iter().zip(totals) {
                let sum: f64 = parts.iter().sum();
                assert!((sum - total).abs() < 0.005, "{scene}: {sum}");
            }
        }
    }
}
