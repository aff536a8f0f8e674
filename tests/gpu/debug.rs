//! Debug views: each draws something, and what it draws is what it says.

use bevy::{diagnostic::DiagnosticsStore, prelude::*};
use bevy_gi::{GiSlice, GiStatistics, GiView, HintView, RadianceHintsDebugSettings, prelude::*};

use crate::{
    common::{
        headless::{Headless, Picture},
        scenes::stage::diffuse,
    },
    shared::SharedApp,
    support::{CONES, HINTS, app, assert_sane, camera, choose, material, room, settle},
};

/// Frames until light rests.
const RESTS: u32 = 26;
/// Frames until the history of pictures is full as well.
const FULL: u32 = 70;

/// A white room with one red wall behind, a lamp, and a camera that looks at that wall; after so many frames.
fn scene(frames: u32) -> (SharedApp, Handle<Image>) {
    let mut headless = app();
    let white = material(&mut headless, diffuse([0.7; 3]));
    let red = material(&mut headless, diffuse([0.6, 0.1, 0.05]));
    let (min, max) = (Vec3::splat(-2.0), Vec3::splat(2.0));
    room(&mut headless, min, max, 0.3, &white);
    crate::support::slab(
        &mut headless,
        Vec3::new(-2.0, -2.0, -2.0),
        Vec3::new(2.0, 2.0, -1.7),
        &red,
    );
    let (_, target) = camera(
        &mut headless,
        UVec2::new(96, 64),
        Vec3::new(0.0, 0.0, 1.8),
        Vec3::ZERO,
        60.0,
    );
    let world = headless.app.world_mut();
    world.spawn((
        PointLight {
            intensity: 3000.0,
            range: 50.0,
            shadow_maps_enabled: true,
            ..default()
        },
        Transform::from_xyz(0.0, 1.0, 0.5),
    ));
    let volume = GiVolume::new(Vec3::splat(5.0)).with_resolution(64);
    world.spawn((volume, ProbeSet::default().with_resolution(12)));
    settle(&mut headless, frames);
    (headless, target)
}

fn show(
    headless: &mut Headless,
    target: &Handle<Image>,
    change: impl FnOnce(&mut GiDebugSettings),
) -> Picture {
    change(&mut headless.app.world_mut().resource_mut::<GiDebugSettings>());
    headless.steps(3);
    let picture = headless.picture(target);
    assert_sane(&picture, "a debug view");
    assert_eq!(headless.pipeline_errors(), Vec::<String>::new());
    picture
}

fn center(picture: &Picture) -> Vec3 {
    let at = picture.size / 2;
    Vec3::from_slice(&picture.pixels[(at.y * picture.size.x + at.x) as usize][..3])
}

/// A floor at the foot of a long wall sees half of the sky, and all of it far away from it.
#[test]
fn ambient_occlusion_is_what_a_wall_leaves_of_the_sky() {
    let mut headless = app();
    let white = material(&mut headless, diffuse([0.7; 3]));
    let slab = crate::support::slab;
    let (far, height) = (6.0, 3.0);
    slab(
        &mut headless,
        Vec3::new(-far, -0.5, -far),
        Vec3::new(far, 0.0, far),
        &white,
    );
    slab(
        &mut headless,
        Vec3::new(-far, 0.0, -far),
        Vec3::new(0.0, height, far),
        &white,
    );
    let world = headless.app.world_mut();
    world.spawn((
        GiVolume::new(Vec3::new(13.0, 7.0, 13.0)).with_resolution(128),
        Transform::from_xyz(0.0, 2.5, 0.0),
    ));
    world.resource_mut::<GiDebugSettings>().view = GiView::AmbientOcclusion;
    // No light is looked at.
    world.resource_mut::<VoxelConeTracingSettings>().bounces = 0;
    for x in [0.5_f32, 1.5, 4.5] {
        let at = Vec3::new(x, 0.0, 0.0);
        let (eye, target) = camera(
            &mut headless,
            UVec2::new(32, 32),
            at + Vec3::new(0.0, 1.0, 0.01),
            at,
            10.0,
        );
        settle(&mut headless, 4);
        let open = center(&headless.picture(&target)).x;
        // The part of the cosine-weighted hemisphere below the edge of an endless wall.
        let expected = 1.0 - 0.5 * (1.0 - x / x.hypot(height));
        assert!(
            (open - expected).abs() < 0.08,
            "{x} m: {open}, not {expected}"
        );
        headless.app.world_mut().despawn(eye);
    }
}

