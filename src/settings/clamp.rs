//! Ranges of settings, and the clamping of what lies outside of them.

use bevy::{color::LinearRgba, log::warn, math::Vec3};

/// A type whose fields have ranges.
pub trait Clamped {
    /// Brings every field into its range, through `clamp`. Default: no field has a range.
    fn clamp(&mut self, _clamp: &mut Clamp) {}
}

/// The range of a numeric field of a settings type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldRange {
    /// Reflection path of the field below its type.
    pub field: &'static str,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// What it is measured in, as after a number: "m", "°"; empty for plain numbers.
    pub unit: &'static str,
}

impl FieldRange {
    /// States the unit.
    pub fn unit(&mut self, unit: &'static str) {
        self.unit = unit;
    }
}

/// Brings values into their ranges, and remembers the ranges and what it had to change.
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

    /// Clamps `value`, a `T` called `owner` in warnings. Says what was out of range, which is logged
    /// as well.
    pub fn apply<T: Clamped>(owner: &'static str, value: &mut T) -> Vec<String> {
        let mut clamp = Self::new(owner);
        value.clamp(&mut clamp);
        clamp.changes
    }

    /// The ranges of a type's fields, as [`Clamped::clamp`] has them.
    pub fn ranges<T: Clamped + Default>() -> Vec<FieldRange> {
        let mut clamp = Self::new("");
        T::default().clamp(&mut clamp);
        clamp.ranges
    }

    /// Not-a-number becomes `min`.
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

    /// Whole numbers.
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

    /// A point of the world: each of its fields within 1000 km.
    pub fn point(&mut self, fields: [&'static str; 3], value: &mut Vec3) {
        let values = [&mut value.x, &mut value.y, &mut value.z];
        for (field, value) in fields.into_iter().zip(values) {
            self.float(field, value, -1e6, 1e6).unit("m");
        }
    }

    /// Each channel from 0 to `max`.
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
