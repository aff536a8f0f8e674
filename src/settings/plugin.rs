//! Plugins that register [`Parameters`].

use std::marker::PhantomData;

use bevy::{
    app::{App, Last, Plugin, PostUpdate},
    ecs::{prelude::*, schedule::IntoScheduleConfigs},
    render::extract_resource::{ExtractResource, ExtractResourcePlugin},
    transform::TransformSystems,
};

use super::{
    GiCaptureSettings, GiHistory, GiSettings, GiTechnique,
    parameters::{Clamp, Parameters},
    registry::{GiSettingsRegistry, SettingsEntry},
};
use crate::gpu::statistics::GiStatistics;

/// Registers [`GiSettings`], [`GiCaptureSettings`] and [`GiHistory`].
#[derive(Default)]
pub struct SettingsPlugin;

impl Plugin for SettingsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<GiHistory>()
            .configure_sets(PostUpdate, Clamping.before(TransformSystems::Propagate))
            .add_plugins((
                SettingsResourcePlugin::<GiSettings>::default(),
                SettingsResourcePlugin::<GiCaptureSettings>::default(),
                ExtractResourcePlugin::<GiHistory>::default(),
            ));
    }
}

/// In `PostUpdate`: parameters that have changed are clamped. What changes them later is clamped in `Last`.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Clamping;

/// Registers [`Parameters`] that are a component: they are listed in the [`GiSettingsRegistry`], and clamped
/// whenever they change.
pub struct SettingsComponentPlugin<T>(PhantomData<T>);

impl<T> Default for SettingsComponentPlugin<T> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<T: Parameters> Plugin for SettingsComponentPlugin<T> {
    fn build(&self, app: &mut App) {
        register::<T>(app, None, false);
    }
}

/// Registers [`Parameters`] that are a resource: they are listed in the [`GiSettingsRegistry`], clamped whenever
/// they change, and sent to the render world. Without a value in the app, they have their default.
pub struct SettingsResourcePlugin<T> {
    technique: Option<GiTechnique>,
    is_debug: bool,
    marker: PhantomData<T>,
}

impl<T> SettingsResourcePlugin<T> {
    /// Parameters of one technique.
    pub fn of(technique: GiTechnique) -> Self {
        Self {
            technique: Some(technique),
            ..Self::default()
        }
    }

    /// Parameters that choose what debug views show, of one technique or of all.
    pub fn debug(technique: Option<GiTechnique>) -> Self {
        Self {
            technique,
            is_debug: true,
            ..Self::default()
        }
    }
}

impl<T> Default for SettingsResourcePlugin<T> {
    fn default() -> Self {
        Self {
            technique: None,
            is_debug: false,
            marker: PhantomData,
        }
    }
}

impl<T: Parameters + Resource + ExtractResource<Source = T>> Plugin for SettingsResourcePlugin<T> {
    fn build(&self, app: &mut App) {
        register::<T>(app, self.technique, self.is_debug);
        app.init_resource::<T>()
            .add_plugins(ExtractResourcePlugin::<T>::default());
    }
}

fn register<T: Parameters>(app: &mut App, technique: Option<GiTechnique>, is_debug: bool) {
    let mut entry = SettingsEntry::new::<T>();
    entry.technique = technique;
    entry.is_debug = is_debug;
    app.register_type::<T>()
        .add_systems(PostUpdate, clamp::<T>.in_set(Clamping))
        // After whatever the app does in a frame, and before that is sent.
        .add_systems(Last, clamp::<T>)
        .world_mut()
        .get_resource_or_init::<GiSettingsRegistry>()
        .add(entry);
}

/// A resource is a component, too, of an entity of its own.
fn clamp<T: Parameters>(mut values: Query<&mut T, Changed<T>>, statistics: Res<GiStatistics>) {
    for mut value in &mut values {
        // Clamping twice what is already in range would mark it as changed again, for ever.
        let value = value.bypass_change_detection();
        statistics.warn(Clamp::apply(T::short_type_path(), value));
    }
}
