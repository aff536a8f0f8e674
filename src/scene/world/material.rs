//! [`GiMaterial`]: the surface of a material, as bounced light meets it.

use std::{any::TypeId, collections::HashMap, marker::PhantomData};

use bevy::{
    app::{App, Plugin, PostUpdate},
    asset::{AssetEvent, AssetEventSystems, AssetServer, Handle},
    ecs::prelude::*,
    pbr::{ExtendedMaterial, Material, MaterialExtension, MeshMaterial3d, StandardMaterial},
    render::RenderApp,
    shader::{Shader, ShaderRef},
};

use super::casters::{SceneCasters, changed_asset, collect_casters};

/// A material that bounces light with its own colour and emission.
///
/// [`StandardMaterial`], and every `ExtendedMaterial<StandardMaterial, _>` for which [`GiMaterialPlugin`] is
/// added, bounce light with their base colour and emission. For a custom material, provide a fragment shader
/// that describes its surface:
///
/// ```wgsl
/// #import bevy_pbr::prepass_io::VertexOutput
/// #import bevy_gi::scene::voxels::splat::{VoxelSurface, splat, triangle_normal}
///
/// @fragment
/// fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) {
///     let normal = triangle_normal(in);
///     let albedo = ...; // from the material's bindings, group 3
///     splat(in, is_front, normal, VoxelSurface(albedo, vec3(0.0), false));
/// }
/// ```
///
/// Meshes with any other material block light, and bounce it as grey with an albedo of 1/2.
pub trait GiMaterial: Material {
    /// The fragment shader that voxelizes the material. Default: that of [`StandardMaterial`]; the material
    /// must then have the same bindings.
    fn voxelize_shader() -> ShaderRef {
        ShaderRef::Default
    }
}

impl GiMaterial for StandardMaterial {}

impl<E: MaterialExtension> GiMaterial for ExtendedMaterial<StandardMaterial, E> {}

/// Makes meshes with the material `M` bounce light with its colour and emission, see [`GiMaterial`]. Add it
/// after [`GiPlugins`](crate::GiPlugins). `StandardMaterial` has it already.
pub struct GiMaterialPlugin<M>(PhantomData<M>);

impl<M> Default for GiMaterialPlugin<M> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<M: GiMaterial> Plugin for GiMaterialPlugin<M> {
    fn build(&self, app: &mut App) {
        app.add_systems(
            PostUpdate,
            watch_material::<M>
                .after(AssetEventSystems)
                .before(collect_casters),
        );
    }

    fn finish(&self, app: &mut App) {
        let shader = match M::voxelize_shader() {
            ShaderRef::Default => None,
            ShaderRef::Handle(handle) => Some(handle),
            ShaderRef::Path(path) => Some(app.world().resource::<AssetServer>().load(path)),
        };
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app
                .world_mut()
                .get_resource_or_init::<MaterialShaders>()
                .0
                .insert(TypeId::of::<M>(), shader);
        }
    }
}

/// Voxelizing shaders by material; `None` is that of `StandardMaterial`.
#[derive(Resource, Default)]
pub(crate) struct MaterialShaders(pub HashMap<TypeId, Option<Handle<Shader>>>);

/// Notes which mesh has which material, and which materials change.
fn watch_material<M: GiMaterial>(
    changed: Query<(Entity, &MeshMaterial3d<M>), Changed<MeshMaterial3d<M>>>,
    all: Query<(), With<MeshMaterial3d<M>>>,
    mut removed: RemovedComponents<MeshMaterial3d<M>>,
    mut events: MessageReader<AssetEvent<M>>,
    mut scene: ResMut<SceneCasters>,
) {
    // Assets may arrive or change without any component changing.
    for id in events.read().filter_map(changed_asset) {
        scene.note_material(id.untyped());
    }
    let of = scene.materials(TypeId::of::<M>());
    for entity in removed.read().filter(|entity| !all.contains(*entity)) {
        of.remove(&entity);
    }
    of.extend(
        changed
            .iter()
            .map(|(entity, handle)| (entity, handle.id().untyped())),
    );
}
