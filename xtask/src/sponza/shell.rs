//! Floors, aisle vaults, gallery and the enclosing walls.

use std::f32::consts::PI;

use glam::{Vec3, vec2, vec3};

use super::arcades::bay_x;
use super::arches::{Opening, Slab, archivolt, pierced_wall};
use super::columns::{corbel, pier};
use super::dims::*;
use super::materials::Mat;
use super::mesh::Soup;
use super::scene::Scene;
use super::shapes::{chamfered, cuboid, rect_ring};
use super::vaults::{Vault, barrel, groin, rib};

/// Blind arch on the ground floor of the enclosing walls.
const DOOR: Opening = Opening {
    x: 0.0,
    half: 0.85,
    rise: 0.85,
    sill: -0.1,
    spring: 2.35,
};

/// Blind arch on the gallery.
const DOOR2: Opening = Opening {
    x: 0.0,
    half: 0.55,
    rise: 0.55,
    sill: FLOOR2 - 0.3,
    spring: FLOOR2 + 1.95,
};

/// Builds everything outside the court's arcades, up to the ceilings.
pub fn build(scene: &mut Scene) {
    floors(scene);
    enclosing_walls(scene);
    niches(scene);
    vaults(scene);
    ceiling(scene);
}

fn floors(scene: &mut Scene) {
    let ground = cuboid(
        vec3(-OUTER_X - 0.05, -0.5, -OUTER_Z - 0.05),
        vec3(OUTER_X + 0.05, 0.0, OUTER_Z + 0.05),
    );
    scene.fixed("GroundFloor", ground, 20.0, Mat::Floor);
    let (ix, iz) = (COURT_X + 0.03, COURT_Z + 0.03);
    let (ox, oz) = (INNER_X + 0.1, INNER_Z + 0.1);
    let (y0, y1) = (FLOOR2 - 0.45, FLOOR2);
    let gallery = rect_ring(&[(ox, oz, y0), (ox, oz, y1), (ix, iz, y1), (ix, iz, y0)]).box_uv();
    scene.fixed("GalleryFloor", gallery, 20.0, Mat::GalleryFloor);
}

fn enclosing_walls(scene: &mut Scene) {
    // The brick core; the rendered inner leaf with its blind arches stands
    // in front of it and shows the brick in the depth of the arches.
    let (ix, iz) = (INNER_X + NICHE, INNER_Z + NICHE);
    let core = rect_ring(&[
        (OUTER_X, OUTER_Z, -0.45),
        (OUTER_X, OUTER_Z, PARAPET),
        (ix, iz, PARAPET),
        (ix, iz, -0.45),
    ])
    .box_uv();
    scene.fixed("EnclosingWall", core, 20.0, Mat::Brick);
    let coping = rect_ring(&[
        (OUTER_X + 0.10, OUTER_Z + 0.10, PARAPET - 0.03),
        (OUTER_X + 0.10, OUTER_Z + 0.10, PARAPET + 0.08),
        (OUTER_X + 0.02, OUTER_Z + 0.02, PARAPET + 0.15),
        (ix - 0.02, iz - 0.02, PARAPET + 0.15),
        (ix - 0.10, iz - 0.10, PARAPET + 0.08),
        (ix - 0.10, iz - 0.10, PARAPET - 0.03),
    ]);
    scene.fixed("Coping", coping, 25.0, Mat::Carved);

    let thick = NICHE + 0.03;
    let leaf = |half: f32, y0: f32, y1: f32, openings: &[Opening]| -> Soup {
        // Local z = 0 is the visible face, the leaf lies behind it.
        pierced_wall(
            Slab {
                min: vec3(-half, y0, -thick),
                max: vec3(half, y1, 0.0),
            },
            openings,
            20,
        )
    };
    let split = FLOOR2 - 0.2;
    let at = |o: Opening, xs: &[f32]| -> Vec<Opening> {
        xs.iter().map(|&x| Opening { x, ..o }).collect()
    };
    let bays: Vec<f32> = (0..BAYS).map(bay_x).collect();
    let ends = [-5.0, 0.0, 5.0];
    let (lx, lz) = (INNER_X + 0.1, INNER_Z + 0.1);
    let walls = [
        ("AisleWall", leaf(lx, -0.1, split, &at(DOOR, &bays)), true),
        (
            "PassageWall",
            leaf(lz, -0.1, split, &at(DOOR, &ends)),
            false,
        ),
        (
            "GalleryWall",
            leaf(lx, FLOOR2 - 0.3, CEILING + 0.1, &at(DOOR2, &bays)),
            true,
        ),
        (
            "GalleryEndWall",
            leaf(lz, FLOOR2 - 0.3, CEILING + 0.1, &at(DOOR2, &ends)),
            false,
        ),
    ];
    for (name, soup, long) in walls {
        let upper = name.starts_with("Gallery");
        let mat = if upper { Mat::Plaster } else { Mat::Ashlar };
        let id = scene.solid(name, soup, 30.0, mat);
        for side in [1.0_f32, -1.0] {
            if long {
                let yaw = if side > 0.0 { PI } else { 0.0 };
                scene.place(name, id, vec3(0.0, 0.0, side * INNER_Z), yaw);
            } else {
                scene.place(name, id, vec3(side * INNER_X, 0.0, 0.0), -side * 0.5 * PI);
            }
        }
    }
    // The attic over the ceiling and the wall above the roof need no arches:
    // the brick core shows there.
}

