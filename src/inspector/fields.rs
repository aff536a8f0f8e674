//! The fields of a value, by reflection: name, editor, mark of what is changed, reset.

use bevy::{
    color::LinearRgba,
    ecs::prelude::*,
    math::Vec3,
    reflect::{
        PartialReflect, Reflect, ReflectMut, ReflectRef, TypeData, TypeInfo,
        enums::{DynamicEnum, VariantInfo},
        tuple::DynamicTuple,
    },
};
use bevy_egui::egui;
use bevy_inspector_egui::{
    inspector_options::{
        InspectorOptions, Target,
        std_options::{NumberDisplay, NumberOptions},
    },
    reflect_inspector::{Context, InspectorUi},
};

use crate::{FieldRange, GiTechnique, GiTechniques, GiView, GiViews, SettingsEntry};

/// All fields of some registered parameters of an entity.
pub(super) fn parameters(
    world: &mut World,
    entry: &SettingsEntry,
    entity: Entity,
    fold: Fold,
    search: &str,
    ui: &mut egui::Ui,
) {
    let Some(Ok(mut value)) = entry
        .get_of(world, entity)
        .map(|value| value.reflect_clone())
    else {
        return;
    };
    let group = Group {
        title: entry.name,
        default: entry.default_value(),
        ranges: &entry.ranges,
        search,
        fold,
    };
    if group.show(world, &mut *value, ui)
        && let Some(mut now) = entry.get_mut_of(world, entity)
    {
        now.apply(value.as_partial_reflect());
    }
}

/// A field in which one types what is looked for.
pub(super) fn search(text: &mut String, ui: &mut egui::Ui) {
    ui.horizontal(|ui| {
        let width = ui.available_width() - 30.0;
        ui.add(
            egui::TextEdit::singleline(text)
                .hint_text("Search: a name, or a word of the documentation")
                .desired_width(width),
        );
        if ui.button("✖").on_hover_text("Show all").clicked() {
            text.clear();
        }
    });
}

/// Whether all words that are looked for are in a text, in any case of letters.
pub(super) fn matches(search: &str, text: &str) -> bool {
    let (search, text) = (search.to_lowercase(), text.to_lowercase());
    search.split_whitespace().all(|word| text.contains(word))
}

/// A button that says on hover what it does. True if it is clicked.
pub(super) fn button(ui: &mut egui::Ui, text: &str, what: &str) -> bool {
    ui.button(text).on_hover_text(what).clicked()
}

/// A value with named fields.
pub(super) struct Group<'a> {
    pub title: &'a str,
    /// What fields are reset to.
    pub default: &'a dyn Reflect,
    pub ranges: &'a [FieldRange],
    /// Only fields whose name or documentation contains this are shown.
    pub search: &'a str,
    pub fold: Fold,
}

/// Whether a group is unfolded.
#[derive(Clone, Copy)]
pub(super) struct Fold {
    pub at_first: bool,
    /// From this frame on, whatever it was.
    pub now: Option<bool>,
}

impl Fold {
    pub const OPEN: Self = Self {
        at_first: true,
        now: None,
    };
}

