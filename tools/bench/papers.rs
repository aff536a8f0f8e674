//! What the papers measured, beside what is measured here.

use bevy_gi::GiTechnique;

use crate::measure::{Case, Situation};

/// A table of a paper: columns are numbers of voxels (or what the technique has in their place).
pub struct Published {
    pub technique: GiTechnique,
    pub source: &'static str,
    pub adapter: &'static str,
    /// The scene here that comes nearest.
    pub scene: &'static str,
    pub preset: &'static str,
    pub voxels: [u32; 3],
    pub rows: &'static [Row],
}

/// A pass at a size of the picture.
pub struct Row {
    pub size: [u32; 2],
    pub pass: &'static str,
    /// Milliseconds, by number of voxels.
    pub ms: [f64; 3],
    /// Our passes that do the same.
    pub ours: &'static [&'static str],
}

const VOXELIZE: &[&str] = &[
    "gi/scene/voxelize",
    "gi/scene/mark_bricks",
    "gi/scene/allocate_bricks",
    "gi/scene/brick_arguments",
    "gi/scene/resolve_voxels",
    "gi/scene/list_voxels",
    "gi/scene/slice_arguments",
];
const SHADOW: &[&str] = &["gi/scene/light_maps"];
const INJECTION: &[&str] = &["gi/vct/light"];
const FILTERING: &[&str] = &[
    "gi/vct/clear_cells",
    "gi/vct/filter_voxels",
    "gi/vct/filter_cells",
];
const SHADING: &[&str] = &["gi/vct/gather", "gi/apply/composite"];

const fn row(
    size: [u32; 2],
    pass: &'static str,
    ms: [f64; 3],
    ours: &'static [&'static str],
) -> Row {
    Row {
        size,
        pass,
        ms,
        ours,
    }
}

/// The voxelizer of table 5.1 tessellates; this one draws triangles, as ours does.
const RASTER: &str = "voxelize by raster (table 5.2)";

const HD: [u32; 2] = [1280, 720];
const HD_PLUS: [u32; 2] = [1600, 900];
const FULL_HD: [u32; 2] = [1920, 1080];

/// All tables.
pub const PUBLISHED: [Published; 1] = [Published {
    technique: GiTechnique::new("vct"),
    source: "Freed 2018, tables 5.1 and 5.2",
    adapter: "GeForce GTX 970",
    scene: "sponza",
    preset: "paper",
    voxels: [64, 128, 256],
    rows: &[
        row(HD, "voxelize", [0.90, 1.13, 2.40], VOXELIZE),
        row(HD, "shadow map", [0.69, 0.69, 0.69], SHADOW),
        row(HD, "injection", [0.92, 0.92, 0.93], INJECTION),
        row(HD, "filtering", [0.04, 0.10, 0.55], FILTERING),
        row(HD, "final shading", [3.89, 4.81, 5.32], SHADING),
        row(HD_PLUS, "voxelize", [0.70, 1.12, 2.39], VOXELIZE),
        row(HD_PLUS, "shadow map", [0.69, 0.69, 0.69], SHADOW),
        row(HD_PLUS, "injection", [0.92, 0.92, 0.93], INJECTION),
        row(HD_PLUS, "filtering", [0.05, 0.10, 0.56], FILTERING),
        row(HD_PLUS, "final shading", [5.98, 6.42, 7.10], SHADING),
        row(FULL_HD, "voxelize", [0.72, 1.15, 2.41], VOXELIZE),
        row(FULL_HD, RASTER, [0.53, 0.85, 1.91], VOXELIZE),
        row(FULL_HD, "shadow map", [0.68, 0.68, 0.69], SHADOW),
        row(FULL_HD, "injection", [0.92, 0.92, 0.93], INJECTION),
        row(FULL_HD, "filtering", [0.04, 0.10, 0.55], FILTERING),
        row(FULL_HD, "final shading", [8.23, 9.40, 9.75], SHADING),
    ],
}];

impl Published {
    /// What we measured in place of a figure: everything moves, as it does in the papers. `None` where
    /// that case was not measured.
    pub fn ours(&self, cases: &[Case], row: &Row, voxels: u32) -> Option<f64> {
        let case = cases.iter().find(|case| {
            case.technique == self.technique
                && case.scene == self.scene
                && case.preset == self.preset
                && case.size.to_array() == row.size
                && case.voxels == voxels
        })?;
        case.get(Situation::Moving)?.sum(row.ours)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_add_up_to_less_than_the_totals_of_the_table() {
        // Totals of Freed's table, at 64, 128 and 256 voxels: the rest is the depth prepass and what is
        // not listed.
        let totals = [
            (HD, [7.02, 8.21, 11.12]),
            (HD_PLUS, [9.46, 10.15, 13.43]),
            (FULL_HD, [11.23, 12.83, 16.31]),
        ];
        for (size, total) in totals {
            for (i, total) in total.into_iter().enumerate() {
                let rows = PUBLISHED[0].rows.iter();
                let rows = rows.filter(|row| row.size == size && row.pass != RASTER);
                let sum: f64 = rows.map(|row| row.ms[i]).sum();
                assert!((0.4..2.2).contains(&(total - sum)), "{size:?} {i}: {sum}");
            }
        }
    }
}
