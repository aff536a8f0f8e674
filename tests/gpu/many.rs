//! Many volumes, and many lamps: nobody is left in the dark because others came first.

use bevy::prelude::*;
use bevy_gi::{GiStatistics, prelude::*};

use crate::{
    common::{headless::Headless, scenes::stage::diffuse},
    support::{TECHNIQUES, app, camera, choose, material, mean, room, settle, show},
};

fn look_from(headless: &mut Headless, camera: Entity, eye: Vec3) {
    let mut entity = headless.app.world_mut().entity_mut(camera);
    entity.get_mut::<Transform>().unwrap().translation = eye;
}

/// Twelve closed rooms with a volume each: the camera is lit by the one that it is in, whichever that is.
#[test]
fn any_number_of_volumes_light_a_camera() {
    let mut headless = app();
    show(&mut headless, GiView::Indirect);
    let white = material(&mut headless, diffuse([0.6; 3]));
    let panel = StandardMaterial {
        emissive: LinearRgba::rgb(200.0, 200.0, 200.0),
        ..diffuse([0.0; 3])
    };
    let panel = material(&mut headless, panel);
    // Whole cells of the coarsest level apart, so that all lie alike in their grids.
    let rooms: Vec<_> = (0..12).map(|i| Vec3::X * (4.8 * i as f32)).collect();
    for at in &rooms {
        room(&mut headless, *at - 1.5, *at + 1.5, 0.3, &white);
        let (min, max) = (Vec3::new(-0.6, 1.2, -0.6), Vec3::new(0.6, 1.45, 0.6));
        crate::support::slab(&mut headless, *at + min, *at + max, &panel);
        headless.app.world_mut().spawn((
            GiVolume::new(Vec3::splat(4.0)).with_resolution(32),
            ProbeSet::default().with_resolution(8),
            Transform::from_translation(*at),
        ));
    }
    let eye = Vec3::new(-1.2, 0.0, 1.2);
    let (camera, target) = camera(
        &mut headless,
        UVec2::new(48, 32),
        eye,
        Vec3::new(0.5, -0.3, -0.5),
        70.0,
    );
    for technique in TECHNIQUES {
        choose(&mut headless, technique);
        let light = [0, 1, 6, 11].map(|i: usize| {
            look_from(&mut headless, camera, rooms[i] + eye);
            settle(&mut headless, 12);
            mean(&headless.picture(&target))
        });
        println!("{technique:?}: {light:.2?} nits");
        let [least, most] = [f32::min, f32::max].map(|f| light.into_iter().reduce(f).unwrap());
        // The same room, in the same place of its grid: what differs is rounding, and the noise of rays.
        assert!(least > 0.97 * most, "{technique:?}: {light:?}");
    }
}

/// Two hundred lamps in 25 closed rooms, far more than there are maps of full size: every room is as bright as its
/// twins, wherever the camera is.
#[test]
fn two_hundred_lamps_light_25_rooms_alike() {
    for technique in TECHNIQUES {
        let mut headless = app();
        choose(&mut headless, technique);
        show(&mut headless, GiView::Indirect);
        let white = material(&mut headless, diffuse([0.6; 3]));
        let rooms: Vec<_> = (0..25)
            .map(|i| Vec3::new((i % 5) as f32, 0.0, (i / 5) as f32) * 3.0)
            .collect();
        for at in &rooms {
            room(&mut headless, *at - 1.2, *at + 1.2, 0.3, &white);
            for i in 0..8 {
                let lamp = PointLight {
                    intensity: 70.0 + 10.0 * i as f32,
                    range: 10.0,
                    shadow_maps_enabled: false,
                    ..default()
                };
                let angle = i as f32 * std::f32::consts::FRAC_PI_4;
                let place = Vec3::new(0.7 * angle.cos(), 0.4, 0.7 * angle.sin());
                headless
                    .app
                    .world_mut()
                    .spawn((lamp, Transform::from_translation(*at + place)));
            }
        }
        headless.app.world_mut().spawn((
            // Three cells of the hints' lattice a room, so that all lie alike in it.
            GiVolume {
                fade: 0.0,
                ..GiVolume::new(Vec3::new(15.0, 3.6, 15.0)).with_resolution(60)
            },
            ProbeSet::default().with_resolution(15),
            Transform::from_xyz(6.0, 0.0, 6.0),
        ));
        let (eye, look) = (Vec3::new(-1.0, 0.9, 1.0), Vec3::new(0.5, -0.3, -0.5));
        let (camera, target) = camera(&mut headless, UVec2::new(48, 32), eye, look, 70.0);
        settle(&mut headless, 72);
        // As the camera comes, maps are drawn in more texels, in turns, and in each room 164 other virtual point lights are
        // chosen: a tenth of noise, where there were 26 % before what is known of the same light counted on.
        let light = [0, 7, 18, 24, 0].map(|i: usize| {
            look_from(&mut headless, camera, rooms[i] + eye);
            headless.steps(20);
            mean(&headless.picture(&target))
        });
        let statistics = headless.app.world().resource::<GiStatistics>();
        println!("{technique:?}: {light:.3?} nits, {:?}", statistics.counts());
        assert_eq!(statistics.warnings(), Vec::<String>::new());
        let [least, most] = [f32::min, f32::max].map(|f| light.into_iter().reduce(f).unwrap());
        assert!(
            least > 0.85 * most && least > 0.0,
            "{technique:?}: {light:?}"
        );
    }
}
