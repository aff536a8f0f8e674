//! The four sides of the court: ground-floor and upper arcades.

use std::f32::consts::PI;

use glam::{Vec3, vec3};

use super::arches::{Opening, Slab, archivolt, keystone, pierced_wall};
use super::columns::{Order, baluster, column, pier};
use super::dims::*;
use super::materials::Mat;
use super::mesh::Soup;
use super::scene::Scene;
use super::shapes::{chamfered, cuboid, cyma, rect_ring, torus};

/// The arch in the middle of the end walls, wide and low like a portal.
pub const PORTAL: Opening = Opening {
    x: 0.0,
    half: 1.1,
    rise: 1.1,
    sill: 0.0,
    spring: 2.5,
};

/// Centre of ground-floor bay `i`.
pub fn bay_x(i: usize) -> f32 {
    BAY * (i as f32 - 0.5 * (BAYS as f32 - 1.0))
}

/// Builds both storeys of arcades around the court.
pub fn build(scene: &mut Scene) {
    ground_walls(scene);
    ground_columns(scene);
    upper_walls(scene);
    upper_columns(scene);
    balustrade(scene);
    cornices(scene);
}

fn ground_walls(scene: &mut Scene) {
    let openings: Vec<Opening> = (0..BAYS)
        .map(|i| Opening {
            x: bay_x(i),
            half: ARCH_R,
            rise: ARCH_R,
            sill: SPRING,
            spring: SPRING,
        })
        .collect();
    let long = pierced_wall(
        Slab {
            min: vec3(-AXIS_X - GROUND_HALF, SPRING, -GROUND_HALF),
            max: vec3(AXIS_X + GROUND_HALF, FLOOR2 - 0.2, GROUND_HALF),
        },
        &openings,
        18,
    );
    let long = scene.solid("ArcadeWall", long, 30.0, Mat::Ashlar);
    // The long walls own the corners, the end walls are let into them.
    let end = pierced_wall(
        Slab {
            min: vec3(-AXIS_Z + 0.2, -0.05, -GROUND_HALF),
            max: vec3(AXIS_Z - 0.2, FLOOR2 - 0.2, GROUND_HALF),
        },
        &[Opening {
            sill: -0.05,
            ..PORTAL
        }],
        28,
    );
    let end = scene.solid("EndWall", end, 30.0, Mat::Ashlar);
    let band = scene.solid(
        "Archivolt",
        archivolt(ARCH_R, ARCH_R, 0.25, 0.10, 18),
        35.0,
        Mat::Carved,
    );
    let key = scene.solid("Keystone", keystone(ARCH_R, 0.42, 0.15), 20.0, Mat::Carved);
    let portal_band = scene.solid(
        "PortalArchivolt",
        archivolt(PORTAL.half, PORTAL.rise, 0.22, 0.10, 28),
        35.0,
        Mat::Carved,
    );
    let portal_key = scene.solid(
        "PortalKeystone",
        keystone(PORTAL.half, 0.38, 0.15),
        20.0,
        Mat::Carved,
    );
    let jamb = scene.solid(
        "PortalPilaster",
        pier(0.09, 0.05, PORTAL.spring, 0.5),
        30.0,
        Mat::Carved,
    );
    for (side, yaw) in [(1.0_f32, 0.0_f32), (-1.0, PI)] {
        scene.place("ArcadeWall", long, vec3(0.0, 0.0, side * AXIS_Z), yaw);
        for i in 0..BAYS {
            // The court face and the aisle face; `side` * AXIS_Z - half is
            // the court face, which looks towards -side.
            for (face, name) in [(-1.0, "ArchivoltCourt"), (1.0, "ArchivoltAisle")] {
                let at = vec3(bay_x(i), SPRING, side * (AXIS_Z + face * GROUND_HALF));
                let turn = if side * face > 0.0 { 0.0 } else { PI };
                scene.place(name, band, at, turn);
                if face < 0.0 {
                    scene.place("Keystone", key, at, turn);
                }
            }
        }
        let turn = side * 0.5 * PI;
        scene.place("EndWall", end, vec3(side * AXIS_X, 0.0, 0.0), turn);
        for face in [-1.0, 1.0] {
            let x = side * (AXIS_X + face * GROUND_HALF);
            let turn = side * face * 0.5 * PI;
            scene.place(
                "PortalArchivolt",
                portal_band,
                vec3(x, PORTAL.spring, 0.0),
                turn,
            );
            scene.place(
                "PortalKeystone",
                portal_key,
                vec3(x, PORTAL.spring, 0.0),
                turn,
            );
            for s in [-1.0, 1.0] {
                let z = s * (PORTAL.half + 0.12);
                scene.place("PortalPilaster", jamb, vec3(x, 0.0, z), 0.5 * PI);
            }
        }
    }
}