#[test]
fn views_show_what_they_say() {
    let (mut headless, target) = scene(FULL);
    let mut view = |view| show(&mut headless, &target, |debug| debug.view = view);
    let near = |a: Vec3, b: Vec3, tolerance: f32, what: &str| {
        assert!(
            (a - b).abs().max_element() < tolerance,
            "{what}: {a}, not {b}"
        );
    };
    let red = Vec3::new(0.6, 0.1, 0.05);
    // The G-buffer holds 8 bits, sRGB.
    near(center(&view(GiView::Albedo)), red, 0.02, "albedo");
    near(
        center(&view(GiView::Normal)),
        Vec3::new(0.5, 0.5, 1.0),
        0.02,
        "normal",
    );
    near(
        center(&view(GiView::Roughness)),
        Vec3::splat(0.65),
        0.01,
        "roughness",
    );
    near(
        center(&view(GiView::Occlusion)),
        Vec3::ONE,
        1e-3,
        "occlusion",
    );
    near(center(&view(GiView::Coverage)), Vec3::ONE, 1e-3, "coverage");
    // Nothing moves.
    let still = Vec3::new(0.5, 0.5, 0.5);
    near(center(&view(GiView::Motion)), still, 1e-3, "motion");
    near(center(&view(GiView::History)), Vec3::ONE, 0.2, "history");
    // Every fourth pixel along each axis is gathered, and the wall is flat.
    let gather = view(GiView::Gather);
    let white = gather.pixels.iter().filter(|p| p[..3] == [1.0; 3]).count();
    assert_eq!(white, 96 * 64 / 16, "gathered pixels");
    let other = center(&gather);
    assert!(other.y > 3.0 * other.x || other == Vec3::ONE, "{other}");

    // Voxels: 8 bits linear; the wall's edges are not in the middle of the picture.
    let albedo = center(&view(GiView::VoxelAlbedo));
    assert!(
        (albedo - red).abs().max_element() < 0.02
            || (albedo / 0.75 - red).abs().max_element() < 0.02,
        "voxel albedo: {albedo}"
    );
    let normal = center(&view(GiView::VoxelNormal));
    let facing = normal.z / normal.x.max(normal.y);
    assert!((1.8..2.2).contains(&facing), "voxel normal: {normal}");
    near(
        center(&view(GiView::VoxelEmission)),
        Vec3::ZERO,
        1e-6,
        "emission",
    );
    let opacity = center(&view(VoxelConeTracing::OPACITY)).x;
    assert!(opacity > 0.5, "voxel opacity: {opacity}");
    // Direct and bounced light of a red wall is red.
    let radiance = center(&view(VoxelConeTracing::RADIANCE));
    assert!(radiance.x > 2.0 * radiance.y, "voxel radiance: {radiance}");
    let maps = view(GiView::ShadowMaps);
    let bright = maps.pixels.iter().filter(|p| p[0] > 0.05).count();
    assert!(bright > 96 * 64 / 4, "shadow maps: {bright} pixels");
}

