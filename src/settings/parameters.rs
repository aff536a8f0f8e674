//! [`Parameters`]: what may be set, with its ranges and presets. [`Clamp`]: brings it into its ranges.

use std::sync::Arc;

use bevy::{
    color::LinearRgba,
    ecs::{component::Mutable, prelude::*},
    log::warn,
    math::Vec3,
    reflect::{FromReflect, GetTypeRegistration, Reflect, TypePath},
};

/// Parameters that an app or a user may set: a resource, or a component of cameras or of objects of the scene.
///
/// [`SettingsResourcePlugin`](crate::SettingsResourcePlugin) and
/// [`SettingsComponentPlugin`](crate::SettingsComponentPlugin) register them. The inspector, settings files and
/// the viewer's `--list` and `--set` then find them, and values out of range are clamped whenever they change.
pub trait Parameters:
    Component<Mutability = Mutable>
    + Reflect
    + TypePath
    + FromReflect
    + GetTypeRegistration
    + Default
    + Clone
{
    /// Where they are. Default [`ParametersKind::Resource`].
    const KIND: ParametersKind = ParametersKind::Resource;

    /// Brings every field into its range, through `clamp`. Default: no field has a range.
    fn clamp(&mut self, _clamp: &mut Clamp) {}

    /// Presets. Default: none.
    fn presets() -> Vec<Preset<Self>> {
        Vec::new()
    }

    /// Of debug settings: meaning of the colours of what they add to the picture now. Default: they add nothing that
    /// needs one.
    fn legend(&self) -> Option<&'static str> {
        None
    }

    /// Takes over values from a settings file. Default: all of them.
    fn load(&mut self, saved: Self) {
        *self = saved;
    }

    /// The entity whose values are saved to settings files, of all that have such parameters. Default: any. A
    /// resource has only one.
    fn saved_entity(world: &World) -> Option<Entity> {
        let mut query = world.try_query_filtered::<Entity, With<Self>>()?;
        query.iter(world).next()
    }

    /// Ranges of the numeric fields, as [`clamp`](Self::clamp) states them.
    fn ranges() -> Vec<FieldRange> {
        let mut clamp = Clamp::new("");
        Self::default().clamp(&mut clamp);
        clamp.ranges
    }
}

/// Where [`Parameters`] are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParametersKind {
    /// A resource. It is part of settings files.
    Resource,
    /// A component of cameras. Settings files have the values of one camera, which go to all of them.
    Camera,
    /// A component of volumes, lights and other objects. It belongs to the scene, and is not saved to settings
    /// files.
    Scene,
}

/// A preset of some [`Parameters`]: sets the fields that it is about, and keeps the others.
pub struct Preset<T> {
    /// Its name, in lower case. A preset of several types has the same name in each.
    pub name: &'static str,
    pub(super) set: Arc<dyn Fn(&mut T) + Send + Sync>,
}

impl<T> Preset<T> {
    /// A preset that changes a value.
    pub fn new(name: &'static str, set: impl Fn(&mut T) + Send + Sync + 'static) -> Self {
        Self {
            name,
            set: Arc::new(set),
        }
    }

    /// A preset that is a whole value.
    pub fn value(name: &'static str, value: T) -> Self
    where
        T: Clone + Send + Sync + 'static,
    {
        Self::new(name, move |old: &mut T| old.clone_from(&value))
    }

    /// Applies it.
    pub fn apply(&self, value: &mut T) {
        (self.set)(value);
    }
}

/// Range of a numeric field of some [`Parameters`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldRange {
    /// Reflection path of the field below its type, such as `extent.x`; of a field in a variant of an enum, such
    /// as `sampling.0.spread`, which exists while the enum is that variant.
    pub field: &'static str,
    /// Minimum.
    pub min: f64,
    /// Maximum.
    pub max: f64,
    /// Unit, as after a number: "m", "°". Empty for plain numbers.
    pub unit: &'static str,
}

impl FieldRange {
    /// Sets the unit.
    pub fn unit(&mut self, unit: &'static str) {
        self.unit = unit;
    }
}

/// Clamps values to their ranges, and records the ranges and the changes.
pub struct Clamp {
    owner: &'static str,
    /// A sentence for each field that was out of range.
    pub changes: Vec<String>,
    ranges: Vec<FieldRange>,
}

impl Clamp {
    fn new(owner: &'static str) -> Self {
        Self {
            owner,
            changes: Vec::new(),
            ranges: Vec::new(),
        }
    }

    /// Clamps `value`, a `T` that warnings call `owner`. Returns and logs a sentence for each field that was
    /// out of range.
    pub fn apply<T: Parameters>(owner: &'static str, value: &mut T) -> Vec<String> {
        let mut clamp = Self::new(owner);
        value.clamp(&mut clamp);
        clamp.changes
    }

    /// Clamps a number. Not-a-number becomes `min`.
    pub fn float(
        &mut self,
        field: &'static str,
        value: &mut f32,
        min: f32,
        max: f32,
    ) -> &mut FieldRange {
        if !(min..=max).contains(value) {
            let old = std::mem::replace(value, value.max(min).min(max));
            self.warn(field, old, *value, min, max);
        }
        self.range(field, min, max)
    }

    /// Clamps a whole number.
    pub fn int(
        &mut self,
        field: &'static str,
        value: &mut u32,
        min: u32,
        max: u32,
    ) -> &mut FieldRange {
        if !(min..=max).contains(value) {
            let old = std::mem::replace(value, (*value).clamp(min, max));
            self.warn(field, old, *value, min, max);
        }
        self.range(field, min, max)
    }

    /// Clamps a point of the world: each coordinate within 1000 km.
    pub fn point(&mut self, fields: [&'static str; 3], value: &mut Vec3) {
        let values = [&mut value.x, &mut value.y, &mut value.z];
        for (field, value) in fields.into_iter().zip(values) {
            self.float(field, value, -1e6, 1e6).unit("m");
        }
    }

    /// Clamps a colour: each channel from 0 to `max`.
    pub fn color(&mut self, field: &'static str, value: &mut LinearRgba, max: f32) {
        self.float(field, &mut value.red, 0.0, max);
        self.float(field, &mut value.green, 0.0, max);
        self.float(field, &mut value.blue, 0.0, max);
    }

    fn range(
        &mut self,
        field: &'static str,
        min: impl Into<f64>,
        max: impl Into<f64>,
    ) -> &mut FieldRange {
        let index = self.ranges.len();
        self.ranges.push(FieldRange {
            field,
            min: min.into(),
            max: max.into(),
            unit: "",
        });
        &mut self.ranges[index]
    }

    fn warn(
        &mut self,
        field: &str,
        old: impl std::fmt::Display,
        new: impl std::fmt::Display,
        min: impl std::fmt::Display,
        max: impl std::fmt::Display,
    ) {
        let change = format!(
            "{}.{field} = {old} is outside of {min}..={max}; using {new}",
            self.owner
        );
        warn!("{change}");
        self.changes.push(change);
    }
}