fn ground_columns(scene: &mut Scene) {
    let col = scene.solid(
        "GroundColumn",
        column(&Order {
            height: SPRING - STEP,
            radius: 0.30,
            plinth: 0.42,
            abacus: 0.41,
            capital: 0.84,
            segments: 20,
            leaves: 6,
        }),
        42.0,
        Mat::CarvedDark,
    );
    let corner = scene.solid(
        "CornerPier",
        pier(0.34, 0.34, SPRING + 0.01, 1.0),
        30.0,
        Mat::Carved,
    );
    let step = scene.solid(
        "ArcadeStep",
        chamfered(
            vec3(-AXIS_X - 0.5, -0.1, -0.5),
            vec3(AXIS_X + 0.5, STEP, 0.5),
            0.015,
        ),
        20.0,
        Mat::Carved,
    );
    for side in [1.0_f32, -1.0] {
        scene.place("ArcadeStep", step, vec3(0.0, 0.0, side * AXIS_Z), 0.0);
        for i in 1..BAYS {
            let x = BAY * i as f32 - AXIS_X;
            scene.place("GroundColumn", col, vec3(x, STEP, side * AXIS_Z), 0.0);
        }
        for end in [1.0_f32, -1.0] {
            scene.place(
                "CornerPier",
                corner,
                vec3(end * AXIS_X, 0.0, side * AXIS_Z),
                0.0,
            );
        }
    }
}

fn upper_walls(scene: &mut Scene) {
    let top = EAVE_Y + 0.32;
    let openings = |n: usize| -> Vec<Opening> {
        (0..n)
            .map(|i| Opening {
                x: UPPER_BAY * (i as f32 - 0.5 * (n as f32 - 1.0)),
                half: ARCH2_R,
                rise: ARCH2_R,
                sill: SPRING2,
                spring: SPRING2,
            })
            .collect()
    };
    let wall = |half: f32, n: usize| {
        pierced_wall(
            Slab {
                min: vec3(-half, SPRING2, -UPPER_HALF),
                max: vec3(half, top, UPPER_HALF),
            },
            &openings(n),
            12,
        )
    };
    let (nx, nz) = (2 * BAYS, (2.0 * AXIS_Z / UPPER_BAY).round() as usize);
    let long = scene.solid(
        "UpperWall",
        wall(AXIS_X + UPPER_HALF, nx),
        30.0,
        Mat::Ashlar,
    );
    let end = scene.solid("UpperEndWall", wall(AXIS_Z - 0.1, nz), 30.0, Mat::Ashlar);
    let band = scene.solid(
        "UpperArchivolt",
        archivolt(ARCH2_R, ARCH2_R, 0.15, 0.06, 12),
        35.0,
        Mat::Carved,
    );
    for (side, yaw) in [(1.0_f32, 0.0_f32), (-1.0, PI)] {
        scene.place("UpperWall", long, vec3(0.0, 0.0, side * AXIS_Z), yaw);
        for o in openings(nx) {
            let at = vec3(o.x, SPRING2, side * (AXIS_Z - UPPER_HALF));
            scene.place(
                "UpperArchivolt",
                band,
                at,
                if side > 0.0 { PI } else { 0.0 },
            );
        }
        let turn = side * 0.5 * PI;
        scene.place("UpperEndWall", end, vec3(side * AXIS_X, 0.0, 0.0), turn);
        for o in openings(nz) {
            let at = vec3(side * (AXIS_X - UPPER_HALF), SPRING2, o.x);
            scene.place("UpperArchivolt", band, at, -turn);
        }
    }
}

