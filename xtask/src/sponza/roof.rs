//! The tiled lean-to roofs that drain into the court.

use std::f32::consts::PI;

use glam::{Vec3, vec2, vec3};

use super::dims::*;
use super::materials::Mat;
use super::mesh::{Corner, Soup, corner};
use super::scene::Scene;
use super::shapes::{chamfered, rect_ring};

/// Thickness of boarding and mortar under the tiles.
const DECK: f32 = 0.16;
/// Rows of tiles in one 3.2 m module.
const ROWS: usize = 10;
/// Visible length of a tile up the slope.
const GAUGE: f32 = 0.56;

/// One of the four slopes, seen in its own frame: x along the eave, run away
/// from the court.
#[derive(Clone, Copy)]
struct Slope {
    /// Horizontal depth from eave to wall.
    run: f32,
    /// Extra half length of the far edge over the eave.
    spread: f32,
}

impl Slope {
    fn length(self) -> f32 {
        vec2(self.run, ROOF_RISE).length()
    }

    /// A point at distance `s` up the slope and `lift` off it.
    fn at(self, x: f32, s: f32, lift: f32) -> Vec3 {
        let (c, n) = (self.run / self.length(), ROOF_RISE / self.length());
        vec3(x, s * n + lift * c, -(s * c - lift * n))
    }
}

/// Builds deck, rafters and tiles of all four slopes.
pub fn build(scene: &mut Scene) {
    let deck = rect_ring(&[
        (ROOF_TOP_X, ROOF_TOP_Z, EAVE_Y + ROOF_RISE - 0.1),
        (ROOF_TOP_X, ROOF_TOP_Z, EAVE_Y + ROOF_RISE + DECK),
        (EAVE_X, EAVE_Z, EAVE_Y + DECK),
        (EAVE_X, EAVE_Z, EAVE_Y + 0.05),
    ]);
    scene.fixed("RoofDeck", deck, 20.0, Mat::Wood);

    let long = Slope {
        run: ROOF_TOP_Z - EAVE_Z,
        spread: ROOF_TOP_X - EAVE_X,
    };
    let end = Slope {
        run: ROOF_TOP_X - EAVE_X,
        spread: ROOF_TOP_Z - EAVE_Z,
    };
    tiles(scene, "Long", long, EAVE_X, EAVE_Z);
    tiles(scene, "End", end, EAVE_Z, EAVE_X);
    rafters(scene, long, end);
}

/// One tile module: a corrugated sheet per course, each course lying with its
/// lower edge on the one below. `starts(row)` says how far up the row begins.
fn courses(slope: Slope, pitch: f32, rows: usize, start: impl Fn(f32) -> f32) -> Soup {
    let total = slope.length();
    let count = (total / GAUGE).ceil() as usize;
    // A cover tile (half round, up) and a channel tile (shallow, down) in
    // each pitch: (fraction of the pitch, height).
    let near = [
        (0.0, 0.026),
        (0.14, 0.078),
        (0.36, 0.100),
        (0.58, 0.078),
        (0.72, 0.012),
        (1.0, 0.026),
    ];
    // Further up, where only the other gallery sees them, they are coarser.
    let far = [(0.0, 0.022), (0.36, 0.106), (0.72, 0.014), (1.0, 0.022)];
    let thick = 0.022;
    let mut soup = Soup::default();
    for row in 0..rows {
        let x0 = (row as f32 - 0.5 * rows as f32) * pitch;
        let from = start(x0 + 0.5 * pitch);
        for k in 0..count {
            let s0 = GAUGE * k as f32 - 0.06;
            let s1 = (GAUGE * (k + 1) as f32 + 0.03).min(total);
            // A tile that crosses the valley runs on under the other slope.
            if s1 < from || s1 - s0 < 0.05 {
                continue;
            }
            let section: &[(f32, f32)] = if k < 2 { &near } else { &far };
            // The lower end rides on the course below; tiles taper upwards.
            let at = |i: usize, upper: bool, skin: f32| -> Corner {
                let (f, h) = section[i];
                let (s, lift, squeeze) = if upper {
                    (s1, 0.0, 0.96)
                } else {
                    (s0, thick + 0.006, 1.0)
                };
                let x = x0 + pitch * f;
                let p = slope.at(x, s, h * squeeze + lift + skin);
                let uv = vec2(
                    x + 0.31 * (row % 5) as f32,
                    -s - skin + 0.17 * (k % 3) as f32,
                );
                corner(p, uv)
            };
            for i in 0..section.len() - 1 {
                soup.quad(
                    at(i, false, 0.0),
                    at(i + 1, false, 0.0),
                    at(i + 1, true, 0.0),
                    at(i, true, 0.0),
                );
                // The visible lower edge has the tile's thickness.
                let low = if k == 0 { -thick - 0.02 } else { -thick };
                soup.quad(
                    at(i, false, low),
                    at(i + 1, false, low),
                    at(i + 1, false, 0.0),
                    at(i, false, 0.0),
                );
            }
        }
    }
    soup
}