impl Group<'_> {
    /// Shows it. True if anything was changed.
    pub fn show(&self, world: &World, value: &mut dyn Reflect, ui: &mut egui::Ui) -> bool {
        let types = world.resource::<AppTypeRegistry>().read();
        let techniques = world.resource::<GiTechniques>();
        let views = world.resource::<GiViews>();
        let (docs, info) = match value.get_represented_type_info() {
            Some(TypeInfo::Struct(info)) => (info.docs(), info),
            _ => return false,
        };
        let ReflectRef::Struct(defaults) = self.default.reflect_ref() else {
            return false;
        };
        let is_changed = |name: &str, field: &dyn PartialReflect| {
            let default = defaults.field(name);
            default.is_some_and(|d| d.reflect_partial_eq(field) == Some(false))
        };
        let ReflectMut::Struct(fields) = value.reflect_mut() else {
            return false;
        };
        let found =
            |name: &str, docs: &str| matches(self.search, &format!("{} {name} {docs}", self.title));
        let shown: Vec<_> = (0..fields.field_len())
            .filter_map(|i| {
                let info = info.field_at(i)?;
                found(info.name(), info.docs().unwrap_or("")).then_some(info)
            })
            .collect();
        if shown.is_empty() {
            return false;
        }
        let mut changed = false;
        let all_changed = info
            .iter()
            .filter(|f| {
                fields
                    .field(f.name())
                    .is_some_and(|v| is_changed(f.name(), v))
            })
            .count();
        let title = match all_changed {
            0 => self.title.to_owned(),
            n => format!("{} • {n} changed", self.title),
        };
        let header = egui::CollapsingHeader::new(title)
            .id_salt(self.title)
            .default_open(self.fold.at_first)
            .open((!self.search.is_empty()).then_some(true).or(self.fold.now));
        let response = header.show(ui, |ui| {
            // Greyed out rather than gone: what is below stays in its place.
            let button = egui::Button::new("↺ reset all").small();
            let button = ui.add_enabled(all_changed > 0, button);
            let button = button.on_hover_text("All fields of this group back to their defaults");
            if button.clicked() {
                for field in info.iter() {
                    changed |= reset(defaults.field(field.name()), fields.field_mut(field.name()));
                }
            }
            egui::Grid::new(self.title)
                .num_columns(3)
                .striped(true)
                .show(ui, |ui| {
                    for field in &shown {
                        let name = field.name();
                        let Some(value) = fields.field_mut(name) else {
                            continue;
                        };
                        let differs = is_changed(name, value);
                        let unit = range(self.ranges, name)
                            .or_else(|| range(self.ranges, &format!("{name}.x")))
                            .map_or("", |range| range.unit);
                        label(name, unit, differs, field.docs(), ui);
                        let named = technique(techniques, name, value, ui);
                        let named = named.or_else(|| view(views, name, value, ui));
                        changed |= named
                            .unwrap_or_else(|| self.editor(&types, name, value, field.docs(), ui));
                        let button = egui::Button::new("↺").small();
                        let button = ui.add_enabled(differs, button);
                        let default = defaults.field(name);
                        let button = button.on_hover_text(match default {
                            Some(default) => format!("Back to the default: {default:?}"),
                            None => String::new(),
                        });
                        if button.clicked() {
                            changed |= reset(default, fields.field_mut(name));
                        }
                        ui.end_row();
                    }
                });
        });
        if let Some(docs) = docs {
            response.header_response.on_hover_text(plain(docs));
        }
        changed
    }

    fn editor(
        &self,
        types: &bevy::reflect::TypeRegistry,
        name: &str,
        value: &mut dyn PartialReflect,
        docs: Option<&str>,
        ui: &mut egui::Ui,
    ) -> bool {
        let color = has_color(value).then(|| range(self.ranges, &format!("{name}.0")));
        let color = color.flatten();
        let options = field_options(value.get_represented_type_info(), name, self.ranges);
        let before = value.to_dynamic();
        let mut context = Context::default();
        let mut inspector = InspectorUi::new_no_short_circuit(types, &mut context);
        let id = egui::Id::new((self.title, name));
        ui.scope(|ui| {
            ui.spacing_mut().slider_width = 130.0;
            let inner = ui.vertical(|ui| match (&options, color) {
                (_, Some(range)) => color_choice(value, range.max, id, ui),
                (Some(options), _) => {
                    inspector.ui_for_reflect_with_options(value, ui, id, options.as_any())
                }
                (None, _) => inspector.ui_for_reflect_with_options(value, ui, id, &()),
            });
            if let Some(docs) = docs {
                inner.response.on_hover_text(plain(docs));
            }
            // What is typed may be no number; no renderer bears that.
            if inner.inner && !is_finite(value) {
                value.apply(&*before);
                return false;
            }
            inner.inner
        })
        .inner
    }
}

/// A list of all techniques, if a value is one of them or may be: whether another was chosen.
fn technique(
    techniques: &GiTechniques,
    name: &str,
    value: &mut dyn PartialReflect,
    ui: &mut egui::Ui,
) -> Option<bool> {
    let optional = value.try_downcast_ref::<Option<GiTechnique>>().copied();
    let always = value.try_downcast_ref::<GiTechnique>().copied();
    let before = optional.or(always.map(Some))?;
    let mut chosen = before;
    let title = |technique: Option<GiTechnique>| match technique {
        Some(technique) => techniques.title(technique),
        None => "that of the settings",
    };
    egui::ComboBox::from_id_salt((name, "technique"))
        .selected_text(title(before))
        .show_ui(ui, |ui| {
            let all = techniques.iter().map(|entry| Some(entry.technique));
            let none = optional.is_some().then_some(None);
            for choice in none.into_iter().chain(all) {
                ui.selectable_value(&mut chosen, choice, title(choice));
            }
        });
    match (optional, chosen) {
        (Some(_), _) => value.apply(&chosen),
        (None, Some(technique)) => value.apply(&technique),
        (None, None) => {}
    }
    Some(chosen != before)
}

