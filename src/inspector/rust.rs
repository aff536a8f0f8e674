//! Settings as the Rust code that makes them.

use bevy::reflect::{PartialReflect, ReflectRef, enums::VariantType};

use crate::{GiTechnique, GiView};

/// Code that inserts a resource; only fields that differ from the default are named.
pub(super) fn insert_resource(value: &dyn PartialReflect, default: &dyn PartialReflect) -> String {
    format!("app.insert_resource({});\n", differing(value, default))
}

/// Code that inserts a component into the entity of a camera; only fields that differ from the default are named.
pub(super) fn insert_component(value: &dyn PartialReflect, default: &dyn PartialReflect) -> String {
    format!("camera.insert({});\n", differing(value, default))
}

/// A value as an expression over several lines, which names only fields that differ from the default.
fn differing(value: &dyn PartialReflect, default: &dyn PartialReflect) -> String {
    let (ReflectRef::Struct(fields), ReflectRef::Struct(defaults)) =
        (value.reflect_ref(), default.reflect_ref())
    else {
        return expression(value);
    };
    let mut changed = String::new();
    for i in 0..fields.field_len() {
        let (Some(name), Some(field)) = (fields.name_at(i), fields.field_at(i)) else {
            continue;
        };
        let same = defaults
            .field(name)
            .and_then(|d| d.reflect_partial_eq(field));
        if same != Some(true) {
            changed += &format!("    {name}: {},\n", expression(field));
        }
    }
    let name = type_name(value);
    if changed.is_empty() {
        format!("{name}::default()")
    } else {
        format!("{name} {{\n{changed}    ..Default::default()\n}}")
    }
}

fn type_name(value: &dyn PartialReflect) -> String {
    let info = value.get_represented_type_info();
    let path = info.map_or("_", |info| info.type_path_table().short_path());
    path.into()
}

/// A value as an expression.
fn expression(value: &dyn PartialReflect) -> String {
    if let Some(x) = value.try_downcast_ref::<f32>() {
        return match x {
            x if x.is_nan() => "f32::NAN".into(),
            x if *x == f32::INFINITY => "f32::INFINITY".into(),
            x if *x == f32::NEG_INFINITY => "f32::NEG_INFINITY".into(),
            x => format!("{x:?}"),
        };
    }
    if let Some(technique) = value.try_downcast_ref::<GiTechnique>() {
        return format!("GiTechnique::new({technique:?})");
    }
    if let Some(view) = value.try_downcast_ref::<GiView>() {
        return format!("GiView::new({view:?})");
    }
    match value.reflect_ref() {
        ReflectRef::Struct(fields) => {
            let fields: Vec<_> = (0..fields.field_len())
                .filter_map(|i| Some((fields.name_at(i)?, fields.field_at(i)?)))
                .map(|(name, field)| format!("{name}: {}", expression(field)))
                .collect();
            format!("{} {{ {} }}", type_name(value), fields.join(", "))
        }
        ReflectRef::Enum(variant) => {
            let fields: Vec<_> = (0..variant.field_len())
                .filter_map(|i| variant.field_at(i).map(|field| (variant.name_at(i), field)))
                .map(|(name, field)| match name {
                    Some(name) => format!("{name}: {}", expression(field)),
                    None => expression(field),
                })
                .collect();
            // `Option<T>` is written without its parameter.
            let name = type_name(value);
            let name = name.split('<').next().unwrap_or_default();
            let path = format!("{name}::{}", variant.variant_name());
            match variant.variant_type() {
                VariantType::Unit => path,
                VariantType::Tuple => format!("{path}({})", fields.join(", ")),
                VariantType::Struct => format!("{path} {{ {} }}", fields.join(", ")),
            }
        }
        // Numbers, booleans and text are written as they are shown.
        _ => format!("{value:?}"),
    }
}

#[cfg(test)]
mod tests {
    use bevy::color::LinearRgba;

    use super::*;
    use crate::{
        EmissiveUnits, GatherResolution, GiCamera, GiSettings, GiSky, GiTechnique, HintDisk,
        HintSampling, RadianceHintsSettings,
    };

    #[test]
    fn only_what_differs_is_written() {
        let default = GiSettings::default();
        assert_eq!(
            insert_resource(&default, &default),
            "app.insert_resource(GiSettings::default());\n"
        );
        let settings = GiSettings {
            emissive_units: EmissiveUnits::Nits,
            replace_ambient: true,
            sky: GiSky::Constant(LinearRgba::rgb(1.0, 0.5, 0.25)),
            ..default.clone()
        };
        assert_eq!(
            insert_resource(&settings, &default),
            "app.insert_resource(GiSettings {\n    \
             replace_ambient: true,\n    \
             sky: GiSky::Constant(LinearRgba { red: 1.0, green: 0.5, blue: 0.25, alpha: 1.0 }),\n    \
             emissive_units: EmissiveUnits::Nits,\n    \
             ..Default::default()\n});\n"
        );
        let camera = GiCamera {
            strength: 2.0,
            resolution: GatherResolution::Half,
            ..GiCamera::with_technique(GiTechnique::new("vct"))
        };
        assert_eq!(
            insert_component(&camera, &GiCamera::default()),
            "camera.insert(GiCamera {\n    \
             technique: Option::Some(GiTechnique::new(\"vct\")),\n    \
             strength: 2.0,\n    \
             resolution: GatherResolution::Half,\n    \
             ..Default::default()\n});\n"
        );
        let hints = RadianceHintsSettings {
            sampling: HintSampling::Disk(HintDisk {
                spread: 0.5,
                min_distance: 1.0,
            }),
            ..Default::default()
        };
        assert_eq!(
            insert_resource(&hints, &RadianceHintsSettings::default()),
            "app.insert_resource(RadianceHintsSettings {\n    \
             sampling: HintSampling::Disk(HintDisk { spread: 0.5, min_distance: 1.0 }),\n    \
             ..Default::default()\n});\n"
        );
    }
}