/// A batten door with iron straps, filling a blind arch; z = 0 is its front.
fn door(o: &Opening) -> (Soup, Soup) {
    let (w, h) = (o.half + 0.05, o.spring - o.sill);
    let mut wood = Soup::default();
    let planks = (o.half * 2.0 / 0.21).round() as usize;
    let pw = 2.0 * w / planks as f32;
    for i in 0..planks {
        let x0 = -w + pw * i as f32;
        // Planks stand a little unevenly proud, like old doors do.
        let z = 0.006 * ((i * 7) % 3) as f32;
        wood.add(
            chamfered(
                vec3(x0 + 0.002, o.sill, -0.08),
                vec3(x0 + pw - 0.002, o.spring + o.rise, z),
                0.006,
            )
            .grain_uv(Vec3::Y)
            .uv_moved(vec2(0.21, 0.37) * i as f32),
        );
    }
    let mut iron = Soup::default();
    for t in [0.22, 0.55, 0.88] {
        let y = o.sill + h * t;
        iron.add(chamfered(
            vec3(-o.half, y - 0.03, -0.01),
            vec3(o.half, y + 0.03, 0.022),
            0.004,
        ));
    }
    (wood, iron)
}

fn niches(scene: &mut Scene) {
    let band = scene.solid(
        "NicheArchivolt",
        archivolt(DOOR.half, DOOR.rise, 0.16, 0.06, 14),
        35.0,
        Mat::Carved,
    );
    let jamb = scene.solid(
        "NichePilaster",
        pier(0.07, 0.02, DOOR.spring, 0.36),
        30.0,
        Mat::Carved,
    );
    let band2 = scene.solid(
        "GalleryNicheArchivolt",
        archivolt(DOOR2.half, DOOR2.rise, 0.13, 0.05, 12),
        35.0,
        Mat::Carved,
    );
    let jamb2 = scene.solid(
        "GalleryNichePilaster",
        pier(0.06, 0.02, DOOR2.spring - FLOOR2, 0.30),
        30.0,
        Mat::Carved,
    );
    let leaf = |scene: &mut Scene, name: &str, o: &Opening| {
        let (wood, iron) = door(o);
        scene.mesh(name, vec![(wood, 20.0, Mat::Wood), (iron, 20.0, Mat::Iron)])
    };
    let door1 = leaf(scene, "Door", &DOOR);
    let door2 = leaf(scene, "GalleryDoor", &DOOR2);

    let mut spots: Vec<(f32, f32, f32, usize)> = Vec::new();
    for (s, side) in [1.0_f32, -1.0].into_iter().enumerate() {
        for i in 0..BAYS {
            let yaw = if side > 0.0 { PI } else { 0.0 };
            spots.push((bay_x(i), side * INNER_Z, yaw, i + s));
        }
        for (i, z) in [-5.0, 0.0, 5.0].into_iter().enumerate() {
            spots.push((side * INNER_X, z, -side * 0.5 * PI, i + 1));
        }
    }
    for (x, z, yaw, k) in spots {
        // Into the wall is away from the room.
        let (dx, dz) = (yaw.sin(), yaw.cos());
        let deep = NICHE - 0.04;
        let back = vec3(x - dx * deep, 0.0, z - dz * deep);
        scene.place("NicheArchivolt", band, vec3(x, DOOR.spring, z), yaw);
        scene.place(
            "GalleryNicheArchivolt",
            band2,
            vec3(x, DOOR2.spring, z),
            yaw,
        );
        for s in [-1.0, 1.0] {
            let off = s * (DOOR.half + 0.09);
            scene.place(
                "NichePilaster",
                jamb,
                vec3(x + dz * off, 0.0, z - dx * off),
                yaw,
            );
            let off = s * (DOOR2.half + 0.075);
            let p = vec3(x + dz * off, FLOOR2, z - dx * off);
            scene.place("GalleryNichePilaster", jamb2, p, yaw);
        }
        if k % 2 == 0 {
            scene.place("Door", door1, back, yaw);
        }
        if k % 2 == 1 {
            scene.place("GalleryDoor", door2, back, yaw);
        }
    }
}

