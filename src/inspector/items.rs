//! Volumes, lights and cameras of the world: lists and parameters.

use bevy::{
    camera::{Camera, Camera3d},
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
use crate::{FieldRange, GiCamera, GiLight, GiVolume};

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
    lights(world, inspector, ui);
    cameras(world, inspector, ui);
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
            component::<GiVolume>(world, entity, &GiVolume::ranges(), search, ui);
            if ui.button("Remove volume").clicked() {
                remove::<GiVolume>(world, entity);
            }
        },
    );
    if ui
        .button("+ volume")
        .on_hover_text("A GiVolume around the point that the camera looks at")
        .clicked()
    {
        let at = ahead(world, 5.0);
        let volume = world.spawn((
            Spawned,
            GiVolume::default(),
            Transform::from_translation(at),
        ));
        inspector.selected = Some(volume.id());
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
            if world.get::<GiLight>(entity).is_some() {
                component::<GiLight>(world, entity, &GiLight::ranges(), search, ui);
                if ui.button("Remove GiLight").clicked() {
                    world.entity_mut(entity).remove::<GiLight>();
                }
            } else if ui
                .button("+ GiLight")
                .on_hover_text("Parameters of this light's share in global illumination")
                .clicked()
            {
                world.entity_mut(entity).insert(GiLight::default());
            }
            component::<PointLight>(world, entity, &[], search, ui);
            component::<SpotLight>(world, entity, &[], search, ui);
            component::<DirectionalLight>(world, entity, &[], search, ui);
            component::<RectLight>(world, entity, &[], search, ui);
            if ui.button("Remove light").clicked() {
                remove::<(PointLight, SpotLight, DirectionalLight, RectLight, GiLight)>(
                    world, entity,
                );
            }
        },
    );
    ui.horizontal_wrapped(|ui| {
        let at = |world: &mut World| Transform::from_translation(ahead(world, 3.0));
        let new = if ui.button("+ point light").clicked() {
            let at = at(world);
            let light = PointLight {
                shadow_maps_enabled: true,
                ..Default::default()
            };
            Some(world.spawn((Spawned, light, at)).id())
        } else if ui.button("+ spot light").clicked() {
            let at = at(world).looking_to(Vec3::NEG_Y, Vec3::X);
            let light = SpotLight {
                shadow_maps_enabled: true,
                ..Default::default()
            };
            Some(world.spawn((Spawned, light, at)).id())
        } else if ui.button("+ rect light").clicked() {
            let at = at(world).looking_to(Vec3::NEG_Y, Vec3::X);
            Some(world.spawn((Spawned, RectLight::default(), at)).id())
        } else if ui.button("+ sun").clicked() {
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
    let items = list::<Option<&GiCamera>, With<Camera3d>>(world, |gi| match gi {
        None => "no global illumination".into(),
        Some(GiCamera { technique: None }) => "the technique of the settings".into(),
        Some(GiCamera {
            technique: Some(technique),
        }) => technique.title().into(),
    });
    section(
        world,
        inspector,
        ui,
        "Cameras",
        &items,
        |world, entity, search, ui| {
            if world.get::<GiCamera>(entity).is_some() {
                component::<GiCamera>(world, entity, &[], search, ui);
                if ui.button("Remove GiCamera").clicked() {
                    world.entity_mut(entity).remove::<GiCamera>();
                }
            } else if ui.button("+ GiCamera").clicked() {
                world.entity_mut(entity).insert(GiCamera::default());
            }
        },
    );
}

/// The fields of a component, if the entity has it.
fn component<T>(
    world: &mut World,
    entity: Entity,
    ranges: &[FieldRange],
    search: &str,
    ui: &mut egui::Ui,
) where
    T: Component<Mutability = Mutable> + Reflect + bevy::reflect::TypePath + Default + Clone,
{
    let Some(mut value) = world.get::<T>(entity).cloned() else {
        return;
    };
    let group = Group {
        title: T::short_type_path(),
        default: &T::default(),
        ranges,
        search,
        open: true,
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

/// A point before the first camera that shows GI, metres away.
fn ahead(world: &mut World, distance: f32) -> Vec3 {
    let mut cameras = world.query_filtered::<(&Camera, &GlobalTransform), With<GiCamera>>();
    let first = cameras.iter(world).min_by_key(|(camera, _)| camera.order);
    first.map_or(Vec3::ZERO, |(_, transform)| {
        let forward = Vec3::from(transform.affine().matrix3 * Vec3A::NEG_Z);
        transform.translation() + forward.normalize_or_zero() * distance
    })
}
