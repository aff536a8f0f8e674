//! What global illumination costs: times over the last seconds, memory, counts, warnings.

use std::collections::{BTreeMap, VecDeque};

use bevy::{
    diagnostic::{DiagnosticsStore, FrameCount},
    ecs::prelude::*,
    platform::time::Instant,
    render::renderer::RenderAdapterInfo,
};
use bevy_egui::egui;
use egui_plot::{GridInput, GridMark, Line, Plot, PlotPoints};

use crate::{GiSettings, GiStatistics, GiSupport, GiTechnique, GiTechniques, last_frame};

/// Frames that are remembered.
const FRAMES: usize = 240;

/// Milliseconds of the last frames, while the panel is open.
#[derive(Resource, Default)]
pub(super) struct CostHistory {
    /// Whole frames, by the wall clock.
    frame: VecDeque<f64>,
    passes: BTreeMap<String, PassHistory>,
}

#[derive(Default)]
struct PassHistory {
    gpu: VecDeque<f64>,
    cpu: VecDeque<f64>,
}

fn push(values: &mut VecDeque<f64>, value: f64) {
    values.push_back(value);
    if values.len() > FRAMES {
        values.pop_front();
    }
}

fn mean(values: &VecDeque<f64>) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Remembers what Bevy's diagnostics measured since the last frame.
pub(super) fn record(
    mut history: ResMut<CostHistory>,
    diagnostics: Res<DiagnosticsStore>,
    settings: Res<GiSettings>,
    mut before: Local<Option<GiTechnique>>,
    count: Option<Res<FrameCount>>,
    mut last_seen: Local<Option<(Instant, u32)>>,
) {
    // What another technique cost is no part of the sum.
    if before.replace(settings.technique) != Some(settings.technique) {
        history.passes.clear();
    }
    let now = Instant::now();
    let count = count.map_or(0, |count| count.0);
    // Not the first one after the panel was closed.
    let last = last_seen.replace((now, count));
    let Some((last, _)) = last.filter(|last| count.wrapping_sub(last.1) <= 1) else {
        return;
    };
    let frame = now - last;
    push(&mut history.frame, frame.as_secs_f64() * 1000.0);
    let mut new: BTreeMap<&str, [f64; 2]> = BTreeMap::new();
    for diagnostic in diagnostics.iter() {
        let path = diagnostic.path().as_str();
        let Some(rest) = path.strip_prefix("render/gi/") else {
            continue;
        };
        let Some((pass, figure)) = rest.rsplit_once('/') else {
            continue;
        };
        let slot = match figure {
            "elapsed_gpu" => 0,
            "elapsed_cpu" => 1,
            _ => continue,
        };
        // A pass that did not run in the last frames keeps its last value there; here it costs nothing.
        let measured =
            last_frame(diagnostic).filter(|m| now.duration_since(m.time) < frame.max(MIN_AGE) * 4);
        new.entry(pass).or_default()[slot] = measured.map_or(0.0, |m| m.value);
    }
    for (pass, [gpu, cpu]) in new {
        if !history.passes.contains_key(pass) {
            history.passes.insert(pass.into(), PassHistory::default());
        }
        if let Some(values) = history.passes.get_mut(pass) {
            push(&mut values.gpu, gpu);
            push(&mut values.cpu, cpu);
        }
    }
    // What has not run for so long is not listed.
    let runs = |pass: &PassHistory| pass.gpu.iter().chain(&pass.cpu).any(|ms| *ms > 0.0);
    history.passes.retain(|_, pass| runs(pass));
}

/// Measurements arrive some frames late.
const MIN_AGE: std::time::Duration = std::time::Duration::from_millis(8);

/// The tab.
pub(super) fn show(world: &mut World, ui: &mut egui::Ui) {
    warnings(world, ui);
    if let Some(adapter) = world.get_resource::<RenderAdapterInfo>() {
        ui.label(format!("{}, {:?}", adapter.name, adapter.backend));
    }
    let history = world.resource::<CostHistory>();
    frames(history, ui);
    passes(history, ui);
    let statistics = world.resource::<GiStatistics>();
    memory(statistics, ui);
    egui::CollapsingHeader::new("Counts")
        .default_open(true)
        .show(ui, |ui| {
            egui::Grid::new("counts").striped(true).show(ui, |ui| {
                for (name, count) in statistics.counts() {
                    ui.label(name);
                    ui.label(count.to_string());
                    ui.end_row();
                }
            });
        });
}

fn warnings(world: &World, ui: &mut egui::Ui) {
    let support = world.resource::<GiSupport>();
    let color = ui.visuals().error_fg_color;
    match support.reason() {
        Some(why) => {
            ui.colored_label(color, why);
        }
        None => {
            for entry in world.resource::<GiTechniques>().iter() {
                if let Some(why) = support.technique(entry.technique) {
                    ui.colored_label(color, why);
                }
            }
        }
    }
    let statistics = world.resource::<GiStatistics>();
    let warnings = statistics.warnings();
    if warnings.is_empty() {
        return;
    }
    ui.horizontal(|ui| {
        ui.strong(format!("Warnings ({})", warnings.len()));
        let button = ui.small_button("clear");
        if button.on_hover_text("Until they come again").clicked() {
            statistics.clear_warnings();
        }
    });
    for warning in warnings {
        ui.colored_label(ui.visuals().warn_fg_color, warning);
    }
    ui.separator();
}

