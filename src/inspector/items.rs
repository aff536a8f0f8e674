//! Volumes, probe sets, lights and cameras of the world: lists and parameters.

use bevy::{
    camera::Camera3d,
    ecs::{
        component::Mutable,
        prelude::*,
        query::{QueryFilter, ReadOnlyQueryData},
    },
    light::{DirectionalLight, PointLight, RectLight, SpotLight},
    math::{Vec3, Vec3A},
    reflect::Reflect,
    transform::components::{GlobalTransform, Transform},
};
use bevy_egui::egui;

use super::{
    GiInspector,
    fields::{self, Group},
};
use crate::{
    GiCamera, GiCascades, GiLight, GiSettingsRegistry, GiTechniques, GiVolume, PrimaryGiCamera,
    ProbePin, ProbeSet,
};

type AnyLight = Or<(
    With<PointLight>,
    With<SpotLight>,
    With<DirectionalLight>,
    With<RectLight>,
)>;

/// Made by the panel.
#[derive(Component)]
struct Spawned;

/// Takes components from an entity; one that the panel has made goes as a whole.
fn remove<B: Bundle>(world: &mut World, entity: Entity) {
    if world.get::<Spawned>(entity).is_some() {
        world.despawn(entity);
    } else {
        world.entity_mut(entity).remove::<B>();
    }
}

/// Entities of a kind, with a line for each.
fn list<D: ReadOnlyQueryData, F: QueryFilter>(
    world: &mut World,
    line: impl Fn(D::Item<'_, '_>) -> String,
) -> Vec<(Entity, String)> {
    let mut query = world.query_filtered::<(Entity, Option<&Name>, D), F>();
    let items = query.iter(world).map(|(entity, name, data)| {
        let line = line(data);
        let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
        (entity, format!("{name}: {line}"))
    });
    items.collect()
}

/// A folded list with an entry for each item; the selected one shows its parameters below.
fn section(
    world: &mut World,
    inspector: &mut GiInspector,
    ui: &mut egui::Ui,
    title: &str,
    items: &[(Entity, String)],
    parameters: impl Fn(&mut World, Entity, &str, &mut egui::Ui),
) {
    egui::CollapsingHeader::new(format!("{title} ({})", items.len()))
        .id_salt(title)
        .default_open(true)
        .show(ui, |ui| {
            for (entity, line) in items {
                // What is selected is searched for its fields, and all others for their names.
                let found = fields::matches(&inspector.search, &format!("{title} {line}"));
                if !found && inspector.selected != Some(*entity) {
                    continue;
                }
                let selected = inspector.selected == Some(*entity);
                if ui.selectable_label(selected, line).clicked() {
                    inspector.selected = (!selected).then_some(*entity);
                }
                if inspector.selected == Some(*entity) {
                    ui.indent(entity, |ui| {
                        parameters(world, *entity, &inspector.search, ui);
                        if world.get_entity(*entity).is_ok() {
                            place(world, *entity, ui);
                        }
                    });
                }
            }
        });
}

/// The tab.
pub(super) fn show(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    fields::search(&mut inspector.search, ui);
    // It may have gone since.
    inspector.selected = inspector
        .selected
        .filter(|entity| world.get_entity(*entity).is_ok());
    volumes(world, inspector, ui);
    cascades(world, inspector, ui);
    pins(world, inspector, ui);
    lights(world, inspector, ui);
    cameras(world, inspector, ui);
    others(world, inspector, ui);
    if inspector.selected.is_none() {
        ui.small("Click on an item for its parameters, and for handles in the viewport");
    }
}

fn volumes(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    let items = list::<&GiVolume, ()>(world, |volume| {
        let Vec3 { x, y, z } = volume.extent;
        format!("{x:.1} x {y:.1} x {z:.1} m, {} voxels", volume.resolution)
    });
    section(
        world,
        inspector,
        ui,
        "Volumes",
        &items,
        |world, entity, search, ui| {
            registered(world, entity, search, ui);
            if fields::button(ui, "Remove volume", "Takes the GiVolume from the entity") {
                remove::<(GiVolume, ProbeSet)>(world, entity);
            }
        },
    );
    if fields::button(
        ui,
        "+ volume",
        "A GiVolume around the point that the camera looks at",
    ) {
        let at = ahead(world, 5.0);
        let volume = world.spawn((
            Spawned,
            GiVolume::default(),
            Transform::from_translation(at),
        ));
        inspector.selected = Some(volume.id());
    }
}