/// A list of all debug views, if a value is one of them: whether another was chosen.
fn view(
    views: &GiViews,
    name: &str,
    value: &mut dyn PartialReflect,
    ui: &mut egui::Ui,
) -> Option<bool> {
    let before = value.try_downcast_ref::<GiView>().copied()?;
    let mut chosen = before;
    egui::ComboBox::from_id_salt((name, "view"))
        .selected_text(before.name())
        .show_ui(ui, |ui| {
            for entry in views.iter() {
                let choice = ui.selectable_value(&mut chosen, entry.view, entry.view.name());
                choice.on_hover_text(entry.legend);
            }
        });
    value.apply(&chosen);
    Some(chosen != before)
}

/// Whether all numbers in a value are finite.
fn is_finite(value: &dyn PartialReflect) -> bool {
    if let Some(x) = value.try_downcast_ref::<f32>() {
        return x.is_finite();
    }
    match value.reflect_ref() {
        ReflectRef::Struct(fields) => fields.iter_fields().all(|(_, field)| is_finite(field)),
        ReflectRef::TupleStruct(fields) => fields.iter_fields().all(is_finite),
        ReflectRef::Tuple(fields) => fields.iter_fields().all(is_finite),
        ReflectRef::Enum(variant) => variant.iter_fields().all(|field| is_finite(field.value())),
        _ => true,
    }
}

/// Whether some variant of an enum holds luminances.
fn has_color(value: &dyn PartialReflect) -> bool {
    let Some(TypeInfo::Enum(info)) = value.get_represented_type_info() else {
        return false;
    };
    info.iter().any(|variant| match variant {
        VariantInfo::Tuple(info) => info
            .field_at(0)
            .is_some_and(|field| field.is::<LinearRgba>()),
        _ => false,
    })
}

/// An enum, one variant of which holds luminances in nits: a colour picker would end at 1.
fn color_choice(value: &mut dyn PartialReflect, max: f64, id: egui::Id, ui: &mut egui::Ui) -> bool {
    let Some(TypeInfo::Enum(info)) = value.get_represented_type_info() else {
        return false;
    };
    let ReflectMut::Enum(variant) = value.reflect_mut() else {
        return false;
    };
    let mut name = variant.variant_name().to_owned();
    let before = name.clone();
    egui::ComboBox::from_id_salt(id)
        .selected_text(&before)
        .show_ui(ui, |ui| {
            for choice in info.iter() {
                ui.selectable_value(&mut name, choice.name().to_owned(), choice.name());
            }
        });
    if name != before {
        let new = match info.variant(&name) {
            Some(VariantInfo::Tuple(_)) => {
                // As bright as an overcast sky.
                let mut fields = DynamicTuple::default();
                fields.insert(LinearRgba::rgb(1000.0, 1000.0, 1000.0));
                DynamicEnum::new(name, fields)
            }
            _ => DynamicEnum::new(name, ()),
        };
        variant.apply(&new);
        return true;
    }
    let Some(color) = variant
        .field_at_mut(0)
        .and_then(|field| field.try_downcast_mut::<LinearRgba>())
    else {
        return false;
    };
    let mut changed = false;
    ui.horizontal(|ui| {
        for (channel, value) in [
            ("r", &mut color.red),
            ("g", &mut color.green),
            ("b", &mut color.blue),
        ] {
            let speed = (0.01 * f64::from(*value)).max(0.01);
            let drag = egui::DragValue::new(value).range(0.0..=max).speed(speed);
            changed |= ui.add(drag.prefix(format!("{channel} "))).changed();
        }
        ui.label("nits");
    });
    changed
}

fn reset(default: Option<&dyn PartialReflect>, value: Option<&mut dyn PartialReflect>) -> bool {
    match (default, value) {
        (Some(default), Some(value)) => {
            value.apply(default);
            true
        }
        _ => false,
    }
}

/// A field's name as words, with its unit; strong and marked if it is not the default.
fn label(name: &str, unit: &str, differs: bool, docs: Option<&str>, ui: &mut egui::Ui) {
    let mut words = name.replace('_', " ");
    if !unit.is_empty() {
        words += &format!(", {unit}");
    }
    let text = match differs {
        true => egui::RichText::new(format!("• {words}")).strong(),
        false => egui::RichText::new(words),
    };
    let label = ui.label(text);
    if let Some(docs) = docs {
        label.on_hover_text(plain(docs));
    }
}

/// Documentation without the marks of rustdoc.
fn plain(docs: &str) -> String {
    let mut text = String::with_capacity(docs.len());
    for line in docs.lines().map(str::trim) {
        if line.is_empty() {
            text.push_str("\n\n");
        } else {
            if !text.is_empty() && !text.ends_with('\n') {
                text.push(' ');
            }
            text.push_str(line);
        }
    }
    // The targets of links.
    while let Some(at) = text.find("](") {
        let end = text[at..].find(')').map_or(text.len(), |end| at + end + 1);
        text.replace_range(at..end, "");
    }
    text.replace(['`', '[', ']'], "")
}

