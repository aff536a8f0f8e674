//! Memory and counts as Bevy's diagnostics, for whatever overlays and loggers an app has.
//!
//! | path | value |
//! |---|---|
//! | `gi/memory/<resource>` | bytes on the GPU |
//! | `gi/memory/total` | all of them |
//! | `gi/count/<what>` | a count of [`GiStatistics::counts`] |
//!
//! Times come from Bevy's `RenderDiagnosticsPlugin`, where an app has it: each pass as
//! `render/gi/<technique, scene or apply>/<pass>/elapsed_gpu` and `elapsed_cpu`, milliseconds.

use std::{collections::HashMap, time::Duration};

use bevy::{
    app::{App, Last, Plugin},
    diagnostic::{Diagnostic, DiagnosticMeasurement, DiagnosticPath, DiagnosticsStore},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    platform::time::Instant,
    time::common_conditions::on_timer,
};

use super::statistics::GiStatistics;

/// How often they are measured.
const INTERVAL: Duration = Duration::from_millis(250);

pub(crate) struct DiagnosticsPlugin;

impl Plugin for DiagnosticsPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            Last,
            publish
                .run_if(resource_exists::<DiagnosticsStore>)
                .run_if(on_timer(INTERVAL)),
        );
    }
}

fn publish(
    statistics: Res<GiStatistics>,
    mut store: ResMut<DiagnosticsStore>,
    mut paths: Local<HashMap<String, DiagnosticPath>>,
) {
    let time = Instant::now();
    let mut measure = |name: String, suffix: &'static str, value: u64| {
        let path = paths
            .entry(name)
            .or_insert_with_key(|name| DiagnosticPath::new(name.clone()));
        if store.get(path).is_none() {
            store.add(Diagnostic::new(path.clone()).with_suffix(suffix));
        }
        if let Some(diagnostic) = store.get_mut(path) {
            let value = value as f64;
            diagnostic.add_measurement(DiagnosticMeasurement { time, value });
        }
    };
    let memory = statistics.memory();
    measure("gi/memory/total".into(), " B", memory.values().sum());
    for (name, bytes) in memory {
        measure(format!("gi/memory/{name}"), " B", bytes);
    }
    for (name, count) in statistics.counts() {
        measure(format!("gi/count/{name}"), "", count);
    }
}