/// Positions of the upper columns around the court, corners left out.
fn upper_positions() -> Vec<Vec3> {
    let mut out = Vec::new();
    for side in [1.0_f32, -1.0] {
        for i in 1..2 * BAYS {
            out.push(vec3(UPPER_BAY * i as f32 - AXIS_X, 0.0, side * AXIS_Z));
        }
        for i in 1..4 {
            out.push(vec3(side * AXIS_X, 0.0, UPPER_BAY * i as f32 - AXIS_Z));
        }
    }
    out
}

fn upper_columns(scene: &mut Scene) {
    let col = scene.solid(
        "UpperColumn",
        column(&Order {
            height: SPRING2 - RAIL + 0.01,
            radius: 0.135,
            plinth: 0.19,
            abacus: 0.27,
            capital: 0.42,
            segments: 10,
            leaves: 0,
        }),
        42.0,
        Mat::Carved,
    );
    let pedestal = scene.solid(
        "Pedestal",
        pier(0.17, 0.17, RAIL - FLOOR2 + 0.012, 0.42),
        30.0,
        Mat::Carved,
    );
    let corner = scene.solid(
        "UpperCornerPier",
        pier(0.21, 0.21, SPRING2 - FLOOR2 + 0.01, 0.6),
        30.0,
        Mat::Carved,
    );
    for p in upper_positions() {
        scene.place("UpperColumn", col, p + Vec3::Y * RAIL, 0.0);
        scene.place("Pedestal", pedestal, p + Vec3::Y * FLOOR2, 0.0);
    }
    for sx in [1.0_f32, -1.0] {
        for sz in [1.0_f32, -1.0] {
            let p = vec3(sx * AXIS_X, FLOOR2, sz * AXIS_Z);
            scene.place("UpperCornerPier", corner, p, 0.0);
        }
    }
}

fn balustrade(scene: &mut Scene) {
    let foot = 0.13;
    let rail = 0.13;
    let one = baluster(RAIL - FLOOR2 - foot - rail);
    let count = 4;
    let mut bay = Soup::default();
    for i in 0..count {
        let x = (i as f32 - 0.5 * (count as f32 - 1.0)) * 0.27;
        bay.add(one.clone().moved(vec3(x, 0.0, 0.0)));
    }
    let bay = scene.solid("Balusters", bay, 40.0, Mat::Carved);
    let y = FLOOR2 + foot;
    for side in [1.0_f32, -1.0] {
        for i in 0..2 * BAYS {
            let x = UPPER_BAY * (i as f32 + 0.5) - AXIS_X;
            scene.place("Balusters", bay, vec3(x, y, side * AXIS_Z), 0.0);
        }
        for i in 0..4 {
            let z = UPPER_BAY * (i as f32 + 0.5) - AXIS_Z;
            scene.place("Balusters", bay, vec3(side * AXIS_X, y, z), 0.5 * PI);
        }
    }
    // Continuous base course and moulded hand rail; outside is towards the
    // gallery in terms of the ring's loop.
    let ring = |profile: &[(f32, f32)]| -> Soup {
        rect_ring(
            &profile
                .iter()
                .map(|&(d, y)| (AXIS_X + d, AXIS_Z + d, y))
                .collect::<Vec<_>>(),
        )
    };
    let base = ring(&[
        (0.14, FLOOR2 - 0.02),
        (0.14, FLOOR2 + foot - 0.03),
        (0.11, FLOOR2 + foot),
        (-0.11, FLOOR2 + foot),
        (-0.14, FLOOR2 + foot - 0.03),
        (-0.14, FLOOR2 - 0.02),
    ]);
    scene.fixed("BalustradeBase", base, 20.0, Mat::Carved);
    let y0 = RAIL - rail;
    let top = ring(&[
        (0.10, y0),
        (0.12, y0 + 0.03),
        (0.15, y0 + 0.05),
        (0.165, y0 + 0.085),
        (0.15, y0 + 0.12),
        (0.12, RAIL),
        (-0.12, RAIL),
        (-0.15, y0 + 0.12),
        (-0.165, y0 + 0.085),
        (-0.15, y0 + 0.05),
        (-0.12, y0 + 0.03),
        (-0.10, y0),
    ]);
    scene.fixed("BalustradeRail", top, 40.0, Mat::Carved);
}