fn cascades(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    let items = list::<&GiCascades, ()>(world, |cascades| {
        format!("{} volumes around the camera", cascades.levels)
    });
    section(
        world,
        inspector,
        ui,
        "Cascades",
        &items,
        |world, entity, search, ui| {
            registered(world, entity, search, ui);
            if fields::button(
                ui,
                "Remove cascades",
                "Takes the GiCascades from the entity",
            ) {
                remove::<(GiCascades, ProbeSet)>(world, entity);
            }
        },
    );
    if fields::button(
        ui,
        "+ cascades",
        "Nested volumes that follow the camera, for worlds that no single one can hold",
    ) {
        let cascades = world.spawn((Spawned, GiCascades::default(), ProbeSet::default()));
        inspector.selected = Some(cascades.id());
    }
}

fn pins(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    let pins = list::<(), With<ProbePin>>(world, |()| "a probe stands here".into());
    section(
        world,
        inspector,
        ui,
        "Probe pins",
        &pins,
        |world, entity, _, ui| {
            if fields::button(ui, "Remove pin", "The probe goes back to its place") {
                remove::<ProbePin>(world, entity);
            }
        },
    );
    if fields::button(
        ui,
        "+ pin",
        "Places a probe by hand, at the point that the camera looks at",
    ) {
        let at = Transform::from_translation(ahead(world, 3.0));
        inspector.selected = Some(world.spawn((Spawned, ProbePin, at)).id());
    }
}

fn lights(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    type Kinds<'a> = (
        Option<&'a PointLight>,
        Option<&'a SpotLight>,
        Option<&'a DirectionalLight>,
        Option<&'a RectLight>,
        Option<&'a GiLight>,
    );
    let items = list::<Kinds, AnyLight>(world, |(point, spot, sun, rect, gi)| {
        let what = if let Some(light) = point {
            format!("point, {:.0} lm", light.intensity)
        } else if let Some(light) = spot {
            format!("spot, {:.0} lm", light.intensity)
        } else if let Some(light) = sun {
            format!("directional, {:.0} lx", light.illuminance)
        } else {
            rect.map_or(String::new(), |light| {
                format!("rect, {:.0} lm", light.intensity)
            })
        };
        match gi {
            Some(gi) => format!("{what}, share {:.2}", gi.intensity),
            None => what,
        }
    });
    section(
        world,
        inspector,
        ui,
        "Lights",
        &items,
        |world, entity, search, ui| {
            registered(world, entity, search, ui);
            if world.get::<GiLight>(entity).is_some() {
                if fields::button(ui, "Remove GiLight", "The light has its whole share again") {
                    world.entity_mut(entity).remove::<GiLight>();
                }
            } else if fields::button(
                ui,
                "+ GiLight",
                "Parameters of this light's share in global illumination",
            ) {
                world.entity_mut(entity).insert(GiLight::default());
            }
            component::<PointLight>(world, entity, search, ui);
            component::<SpotLight>(world, entity, search, ui);
            component::<DirectionalLight>(world, entity, search, ui);
            component::<RectLight>(world, entity, search, ui);
            if fields::button(ui, "Remove light", "Takes the light from the entity") {
                remove::<(PointLight, SpotLight, DirectionalLight, RectLight, GiLight)>(
                    world, entity,
                );
            }
        },
    );
    ui.horizontal_wrapped(|ui| {
        let at = |world: &mut World| Transform::from_translation(ahead(world, 3.0));
        let new = if fields::button(
            ui,
            "+ point light",
            "A lamp 3 m before the camera, with shadows",
        ) {
            let at = at(world);
            let light = PointLight {
                shadow_maps_enabled: true,
                ..Default::default()
            };
            Some(world.spawn((Spawned, light, at)).id())
        } else if fields::button(
            ui,
            "+ spot light",
            "A spot light 3 m before the camera that shines down, with shadows",
        ) {
            let at = at(world).looking_to(Vec3::NEG_Y, Vec3::X);
            let light = SpotLight {
                shadow_maps_enabled: true,
                ..Default::default()
            };
            Some(world.spawn((Spawned, light, at)).id())
        } else if fields::button(
            ui,
            "+ rect light",
            "A lit rectangle 3 m before the camera that shines down",
        ) {
            let at = at(world).looking_to(Vec3::NEG_Y, Vec3::X);
            Some(world.spawn((Spawned, RectLight::default(), at)).id())
        } else if fields::button(ui, "+ sun", "Parallel light from far away, with shadows") {
            let at = at(world).looking_to(Vec3::new(0.3, -1.0, 0.2), Vec3::X);
            let light = DirectionalLight {
                shadow_maps_enabled: true,
                ..Default::default()
            };
            Some(world.spawn((Spawned, light, at)).id())
        } else {
            None
        };
        if new.is_some() {
            inspector.selected = new;
        }
    });
}

