//! Ranges of settings, and the clamping of what lies outside of them.

use bevy::{color::LinearRgba, log::warn, math::Vec3};

/// A type whose fields have ranges.
pub trait Clamped {
    /// Brings every field into its range, through `clamp`. Default: no field has a range.
    fn clamp(&mut self, _clamp: &mut Clamp) {}
}

/// Range of a numeric field of a settings type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldRange {
    /// Reflection path of the field below its type.
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
    pub fn apply<T: Clamped>(owner: &'static str, value: &mut T) -> Vec<String> {
        let mut clamp = Self::new(owner);
        value.clamp(&mut clamp);
        clamp.changes
    }

    /// Ranges of the fields of a type, as [`Clamped::clamp`] states them.
    pub fn ranges<T: Clamped + Default>() -> Vec<FieldRange> {
        let mut clamp = Self::new("");
        T::default().clamp(&mut clamp);
        clamp.ranges
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