/// Surfaces in voxels are the scene's: they are there for every technique.
#[test]
fn voxels_are_shown_with_any_technique() {
    let (mut headless, target) = scene(RESTS);
    let mut shown = |technique| {
        let world = headless.app.world_mut();
        world.resource_mut::<GiSettings>().technique = technique;
        headless.steps(8);
        show(&mut headless, &target, |debug| {
            debug.view = GiView::VoxelAlbedo
        })
    };
    let with_cones = shown(CONES);
    let with_hints = shown(HINTS);
    assert!(center(&with_hints).x > 0.4, "{}", center(&with_hints));
    assert_eq!(with_cones.pixels, with_hints.pixels);
}

/// A cut through a volume, at any level: occupied cells are shown, empty ones are dark.
#[test]
fn slices_cut_at_every_level() {
    let (mut headless, target) = scene(RESTS);
    for level in 0..=6 {
        let picture = show(&mut headless, &target, |debug| {
            debug.view = GiView::VoxelAlbedo;
            debug.voxel_level = level;
            debug.slice = GiSlice::Z;
            // Far enough from the camera for the walls to be in sight.
            debug.slice_at = 0.3;
        });
        // The middle of the room is empty, at least in small cells; its walls are white.
        if level < 4 {
            assert!(center(&picture).max_element() < 0.1, "level {level}");
        }
        let walls = picture.pixels.iter().filter(|p| p[0] > 0.3).count();
        assert!(walls > 100, "level {level}: {walls} pixels of walls");
    }
}

/// Probes are spheres in the picture, lit by what arrives there.
#[test]
fn probes_and_volumes_are_drawn_into_the_picture() {
    let (mut headless, target) = scene(FULL);
    let plain = show(&mut headless, &target, |_| {});
    let probes = show(&mut headless, &target, |debug| {
        debug.show_ambient_cubes = true
    });
    let differs = |a: &Picture, b: &Picture| {
        let pairs = a.pixels.iter().zip(&b.pixels);
        pairs
            .filter(|(a, b)| (a[0] - b[0]).abs() > 0.1 * a[0])
            .count()
    };
    let changed = differs(&plain, &probes);
    assert!(
        (30..3000).contains(&changed),
        "{changed} pixels show probes"
    );
    let volumes = show(&mut headless, &target, |debug| {
        debug.show_ambient_cubes = false;
        debug.show_volumes = true;
    });
    let changed = differs(&plain, &volumes);
    assert!(changed > 30, "{changed} pixels show lines");
    let again = show(&mut headless, &target, |debug| debug.show_volumes = false);
    assert!(differs(&plain, &again) < 30, "the spheres stay");
}