fn vaults(scene: &mut Scene) {
    let top = FLOOR2 - 0.42 - SPRING;
    let aisle_mid = 0.5 * (AXIS_Z + GROUND_HALF + INNER_Z);
    let aisle_half = 0.5 * (INNER_Z - AXIS_Z - GROUND_HALF);
    let bay = scene.solid(
        "AisleVault",
        groin(&Vault {
            half_x: 0.5 * BAY - RIB_HALF,
            half_z: aisle_half,
            rise: VAULT_RISE,
            top,
        }),
        25.0,
        Mat::Plaster,
    );
    let pass_mid = 0.5 * (AXIS_X + GROUND_HALF + INNER_X);
    let pass_half = 0.5 * (INNER_X - AXIS_X - GROUND_HALF);
    // The corner bays lie between the rib on the long axis and the one at
    // the end arcade.
    let (cx0, cx1) = (AXIS_X + RIB_HALF, INNER_X);
    let (cz0, cz1) = (AXIS_Z + RIB_HALF, INNER_Z);
    let corner_bay = scene.solid(
        "CornerVault",
        groin(&Vault {
            half_x: 0.5 * (cx1 - cx0),
            half_z: 0.5 * (cz1 - cz0),
            rise: VAULT_RISE,
            top,
        }),
        25.0,
        Mat::Plaster,
    );
    let tunnel = scene.solid(
        "PassageVault",
        barrel(&Vault {
            half_x: pass_half,
            half_z: AXIS_Z - RIB_HALF,
            rise: VAULT_RISE - 0.1,
            top,
        }),
        25.0,
        Mat::Plaster,
    );
    let drop = 0.11;
    let aisle_rib = scene.solid(
        "AisleRib",
        rib(aisle_half - 0.10, VAULT_RISE - drop, RIB_HALF, top),
        30.0,
        Mat::Ashlar,
    );
    let pass_rib = scene.solid(
        "PassageRib",
        rib(pass_half - 0.10, VAULT_RISE - drop - 0.1, RIB_HALF, top),
        30.0,
        Mat::Ashlar,
    );
    let pilaster = scene.solid(
        "Pilaster",
        pier(RIB_HALF - 0.02, 0.12, SPRING + 0.01, 0.55),
        30.0,
        Mat::Carved,
    );
    let bracket = scene.solid(
        "Corbel",
        corbel(RIB_HALF + 0.03, 0.2, SPRING + 0.004),
        35.0,
        Mat::Carved,
    );

    for side in [1.0_f32, -1.0] {
        let z = side * aisle_mid;
        for i in 0..BAYS {
            scene.place("AisleVault", bay, vec3(bay_x(i), SPRING, z), 0.0);
        }
        for i in 0..=BAYS {
            let x = BAY * i as f32 - AXIS_X;
            scene.place("AisleRib", aisle_rib, vec3(x, SPRING, z), 0.5 * PI);
            scene.place("Pilaster", pilaster, vec3(x, 0.0, side * INNER_Z), 0.0);
        }
        scene.place(
            "PassageVault",
            tunnel,
            vec3(side * pass_mid, SPRING, 0.0),
            0.0,
        );
        for end in [1.0_f32, -1.0] {
            let x = end * pass_mid;
            scene.place("PassageRib", pass_rib, vec3(x, SPRING, side * AXIS_Z), 0.0);
            let p = vec3(end * INNER_X, 0.0, side * AXIS_Z);
            scene.place("Pilaster", pilaster, p, 0.5 * PI);
            let c = vec3(end * 0.5 * (cx0 + cx1), SPRING, side * 0.5 * (cz0 + cz1));
            scene.place("CornerVault", corner_bay, c, 0.0);
            // The passage side of the end wall and the aisle side of the
            // corner have no column: corbels carry the ribs there.
            let p = vec3(end * (AXIS_X + GROUND_HALF), 0.0, side * AXIS_Z);
            scene.place("Corbel", bracket, p, 0.5 * PI);
            let p = vec3(end * AXIS_X, 0.0, side * (AXIS_Z + GROUND_HALF));
            scene.place("Corbel", bracket, p, 0.0);
        }
    }
}

