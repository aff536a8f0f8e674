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
    let memory = statistics.memory();
    // What is gone is 0, not what it was.
    let mut values: HashMap<String, u64> = paths.keys().map(|name| (name.clone(), 0)).collect();
    values.insert("gi/memory/total".into(), memory.values().sum());
    values.extend(
        memory
            .into_iter()
            .map(|(name, bytes)| (format!("gi/memory/{name}"), bytes)),
    );
    let counts = statistics.counts().into_iter();
    values.extend(counts.map(|(name, count)| (format!("gi/count/{name}"), count)));
    for (name, value) in values {
        let suffix = if name.starts_with("gi/memory") {
            " B"
        } else {
            ""
        };
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
    }
}