/// Hints as spheres, in parts of their light and as numbers; what is picked, its taps, and its samples in the maps.
#[test]
fn hints_show_what_they_are_made_of() {
    let (mut headless, target) = scene(1);
    choose(&mut headless, HINTS);
    settle(&mut headless, 24);
    let plain = show(&mut headless, &target, |_| {});
    // Brightness of the pixels that differ from the picture without, and how many those are.
    let mut spheres = |change: &dyn Fn(&mut GiDebugSettings, &mut RadianceHintsDebugSettings)| {
        let world = headless.app.world_mut();
        let mut own = world.resource::<RadianceHintsDebugSettings>().clone();
        change(&mut world.resource_mut::<GiDebugSettings>(), &mut own);
        world.insert_resource(own);
        let picture = show(&mut headless, &target, |_| {});
        let pairs = picture.pixels.iter().zip(&plain.pixels);
        let differs = pairs.filter(|(a, b)| {
            let apart = (0..3).map(|c| (a[c] - b[c]).abs() / b[c].max(1e-3));
            apart.fold(0.0, f32::max) > 0.1
        });
        let sums = differs.map(|(a, _)| Vec3::from_slice(&a[..3]));
        let (sum, count) = sums.fold((Vec3::ZERO, 0), |(sum, n), p| (sum + p, n + 1));
        (sum / count.max(1) as f32, count)
    };
    let (light, many) = spheres(&|debug, own| {
        own.show = true;
        // The layer in the middle of the room.
        debug.slice = GiSlice::Z;
        debug.slice_at = 0.5;
    });
    assert!(many > 100, "{many} pixels of spheres");
    let mut part = |hint_view| spheres(&|_, own| own.view = hint_view).0;
    let first = part(HintView::FirstBounce);
    let second = part(HintView::SecondBounce);
    assert!(part(HintView::Emission).max_element() < 1e-3);
    let sum = first + second;
    println!("{light} of all, {first} first and {second} second bounce");
    assert!(
        (sum / light - 1.0).abs().max_element() < 0.1,
        "{sum}, not {light}"
    );
    // Numbers are numbers, whatever the exposure.
    let (nearest, farthest) = (part(HintView::Nearest), part(HintView::Farthest));
    assert!(nearest.max_element() < farthest.max_element() && farthest.max_element() <= 1.0);
    let confidence = part(HintView::Confidence);
    assert!(
        (nearest + confidence - 1.0).abs().max_element() < 0.1,
        "{confidence}"
    );
    let seen = part(HintView::Visibility);
    assert!((0.0..=1.0).contains(&seen.x), "{seen}");

    let (_, taps) = spheres(&|debug, own| {
        own.show = false;
        debug.show_picked = true;
        debug.pick_from = Vec3::new(0.0, 0.0, 1.8);
        debug.pick_to = Vec3::new(0.0, -0.5, -1.0);
    });
    assert!((4..600).contains(&taps), "{taps} pixels of taps");
    let mut marks = |show_picked| {
        let picture = show(&mut headless, &target, |debug| {
            debug.show_picked = show_picked;
            debug.view = GiView::RsmDepth;
        });
        let marks = picture.pixels.iter();
        marks.filter(|p| p[0] > 0.9 && p[1] < 0.2).count()
    };
    assert_eq!(marks(false), 0);
    assert!(marks(true) > 20, "samples are marked");
}

/// Freezing keeps the voxels, whatever moves.
#[test]
fn frozen_captures_stay() {
    let (mut headless, _) = scene(RESTS);
    let moved = |headless: &mut Headless| {
        let world = headless.app.world_mut();
        let mut meshes = world.query_filtered::<&mut Transform, With<Mesh3d>>();
        meshes.iter_mut(world).next().unwrap().translation.y += 0.5;
        headless.steps(4);
        let passes = headless.passes_ms.iter();
        let captures = passes.filter(|(name, _)| name.contains("gi/scene/voxelize/"));
        captures
            .flat_map(|(_, ms)| ms)
            .filter(|ms| **ms > 0.0)
            .count()
    };
    assert!(moved(&mut headless) > 0, "a mesh that moves is captured");
    let mut settings = headless.app.world_mut().resource_mut::<GiCaptureSettings>();
    settings.freeze = true;
    // The first frame has what was measured before.
    headless.steps(4);
    assert_eq!(moved(&mut headless), 0, "nothing is captured");
}

/// Memory and counts are diagnostics of Bevy's.
#[test]
fn memory_and_counts_are_diagnostics() {
    let (mut headless, _) = scene(RESTS);
    // Figures of the GPU come some frames late.
    headless.steps(8);
    let statistics = headless.app.world().resource::<GiStatistics>().clone();
    let store = headless.app.world().resource::<DiagnosticsStore>();
    let value = |path: &str| {
        let found = store.iter().find(|d| d.path().as_str() == path);
        found
            .and_then(|d| d.value())
            .unwrap_or_else(|| panic!("{path} is missing"))
    };
    let total: u64 = statistics.memory().values().sum();
    assert_eq!(value("gi/memory/total"), total as f64);
    assert!(value("gi/count/scene/voxels_occupied") > 1000.0);
    for (name, bytes) in statistics.memory() {
        assert_eq!(value(&format!("gi/memory/{name}")), bytes as f64);
    }
    assert!(value("render/gi/vct/gather/elapsed_gpu") > 0.0);
}