fn ceiling(scene: &mut Scene) {
    // Boarding over the gallery, on beams 0.8 m apart.
    let (ix, iz) = (AXIS_X, AXIS_Z);
    let (ox, oz) = (INNER_X + 0.1, INNER_Z + 0.1);
    let (y0, y1) = (CEILING, CEILING + 0.08);
    let boards = rect_ring(&[(ox, oz, y0), (ox, oz, y1), (ix, iz, y1), (ix, iz, y0)]).box_uv();
    scene.fixed("CeilingBoards", boards, 20.0, Mat::Wood);
    let beam = |x: f32, half: f32| {
        chamfered(
            vec3(x - 0.08, CEILING - 0.20, -half),
            vec3(x + 0.08, CEILING + 0.02, half),
            0.015,
        )
    };
    let span = 0.5 * (INNER_Z - AXIS_Z) + 0.02;
    let mut bay = Soup::default();
    for i in 0..4 {
        bay.add(
            beam((i as f32 - 1.5) * 0.8, span)
                .grain_uv(Vec3::Z)
                .uv_moved(vec2(0.0, 0.3 * i as f32)),
        );
    }
    let bay = scene.solid("CeilingBeams", bay, 20.0, Mat::Wood);
    let end_span = 0.5 * (INNER_X - AXIS_X) + 0.02;
    let mut end_bay = Soup::default();
    for i in 0..8 {
        end_bay.add(beam((i as f32 - 3.5) * 0.8, end_span).grain_uv(Vec3::Z));
    }
    let end_bay = scene.solid("EndCeilingBeams", end_bay, 20.0, Mat::Wood);
    for side in [1.0_f32, -1.0] {
        let z = side * 0.5 * (AXIS_Z + INNER_Z);
        for i in 0..BAYS {
            scene.place("CeilingBeams", bay, vec3(bay_x(i), 0.0, z), 0.0);
        }
        let x = side * 0.5 * (AXIS_X + INNER_X);
        scene.place("EndCeilingBeams", end_bay, vec3(x, 0.0, 0.0), 0.5 * PI);
    }
    // Wall plates along both edges hide the beam ends.
    let plate = |x: f32, z: f32, d: f32| {
        rect_ring(&[
            (x + d, z + d, CEILING - 0.26),
            (x + d, z + d, CEILING - 0.12),
            (x - d, z - d, CEILING - 0.12),
            (x - d, z - d, CEILING - 0.26),
        ])
    };
    scene.fixed("OuterPlate", plate(INNER_X, INNER_Z, 0.09), 20.0, Mat::Wood);
    let (px, pz) = (AXIS_X + UPPER_HALF, AXIS_Z + UPPER_HALF);
    scene.fixed("InnerPlate", plate(px, pz, 0.07), 20.0, Mat::Wood);
}