/// The last value stands at the right end, in every plot.
fn points(values: impl ExactSizeIterator<Item = f64>) -> PlotPoints<'static> {
    let first = FRAMES - values.len();
    let values = values.enumerate();
    values.map(|(i, v)| [(first + i) as f64, v]).collect()
}

/// About four marks, at round numbers.
fn marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let rough = ((high - low) / 4.0).max(1e-6);
    let power = 10.0_f64.powf(rough.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
    let step = steps.into_iter().find(|step| *step >= rough);
    let step_size = step.unwrap_or(rough);
    let numbers = (low / step_size).ceil() as i64..=(high / step_size).floor() as i64;
    numbers
        .map(|i| GridMark {
            value: i as f64 * step_size,
            step_size,
        })
        .collect()
}

fn plot(name: &str) -> Plot<'_> {
    Plot::new(name)
        .height(110.0)
        .include_x(0.0)
        .include_x(FRAMES as f64)
        .include_y(0.0)
        .show_axes([false, true])
        .y_grid_spacer(marks)
        .y_axis_formatter(|mark, _| {
            let decimals = -mark.step_size.log10().floor();
            format!("{:.*}", decimals.clamp(0.0, 6.0) as usize, mark.value)
        })
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .y_axis_label("ms")
}

fn frames(history: &CostHistory, ui: &mut egui::Ui) {
    let last = history.frame.back().copied().unwrap_or(0.0);
    ui.label(format!(
        "Frame: {last:.1} ms, mean {:.1} ms (this panel included)",
        mean(&history.frame)
    ));
    plot("frame time").show(ui, |plot| {
        plot.line(Line::new("frame", points(history.frame.iter().copied())));
    });
}

fn passes(history: &CostHistory, ui: &mut egui::Ui) {
    let mut rows: Vec<_> = history
        .passes
        .iter()
        .map(|(name, values)| (name, mean(&values.gpu), mean(&values.cpu), values))
        .collect();
    rows.sort_by(|a, b| b.1.total_cmp(&a.1));
    let gpu: f64 = rows.iter().map(|row| row.1).sum();
    let cpu: f64 = rows.iter().map(|row| row.2).sum();
    ui.label(format!(
        "Global illumination: GPU {gpu:.2} ms, CPU {cpu:.2} ms a frame"
    ));
    // Names and colours are in the table below, which is in the order of the GPU's times.
    let stack = |title: &str, of: fn(&PassHistory) -> &VecDeque<f64>, ui: &mut egui::Ui| {
        ui.label(title);
        let histories = rows.iter().map(|row| of(row.3));
        stacked(title, histories, ui);
    };
    stack("GPU, stacked", |pass| &pass.gpu, ui);
    stack("CPU, stacked", |pass| &pass.cpu, ui);
    egui::CollapsingHeader::new("Passes")
        .default_open(true)
        .show(ui, |ui| {
            egui::Grid::new("passes").striped(true).show(ui, |ui| {
                ui.strong("pass");
                ui.strong("GPU ms");
                ui.strong("CPU ms");
                ui.end_row();
                for (i, (name, gpu, cpu, _)) in rows.into_iter().enumerate() {
                    ui.horizontal(|ui| {
                        let (rect, _) =
                            ui.allocate_exact_size(egui::vec2(10.0, 10.0), egui::Sense::hover());
                        ui.painter().rect_filled(rect, 2.0, color(i));
                        ui.label(name);
                    });
                    ui.label(format!("{gpu:.3}"));
                    ui.label(format!("{cpu:.3}"));
                    ui.end_row();
                }
            });
        });
}

/// Filled lines, one upon the other: the topmost is the sum of all.
fn stacked<'a>(
    name: &str,
    histories: impl DoubleEndedIterator<Item = &'a VecDeque<f64>>,
    ui: &mut egui::Ui,
) {
    let mut sum = vec![0.0; FRAMES];
    let mut lines = Vec::new();
    for values in histories.rev() {
        let missing = FRAMES - values.len();
        for (sum, value) in sum[missing..].iter_mut().zip(values) {
            *sum += value;
        }
        lines.push(sum.clone());
    }
    // From the top down: each covers what is below it of the one before.
    plot(name).show(ui, |plot| {
        for (i, values) in lines.into_iter().rev().enumerate() {
            let line = Line::new(i.to_string(), points(values.into_iter())).color(color(i));
            plot.line(line.fill(0.0));
        }
    });
}

/// Of the pass that costs so many others more.
fn color(rank: usize) -> egui::Color32 {
    let golden = 0.618_034;
    egui::ecolor::Hsva::new((rank as f32 * golden).fract(), 0.65, 0.85, 1.0).into()
}

fn memory(statistics: &GiStatistics, ui: &mut egui::Ui) {
    let memory = statistics.memory();
    let mib = |bytes: u64| format!("{:.2} MiB", bytes as f64 / 1048576.0);
    let title = format!("Memory: {}", mib(memory.values().sum()));
    egui::CollapsingHeader::new(title)
        .id_salt("memory")
        .default_open(true)
        .show(ui, |ui| {
            egui::Grid::new("memory").striped(true).show(ui, |ui| {
                let mut rows: Vec<_> = memory.into_iter().collect();
                rows.sort_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
                for (name, bytes) in rows {
                    ui.label(name);
                    ui.label(mib(bytes));
                    ui.end_row();
                }
            });
        });
}
