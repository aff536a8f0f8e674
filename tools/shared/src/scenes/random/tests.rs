//! What holds for every scene that is drawn, without a GPU.

use bevy::prelude::*;
use bevy_gi::prelude::*;

use super::{Kind, Lamp, Plan, RandomScene, Shape, Source, Surface, Variant, view::CLEARANCE};

/// Scenes of all kinds.
fn scenes() -> impl Iterator<Item = RandomScene> {
    let kinds = Kind::ALL.into_iter();
    kinds.flat_map(|kind| {
        (0..40).map(move |seed| RandomScene {
            kind,
            ..RandomScene::new(seed)
        })
    })
}

fn plans(variant: Variant) -> impl Iterator<Item = Plan> {
    scenes().map(move |scene| Plan::new(scene.variant(variant)))
}

#[test]
fn the_same_seed_draws_the_same_scene() {
    for scene in scenes() {
        assert_eq!(Plan::new(scene), Plan::new(scene));
    }
    let (one, two) = (RandomScene::series(1, 20), RandomScene::series(2, 20));
    assert_eq!(one[..5], RandomScene::series(1, 5));
    assert!(one.iter().all(|scene| !two.contains(scene)));
    for kind in Kind::ALL {
        let all = RandomScene::series(1, 60);
        assert!(all.iter().any(|scene| scene.kind == kind), "{kind:?}");
    }
}

#[test]
fn names_are_those_of_their_scenes() {
    for scene in scenes() {
        for variant in Variant::ALL {
            let scene = scene.variant(variant);
            assert_eq!(RandomScene::find(&scene.to_string()), Some(Ok(scene)));
        }
    }
    assert_eq!(RandomScene::find("cornell"), None);
    for name in ["random:", "random:x", "random:1:palace"] {
        assert!(matches!(RandomScene::find(name), Some(Err(_))), "{name}");
    }
}

#[test]
fn the_camera_stands_free() {
    let mut tight = 0;
    for variant in Variant::ALL {
        for plan in plans(variant) {
            let eye = plan.stand.eye;
            let distances = plan.pieces.iter().map(|piece| piece.distance(eye));
            let nearest = distances.fold(f32::INFINITY, f32::min);
            // Where everything is full of furniture, what was kept free is 0.45 m to each side.
            assert!(nearest > 0.05, "{}: {nearest} m", plan.scene);
            tight += usize::from(nearest < CLEARANCE);
            assert!((1.4..=1.8).contains(&eye.y), "{}", plan.scene);
            assert!(plan.stand.look.distance(eye) > 0.5, "{}", plan.scene);
        }
    }
    assert!(
        tight < 30,
        "{tight} cameras of 600 stand close to something"
    );
}

#[test]
fn every_mesh_is_inside_of_the_volume() {
    for plan in plans(Variant::Lit) {
        let (min, max) = plan.bounds();
        let (volume, at) = GiVolume::around(min, max, 128);
        let half = 0.5 * volume.extent;
        for piece in &plan.pieces {
            for corner in piece.corners() {
                let corner = plan.place.transform_point(corner);
                let inside = (corner - at.translation).abs().cmple(half).all();
                assert!(inside, "{}: {corner}", plan.scene);
            }
        }
        let size = (max - min).max_element();
        assert!((3.0..40.0).contains(&size), "{}: {size} m", plan.scene);
    }
}

#[test]
fn materials_are_real_ones() {
    for plan in plans(Variant::Lit) {
        for piece in &plan.pieces {
            let finish = piece.finish;
            assert!(finish.albedo() < 1.0, "{}: {finish:?}", plan.scene);
            if finish.nits != [0.0; 3] {
                continue;
            }
            let ranges = finish.surface.ranges();
            let [dark, light] = ranges.color;
            for (color, (dark, light)) in finish.color.iter().zip(dark.iter().zip(light)) {
                let is_real = *color > dark - 1e-5 && *color < light + 1e-5;
                assert!(is_real, "{}: {finish:?}", plan.scene);
            }
            assert_eq!(finish.metallic, ranges.metallic);
            assert!((0.4..=0.6).contains(&finish.reflectance));
            assert!((0.1..=1.0).contains(&finish.roughness));
            let is_card = matches!(piece.shape, Shape::Card(_));
            assert_eq!(is_card, finish.surface == Surface::Leaves);
        }
    }
}

#[test]
fn pieces_have_a_size_and_walls_are_of_all_thicknesses() {
    for plan in plans(Variant::Lit) {
        for piece in &plan.pieces {
            let half = piece.shape.half();
            let flat = matches!(piece.shape, Shape::Card(_));
            let least = if flat {
                half.xy().min_element()
            } else {
                half.min_element()
            };
            assert!(least > 1e-4, "{}: {piece:?}", plan.scene);
            assert!(piece.at.is_finite() && piece.turn.is_normalized());
        }
    }
}

#[test]
fn every_scene_has_light() {
    for plan in plans(Variant::Lit) {
        let shines = plan.pieces.iter().any(|p| p.finish.nits != [0.0; 3]);
        let is_lit = shines || !plan.lamps.is_empty() || plan.sky.is_some();
        assert!(is_lit, "{}", plan.scene);
        assert!((-6.0..18.0).contains(&plan.ev100), "{}", plan.scene);
        let lights = plan.lamps.len();
        assert!(lights <= 5, "{}: {lights}", plan.scene);
    }
}

#[test]
fn in_a_furnace_every_surface_is_the_same() {
    for plan in plans(Variant::Furnace) {
        assert!(plan.lamps.is_empty());
        assert_eq!(plan.sky, Some([super::FURNACE_NITS; 3]));
        for piece in &plan.pieces {
            assert_eq!(piece.finish.color, [0.5; 3]);
            assert_eq!(piece.finish.nits, [0.5 * super::FURNACE_NITS; 3]);
            assert_eq!(piece.finish.reflectance, 0.0);
        }
    }
}

/// No ray from the camera gets out of a sealed building.
#[test]
fn what_is_sealed_has_no_opening() {
    let lit_by_sun = |lamp: &Lamp| matches!(lamp.source, Source::Sun { .. });
    for plan in plans(Variant::Sealed).filter(|plan| plan.has_roof) {
        assert!(plan.lamps.iter().all(lit_by_sun));
        assert!(plan.sky.is_some() && plan.outside_nits > 0.0);
        assert!(plan.pieces.iter().all(|p| p.finish.nits == [0.0; 3]));
        for i in 0..200 {
            // Directions of a spiral over the sphere.
            let y = 1.0 - (i as f32 + 0.5) / 100.0;
            let across = Vec2::from_angle(2.399_963 * i as f32) * (1.0 - y * y).sqrt();
            let ray = Vec3::new(across.x, y, across.y);
            let mut hits = plan
                .pieces
                .iter()
                .filter_map(|p| p.hit(plan.stand.eye, ray));
            assert!(hits.next().is_some(), "{}: {ray}", plan.scene);
        }
    }
}