/// A cornice around the court: `profile` gives projections into the court
/// and heights, from bottom to top; its back is let into the wall.
fn court_ring(profile: &[(f32, f32)], face_x: f32, face_z: f32) -> Soup {
    let (y0, y1) = (profile[0].1, profile[profile.len() - 1].1);
    // The court side is the inside of the ring, so the loop runs down there.
    let mut loop_pts = vec![(-0.2, y0), (-0.2, y1)];
    loop_pts.extend(profile.iter().rev());
    rect_ring(
        &loop_pts
            .iter()
            .map(|&(d, y)| (face_x - d, face_z - d, y))
            .collect::<Vec<_>>(),
    )
}

fn cornices(scene: &mut Scene) {
    // String course under the gallery floor.
    let y = FLOOR2 - 0.62;
    let mut p = vec![(0.0, y), (0.02, y)];
    torus(&mut p, 0.02, 0.07, 4);
    p.push((0.03, y + 0.09));
    p.push((0.03, y + 0.28));
    p.push((0.07, y + 0.29));
    cyma(&mut p, 0.17, y + 0.42, 5);
    p.push((0.21, y + 0.43));
    p.push((0.21, y + 0.53));
    torus(&mut p, 0.21, 0.06, 3);
    p.push((0.21, y + 0.60));
    p.push((0.10, y + 0.635));
    scene.fixed(
        "StringCourse",
        court_ring(&p, COURT_X, COURT_Z),
        35.0,
        Mat::Carved,
    );
    // Main cornice under the eave.
    let y = EAVE_Y - 0.52;
    let mut q = vec![(0.0, y), (0.03, y)];
    torus(&mut q, 0.03, 0.06, 4);
    q.push((0.035, y + 0.08));
    q.push((0.035, y + 0.26));
    cyma(&mut q, 0.13, y + 0.34, 4);
    q.push((0.22, y + 0.35));
    q.push((0.22, y + 0.42));
    cyma(&mut q, 0.29, y + 0.49, 4);
    q.push((0.29, y + 0.515));
    let (fx, fz) = (AXIS_X - UPPER_HALF, AXIS_Z - UPPER_HALF);
    scene.fixed("Cornice", court_ring(&q, fx, fz), 35.0, Mat::Carved);

    // Rows of small brackets in the friezes of both.
    let brackets = |n: usize, pitch: f32, size: Vec3, e: f32| -> Soup {
        let mut soup = Soup::default();
        for i in 0..n {
            let x = (i as f32 - 0.5 * (n as f32 - 1.0)) * pitch;
            let (lo, hi) = (
                vec3(x - 0.5 * size.x, 0.0, -0.03),
                vec3(x + 0.5 * size.x, size.y, size.z),
            );
            soup.add(if e > 0.0 {
                chamfered(lo, hi, e)
            } else {
                cuboid(lo, hi)
            });
        }
        soup
    };
    let low = brackets(8, 0.4, vec3(0.16, 0.17, 0.11), 0.012);
    let low = scene.solid("Brackets", low, 20.0, Mat::Carved);
    let high = brackets(16, 0.2, vec3(0.10, 0.15, 0.10), 0.0);
    let high = scene.solid("Dentils", high, 20.0, Mat::Carved);
    // One row per end, short of the corners where the long rows already are.
    let high_end = brackets(28, 0.2, vec3(0.10, 0.15, 0.10), 0.0);
    let high_end = scene.solid("EndDentils", high_end, 20.0, Mat::Carved);
    let low_end = brackets(14, 0.4, vec3(0.16, 0.17, 0.11), 0.012);
    let low_end = scene.solid("EndBrackets", low_end, 20.0, Mat::Carved);
    for (mesh, end, name, y, cx, cz) in [
        (
            low,
            low_end,
            "Brackets",
            FLOOR2 - 0.62 + 0.105,
            COURT_X,
            COURT_Z,
        ),
        (high, high_end, "Dentils", EAVE_Y - 0.52 + 0.10, fx, fz),
    ] {
        for side in [1.0_f32, -1.0] {
            for i in 0..BAYS {
                let yaw = if side > 0.0 { PI } else { 0.0 };
                scene.place(name, mesh, vec3(bay_x(i), y, side * cz), yaw);
            }
            scene.place(name, end, vec3(side * cx, y, 0.0), -side * 0.5 * PI);
        }
    }
}