/// A range, as the editor for a type takes it.
fn options(info: &TypeInfo, range: &FieldRange) -> Option<Box<dyn TypeData>> {
    fn slider<T: 'static>(mut options: NumberOptions<T>) -> Option<Box<dyn TypeData>>
    where
        NumberOptions<T>: TypeData,
    {
        options.display = NumberDisplay::Slider;
        Some(Box::new(options))
    }
    let (min, max) = (range.min, range.max);
    if info.is::<f32>() {
        slider(NumberOptions::between(min as f32, max as f32))
    } else if info.is::<u32>() {
        slider(NumberOptions::between(min as u32, max as u32))
    } else if info.is::<Vec3>() {
        let ends = [min, max].map(|end| Vec3::splat(end as f32));
        Some(Box::new(NumberOptions::between(ends[0], ends[1])))
    } else {
        None
    }
}

/// The range of a field by its path.
fn range<'a>(ranges: &'a [FieldRange], path: &str) -> Option<&'a FieldRange> {
    ranges.iter().find(|range| range.field == path)
}

/// The ranges of a field, as its editor takes them: of an enum, those in its variants.
fn field_options(
    info: Option<&TypeInfo>,
    path: &str,
    ranges: &[FieldRange],
) -> Option<Box<dyn TypeData>> {
    let info = info?;
    let own = range(ranges, path).or_else(|| range(ranges, &format!("{path}.x")));
    if let Some(range) = own {
        return options(info, range);
    }
    let inside = format!("{path}.");
    if !ranges.iter().any(|range| range.field.starts_with(&inside)) {
        return None;
    }
    let mut all = InspectorOptions::new();
    let mut add = |target, info, name: &str| {
        if let Some(inner) = field_options(info, &format!("{path}.{name}"), ranges) {
            all.insert_boxed(target, inner);
        }
    };
    match info {
        TypeInfo::Struct(info) => {
            for (i, field) in info.iter().enumerate() {
                add(Target::Field(i), field.type_info(), field.name());
            }
        }
        TypeInfo::Enum(info) => {
            for (variant_index, variant) in info.iter().enumerate() {
                let VariantInfo::Tuple(info) = variant else {
                    continue;
                };
                for (field_index, field) in info.iter().enumerate() {
                    let target = Target::VariantField {
                        variant_index,
                        field_index,
                    };
                    add(target, field.type_info(), &field_index.to_string());
                }
            }
        }
        _ => {}
    }
    Some(Box::new(all))
}

#[cfg(test)]
mod tests {
    use bevy::reflect::Typed;

    use super::*;
    use crate::{HintSampling, Parameters, RadianceHintsSettings};

    #[test]
    fn documentation_is_shown_as_text() {
        let docs = " What holds for `every` [technique](x).\n Two lines.\n\n A paragraph.";
        let text = plain(docs);
        assert_eq!(
            text,
            "What holds for every technique. Two lines.\n\nA paragraph."
        );
    }

    #[test]
    fn editors_know_their_range() {
        let range = FieldRange {
            field: "angle",
            min: 10.0,
            max: 90.0,
            unit: "°",
        };
        let float = options(f32::type_info(), &range).unwrap();
        let float = float.downcast_ref::<NumberOptions<f32>>().unwrap();
        assert_eq!((float.min, float.max), (Some(10.0), Some(90.0)));
        let int = options(u32::type_info(), &range).unwrap();
        let int = int.downcast_ref::<NumberOptions<u32>>().unwrap();
        assert_eq!((int.min, int.max), (Some(10), Some(90)));
        let vector = options(Vec3::type_info(), &range).unwrap();
        let vector = vector.downcast_ref::<NumberOptions<Vec3>>().unwrap();
        assert_eq!(vector.max, Some(Vec3::splat(90.0)));
        assert!(options(bool::type_info(), &range).is_none());
    }

    #[test]
    fn editors_of_variants_know_their_ranges() {
        let ranges = RadianceHintsSettings::ranges();
        let options = field_options(Some(HintSampling::type_info()), "sampling", &ranges).unwrap();
        let options = options.downcast_ref::<InspectorOptions>().unwrap();
        let target = |variant_index| Target::VariantField {
            variant_index,
            field_index: 0,
        };
        assert!(options.get(target(0)).is_none());
        let disk = options.get(target(1)).unwrap();
        let disk = disk.downcast_ref::<InspectorOptions>().unwrap();
        let spread = disk.get(Target::Field(0)).unwrap();
        let spread = spread.downcast_ref::<NumberOptions<f32>>().unwrap();
        assert_eq!((spread.min, spread.max), (Some(0.02), Some(1.0)));
    }
}