fn cameras(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    let techniques = world.resource::<GiTechniques>().clone();
    let items = list::<Option<&GiCamera>, With<Camera3d>>(world, |gi| match gi {
        None => "no global illumination".into(),
        Some(gi) => match gi.technique {
            None => "the technique of the settings".into(),
            Some(technique) => techniques.title(technique).into(),
        },
    });
    section(
        world,
        inspector,
        ui,
        "Cameras",
        &items,
        |world, entity, search, ui| {
            registered(world, entity, search, ui);
            if world.get::<GiCamera>(entity).is_some() {
                if fields::button(
                    ui,
                    "Remove GiCamera",
                    "This camera shows no global illumination then",
                ) {
                    world.entity_mut(entity).remove::<GiCamera>();
                }
            } else if fields::button(
                ui,
                "+ GiCamera",
                "This camera shows global illumination then",
            ) {
                world.entity_mut(entity).insert(GiCamera::default());
            }
        },
    );
}

/// Entities with registered parameters that are in none of the other lists.
fn others(world: &mut World, inspector: &mut GiInspector, ui: &mut egui::Ui) {
    type Listed = Or<(
        With<GiVolume>,
        With<GiCascades>,
        With<Camera3d>,
        With<PointLight>,
        With<SpotLight>,
        With<DirectionalLight>,
        With<RectLight>,
    )>;
    let listed: Vec<_> = list::<(), Listed>(world, |()| String::new());
    let registry = world.resource::<GiSettingsRegistry>().clone();
    let mut items: Vec<(Entity, String)> = Vec::new();
    for entry in registry.components() {
        for entity in entry.entities(world) {
            if listed.iter().any(|(other, _)| *other == entity) {
                continue;
            }
            match items.iter_mut().find(|(other, _)| *other == entity) {
                Some((_, line)) => *line += &format!(", {}", entry.name),
                None => {
                    let name = world.get::<Name>(entity);
                    let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
                    items.push((entity, format!("{name}: {}", entry.name)));
                }
            }
        }
    }
    if !items.is_empty() {
        section(world, inspector, ui, "Others", &items, registered);
    }
}

/// The fields of all registered parameters that an entity has.
fn registered(world: &mut World, entity: Entity, search: &str, ui: &mut egui::Ui) {
    let registry = world.resource::<GiSettingsRegistry>().clone();
    for entry in registry.components() {
        fields::parameters(world, entry, entity, fields::Fold::OPEN, search, ui);
    }
}

/// The fields of a component of Bevy's, if the entity has it.
fn component<T>(world: &mut World, entity: Entity, search: &str, ui: &mut egui::Ui)
where
    T: Component<Mutability = Mutable> + Reflect + bevy::reflect::TypePath + Default + Clone,
{
    let Some(mut value) = world.get::<T>(entity).cloned() else {
        return;
    };
    let group = Group {
        title: T::short_type_path(),
        default: &T::default(),
        ranges: &[],
        search,
        fold: fields::Fold::OPEN,
    };
    if group.show(world, &mut value, ui) {
        world.entity_mut(entity).insert(value);
    }
}

/// Where an item is.
fn place(world: &mut World, entity: Entity, ui: &mut egui::Ui) {
    let Some(transform) = world.get::<Transform>(entity).copied() else {
        return;
    };
    let mut new = transform;
    let row = |ui: &mut egui::Ui, what: &str, vector: &mut Vec3, speed: f32, min: f32| {
        ui.horizontal(|ui| {
            ui.label(what);
            for value in [&mut vector.x, &mut vector.y, &mut vector.z] {
                ui.add(egui::DragValue::new(value).speed(speed).range(min..=1e6));
            }
        });
    };
    row(ui, "position, m", &mut new.translation, 0.05, -1e6);
    // Lights and cameras have a size of their own.
    if world.get::<GiVolume>(entity).is_some() {
        row(ui, "scale", &mut new.scale, 0.01, 1e-3);
    }
    if new != transform
        && let Some(mut transform) = world.get_mut::<Transform>(entity)
    {
        *transform = new;
    }
}

/// A point before the primary camera, metres away.
fn ahead(world: &World, distance: f32) -> Vec3 {
    let primary = world.resource::<PrimaryGiCamera>().0;
    let transform = primary.and_then(|camera| world.get::<GlobalTransform>(camera));
    transform.map_or(Vec3::ZERO, |transform| {
        let forward = Vec3::from(transform.affine().matrix3 * Vec3A::NEG_Z);
        transform.translation() + forward.normalize_or_zero() * distance
    })
}
