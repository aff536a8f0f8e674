//! Temporary.
use std::collections::BTreeMap;

use bevy::prelude::*;
use bevy_gi::prelude::*;

use crate::{
    common::{
        headless::Headless,
        scenes::{cornell, stage::diffuse},
    },
    support::{CONES, HINTS, TECHNIQUES, app, camera, choose, material, room, spawn_cornell},
};

fn cpu() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<_> = stat
        .rsplit(')')
        .next()
        .unwrap()
        .split_whitespace()
        .collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}
fn maps() -> usize {
    std::fs::read_to_string("/proc/self/maps")
        .unwrap()
        .lines()
        .count()
}
fn report(name: &str, headless: &mut Headless, start: f64) {
    let mut last = start;
    println!("{name}: before {:.2} cpu {} maps", cpu() - start, maps());
    assert!(headless.wait_until(|_| true));
    println!("{name}: wait {:.2} cpu {} maps", cpu() - last, maps());
    headless.app.world_mut().resource_mut::<GiHistory>().reset();
    last = cpu();
    for (from, n) in [(0, 4), (4, 4), (8, 16), (24, 16), (40, 40)] {
        let mut sums = BTreeMap::<String, f64>::new();
        headless.steps(n);
        for (path, ms) in &headless.passes_ms {
            if path.ends_with("elapsed_gpu") {
                *sums.entry(path.clone()).or_default() += ms.iter().sum::<f64>() / n as f64;
            }
        }
        let now = cpu();
        println!(
            "{name}: frames {from}+{n}: {:.1} ms cpu a frame",
            1000.0 * (now - last) / n as f64
        );
        last = now;
        let mut sums: Vec<_> = sums.into_iter().filter(|s| s.1 > 0.5).collect();
        sums.sort_by(|a, b| b.1.total_cmp(&a.1));
        for (path, ms) in sums.iter().take(14) {
            println!("      {ms:7.1} {path}");
        }
        last = cpu().max(last);
    }
}

#[test]
fn a_debug() {
    for technique in [CONES, HINTS, CONES] {
        let start = cpu();
        let mut headless = app();
        choose(&mut headless, technique);
        let white = material(&mut headless, diffuse([0.7; 3]));
        room(
            &mut headless,
            Vec3::splat(-2.0),
            Vec3::splat(2.0),
            0.3,
            &white,
        );
        camera(
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
        world.spawn(GiVolume::new(Vec3::splat(5.0)).with_resolution(64));
        report(&format!("debug {technique:?}"), &mut headless, start);
    }
}
#[test]
fn b_cornell() {
    for technique in TECHNIQUES {
        let start = cpu();
        let mut headless = app();
        choose(&mut headless, technique);
        spawn_cornell(&mut headless);
        let view = cornell::view();
        camera(
            &mut headless,
            UVec2::new(320, 184),
            view.eye,
            view.look,
            view.fov,
        );
        report(&format!("cornell {technique:?}"), &mut headless, start);
    }
}
#[test]
fn c_empty() {
    for _ in 0..2 {
        let start = cpu();
        let mut headless = app();
        camera(
            &mut headless,
            UVec2::new(96, 64),
            Vec3::new(0.0, 0.0, 1.8),
            Vec3::ZERO,
            60.0,
        );
        report("empty", &mut headless, start);
    }
}

#[test]
fn d_leak() {
    let rss = || {
        let s = std::fs::read_to_string("/proc/self/status").unwrap();
        s.lines()
            .find(|l| l.starts_with("VmRSS"))
            .unwrap()
            .to_string()
    };
    for technique in TECHNIQUES {
        for i in 0..6 {
            let mut headless = app();
            choose(&mut headless, technique);
            let white = material(&mut headless, diffuse([0.7; 3]));
            room(
                &mut headless,
                Vec3::splat(-2.0),
                Vec3::splat(2.0),
                0.3,
                &white,
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
            world.spawn((
                GiVolume::new(Vec3::splat(5.0)).with_resolution(64),
                ProbeSet::default().with_resolution(8),
            ));
            headless.steps(6);
            println!("{technique:?} {i} after 6: {} maps {}", rss(), maps());
            if i > 3 {
                headless.steps(50);
                println!("{technique:?} {i} after 56: {} maps {}", rss(), maps());
                for _ in 0..20 {
                    headless.picture(&target);
                }
                println!(
                    "{technique:?} {i} after 20 pictures: {} maps {}",
                    rss(),
                    maps()
                );
            }
            let statistics = headless.app.world().resource::<bevy_gi::GiStatistics>();
            println!("   {} MB", statistics.memory().values().sum::<u64>() >> 20);
        }
    }
}