fn tiles(scene: &mut Scene, name: &str, slope: Slope, half_eave: f32, offset: f32) {
    // Whole modules between the corners, and a mitred module at each corner
    // whose rows start at the valley.
    let modules = (2.0 * half_eave / BAY).floor().max(1.0) as usize;
    let pitch = 2.0 * half_eave / (modules * ROWS) as f32;
    let width = pitch * ROWS as f32;
    let y = EAVE_Y + DECK;
    let full = scene.mesh(
        &format!("Tiles{name}"),
        vec![(courses(slope, pitch, ROWS, |_| 0.0), 50.0, Mat::RoofTile)],
    );
    let corner_rows = (slope.spread / pitch).ceil() as usize;
    let half = 0.5 * corner_rows as f32 * pitch;
    let slant = slope.length() / slope.spread;
    let right = courses(slope, pitch, corner_rows, |x| (x + half) * slant);
    let left = courses(slope, pitch, corner_rows, |x| (half - x) * slant);
    let right = scene.mesh(
        &format!("Tiles{name}Right"),
        vec![(right, 50.0, Mat::RoofTile)],
    );
    let left = scene.mesh(
        &format!("Tiles{name}Left"),
        vec![(left, 50.0, Mat::RoofTile)],
    );
    let long = name == "Long";
    for side in [1.0_f32, -1.0] {
        // The slope's local -z leads away from the court.
        let place = |along: f32| -> (Vec3, f32) {
            if long {
                let yaw = if side > 0.0 { PI } else { 0.0 };
                (vec3(-side * along, y, side * offset), yaw)
            } else {
                (vec3(side * offset, y, side * along), -side * 0.5 * PI)
            }
        };
        for m in 0..modules {
            let (p, yaw) = place((m as f32 - 0.5 * (modules as f32 - 1.0)) * width);
            scene.place("Tiles", full, p, yaw);
        }
        let (p, yaw) = place(half_eave + half);
        scene.place("TilesCorner", right, p, yaw);
        let (p, yaw) = place(-half_eave - half);
        scene.place("TilesCorner", left, p, yaw);
    }
}

/// Rafter feet under the eave, as seen from the court.
fn rafters(scene: &mut Scene, long: Slope, end: Slope) {
    for (name, slope, half, offset, is_long) in [
        ("RaftersLong", long, EAVE_X, EAVE_Z, true),
        ("RaftersEnd", end, EAVE_Z, EAVE_X, false),
    ] {
        let n = (2.0 * half / 0.6).round() as usize;
        let pitch = 2.0 * half / n as f32;
        let mut soup = Soup::default();
        for i in 0..n {
            let x = (i as f32 + 0.5 - 0.5 * n as f32) * pitch;
            let mut foot = chamfered(
                vec3(x - 0.05, -0.10, -0.95),
                vec3(x + 0.05, 0.07, -0.03),
                0.01,
            )
            .grain_uv(Vec3::Z);
            for c in foot.tris.iter_mut().flatten() {
                c.p.y -= c.p.z * ROOF_RISE / slope.run;
            }
            soup.add(foot);
        }
        let id = scene.solid(name, soup, 20.0, Mat::Wood);
        for side in [1.0_f32, -1.0] {
            if is_long {
                let yaw = if side > 0.0 { PI } else { 0.0 };
                scene.place(name, id, vec3(0.0, EAVE_Y, side * offset), yaw);
            } else {
                scene.place(name, id, vec3(side * offset, EAVE_Y, 0.0), -side * 0.5 * PI);
            }
        }
    }
}
