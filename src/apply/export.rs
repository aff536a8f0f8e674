//! The export: indirect light for what is not deferred.
//!
//! Forward, transparent and custom materials cannot take part in the gather, which reads the G-buffer.
//! All of Bevy's shaders add the light of an [`IrradianceVolume`], though, so each [`GiVolume`] has
//! one: ambient cubes (Mitchell et al. 2006, "Shading in Valve's Source engine", slide 28) on a grid
//! of ambient cubes, [`CUBE_SPACING`] voxels apart, which the technique brings up to date on the GPU while
//! its cache changes.
//!
//! # Not twice
//!
//! The deferred pixels of a GI camera have the composite's light and must not have this one too, but
//! go through the same shader. So Bevy's texture is black, and holds the light only between the
//! deferred lighting and the end of the main pass of GI cameras. Other cameras do not see the volume
//! at all, and GI cameras see no baked one: their own light stands in its place.
//!
//! # Limits
//!
//! Diffuse light only, as coarse as the cubes. Where the adapter has no texture arrays, Bevy knows
//! one volume a camera: the finest around it. Bevy has no irradiance volumes on the web.

use std::{any::TypeId, marker::PhantomData};

use bevy::{
    app::{App, Plugin, PostUpdate},
    asset::{AssetId, AssetServer, Assets, Handle, RenderAssetUsages},
    camera::visibility::{NoFrustumCulling, VisibilitySystems, VisibleEntities},
    core_pipeline::schedule::Core3d,
    ecs::prelude::*,
    image::{Image, ImageSampler},
    light::{IrradianceVolume, LightProbe, cluster::ClusterVisibilityClass},
    math::{FloatOrd, UVec3, Vec3},
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup,
        render_asset::RenderAssets,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue, ViewQuery},
        settings::WgpuFeatures,
        sync_world::RenderEntity,
        texture::GpuImage,
    },
    shader::load_shader_library,
    transform::components::{GlobalTransform, Transform},
};

use crate::{
    camera::{ExtractedGiCamera, GiCamera, PrimaryGiCamera},
    debug::{GiDebugSettings, GiView},
    gpu::{
        caps::{GiSupport, supported},
        compute::{ComputePass, Dispatch, Recorder, block, pass_name},
        layout::{GroupLayout, uniform},
        statistics::{GiStatistics, Tracked},
    },
    scene::{
        bind_group::{SceneBindGroup, scene_layout},
        units::LightUnits,
        volume::{ExtractedVolume, GiVolume, Grid, VolumeGrid, update_grids, with_volume},
    },
    schedule::{GiPrepare, GiSystems},
    settings::{GiSettings, GiTechnique},
    surface::ViewSurface,
    technique::{Cache, LookupShader, Technique, possible},
};

/// Voxels between ambient cubes.
const CUBE_SPACING: u32 = 8;
/// Frames in which all cubes are brought up to date once.
const PARTS: u32 = 4;

/// Ambient cubes along each axis of a grid.
fn dims(grid: &Grid) -> UVec3 {
    grid.dims.map(|voxels| voxels.div_ceil(CUBE_SPACING))
}

/// On a [`GiVolume`]: its irradiance volume.
#[derive(Component)]
struct VolumeExport {
    /// The light probe's entity.
    probe: Entity,
    /// What Bevy looks up.
    image: Handle<Image>,
    dims: UVec3,
    /// Nits that are 1 in it.
    unit: f32,
}

/// Marks the light probes that are exports.
#[derive(Component)]
struct ExportProbe;

pub(crate) struct ExportPlugin;

impl Plugin for ExportPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "export.wgsl");
        app.add_observer(despawn_probe).add_systems(
            PostUpdate,
            (
                sync_exports.after(update_grids),
                choose_volumes.after(VisibilitySystems::CheckVisibility),
            ),
        );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_observer(with_volume::<(ExtractedExport, ExportCubes)>)
            .add_systems(ExtractSchedule, extract_exports)
            .add_systems(
                Render,
                prepare_exports.in_set(GiPrepare::Views).run_if(supported),
            )
            .add_systems(
                Core3d,
                (
                    show_exports.in_set(GiSystems::ShowExport),
                    hide_exports.in_set(GiSystems::HideExport),
                ),
            );
    }
}

/// Gives each volume its light probe, and moves it with the volume.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn sync_exports(
    mut commands: Commands,
    settings: Res<GiSettings>,
    support: Res<GiSupport>,
    units: Res<LightUnits>,
    (primary, cameras): (Res<PrimaryGiCamera>, Query<&GiCamera>),
    mut volumes: Query<(Entity, &GiVolume, &VolumeGrid, Option<&mut VolumeExport>)>,
    orphans: Query<Entity, (With<VolumeExport>, Without<GiVolume>)>,
    mut lights: Query<
        (
            &mut Transform,
            &mut GlobalTransform,
            &mut LightProbe,
            &mut IrradianceVolume,
        ),
        With<ExportProbe>,
    >,
    mut images: ResMut<Assets<Image>>,
) {
    for volume in &orphans {
        commands.entity(volume).remove::<VolumeExport>();
    }
    let wanted = settings.forward_light && support.is_supported();
    let unit = units.light();
    // Irradiance volumes are the same for all cameras.
    let camera = primary.0.and_then(|camera| cameras.get(camera).ok());
    let strength = camera.map_or(1.0, |camera| camera.strength);
    for (entity, volume, grid, export) in &mut volumes {
        let Some(grid) = grid.0.filter(|_| wanted) else {
            if export.is_some() {
                commands.entity(entity).remove::<VolumeExport>();
            }
            continue;
        };
        let dims = dims(&grid);
        let place = Transform::from_translation(grid.center()).with_scale(grid.size());
        let falloff = Vec3::splat(2.0 * volume.fade);
        let intensity = unit * strength;
        match export.filter(|export| export.dims == dims) {
            Some(mut export) => {
                export.unit = unit;
                let Ok((mut transform, mut global, mut light, mut volume)) =
                    lights.get_mut(export.probe)
                else {
                    continue;
                };
                if *transform != place {
                    *transform = place;
                    *global = place.into();
                }
                if light.falloff != falloff {
                    light.falloff = falloff;
                }
                if volume.intensity != intensity {
                    volume.intensity = intensity;
                }
            }
            None => {
                let image = images.add(ambient_cubes(dims));
                let probe = commands
                    .spawn((
                        ExportProbe,
                        LightProbe { falloff },
                        IrradianceVolume {
                            voxels: image.clone(),
                            intensity,
                            ..Default::default()
                        },
                        // Out of sight, the camera's pipelines would change.
                        NoFrustumCulling,
                        place,
                    ))
                    .id();
                commands.entity(entity).insert(VolumeExport {
                    probe,
                    image,
                    dims,
                    unit,
                });
            }
        }
    }
}

/// A black texture, as Bevy's irradiance volumes have it.
fn ambient_cubes(dims: UVec3) -> Image {
    let size = dims * UVec3::new(1, 2, 3);
    let mut image = Image::new_uninit(
        Extent3d {
            width: size.x,
            height: size.y,
            depth_or_array_layers: size.z,
        },
        TextureDimension::D3,
        TextureFormat::Rgba16Float,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.texture_descriptor.usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
    image.sampler = ImageSampler::linear();
    image
}

/// The light probe goes with the volume, or with a probe of another size.
fn despawn_probe(
    removed: On<Discard, VolumeExport>,
    exports: Query<&VolumeExport>,
    mut commands: Commands,
) {
    if let Ok(export) = exports.get(removed.entity) {
        commands.entity(export.probe).try_despawn();
    }
}

/// Which irradiance volumes each camera sees: GI cameras the exports, all others what is theirs.
fn choose_volumes(
    settings: Res<GiSettings>,
    support: Res<GiSupport>,
    device: Option<Res<RenderDevice>>,
    mut cameras: Query<(Option<&GiCamera>, &GlobalTransform, &mut VisibleEntities)>,
    exports: Query<&GlobalTransform, With<ExportProbe>>,
    baked: Query<(), (With<IrradianceVolume>, Without<ExportProbe>)>,
) {
    if exports.is_empty() {
        return;
    }
    let several = device.is_some_and(|device| has_texture_arrays(&device));
    for (gi, camera, mut visible) in &mut cameras {
        let visible = visible.get_mut(TypeId::of::<ClusterVisibilityClass>());
        if gi.is_none_or(|gi| gi.active_technique(&settings, &support) == GiTechnique::OFF) {
            visible.retain(|entity| !exports.contains(*entity));
            continue;
        }
        visible.retain(|entity| !baked.contains(*entity));
        if several {
            continue;
        }
        // The finest volume around the camera, else the nearest.
        let rank = |volume: &GlobalTransform| {
            let size = volume.scale();
            let outside = (camera.translation() - volume.translation()).abs() - 0.5 * size;
            (
                FloatOrd(outside.max_element().max(0.0)),
                FloatOrd(size.max_element()),
            )
        };
        let best = visible
            .iter()
            .filter_map(|entity| Some((*entity, rank(exports.get(*entity).ok()?))))
            .min_by_key(|(_, rank)| *rank)
            .map(|(entity, _)| entity);
        visible.retain(|entity| Some(*entity) == best || !exports.contains(*entity));
    }
}

/// Whether Bevy's shaders look several irradiance volumes up (`binding_arrays_are_usable`).
fn has_texture_arrays(device: &RenderDevice) -> bool {
    device.features().contains(
        WgpuFeatures::TEXTURE_BINDING_ARRAY
            | WgpuFeatures::SAMPLED_TEXTURE_AND_STORAGE_BUFFER_ARRAY_NON_UNIFORM_INDEXING,
    )
}

/// On a volume's entity in the render world: where its export goes.
#[derive(Component, Clone, Copy)]
struct ExtractedExport {
    image: AssetId<Image>,
    dims: UVec3,
    /// Nits that are 1 in it.
    unit: f32,
}

type VolumeData = (RenderEntity, Option<&'static VolumeExport>);

fn extract_exports(mut commands: Commands, volumes: Extract<Query<VolumeData, With<GiVolume>>>) {
    for (entity, export) in &volumes {
        let mut entity = commands.entity(entity);
        match export {
            Some(export) => entity.insert(ExtractedExport {
                image: export.image.id(),
                dims: export.dims,
                unit: export.unit,
            }),
            None => entity.remove::<(ExtractedExport, ExportCubes)>(),
        };
    }
}

/// Uniform of an export; `export.wgsl` is its twin.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct GpuExport {
    origin: Vec3,
    part: u32,
    spacing: Vec3,
    parts: u32,
    dims: UVec3,
    unit: f32,
}

/// The ambient cubes of a volume.
#[derive(Component)]
pub(crate) struct ExportCubes {
    pub dims: UVec3,
    /// What the technique writes.
    cubes: Tracked<Texture>,
    view: TextureView,
    /// As large, and black for ever.
    black: Tracked<Texture>,
    grid: Grid,
    /// Parts that are out of date.
    left: u32,
    part: u32,
    /// Nits that are 1.
    pub unit: f32,
    job: Option<ExportJob>,
}

/// What a frame brings up to date of a volume.
struct ExportJob {
    /// Whose turn it is.
    technique: GiTechnique,
    /// Layers of cubes.
    layers: u32,
    /// Group 0.
    group: BindGroup,
}

/// Layout of group 0; `export.wgsl` is its twin.
fn export_layout() -> GroupLayout {
    GroupLayout::new("gi/apply/export", ShaderStages::COMPUTE)
        .with("exported", uniform::<GpuExport>())
        .with(
            "ambient_cubes",
            texture_storage_3d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
        )
}

impl ExportCubes {
    /// Where Bevy's irradiance volumes have them, see [`ambient_cubes`].
    pub fn view(&self) -> &TextureView {
        &self.view
    }

    fn new(dims: UVec3, grid: Grid, device: &RenderDevice, statistics: &GiStatistics) -> Self {
        let texture = |name, label, usage| {
            let size = dims * UVec3::new(1, 2, 3);
            let texture = device.create_texture(&TextureDescriptor {
                label: Some(label),
                size: Extent3d {
                    width: size.x,
                    height: size.y,
                    depth_or_array_layers: size.z,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D3,
                format: TextureFormat::Rgba16Float,
                usage: usage | TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            statistics.texture(name, texture)
        };
        let cubes = texture(
            "apply/export",
            "gi/apply/export",
            // Debug views read it.
            TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
        );
        Self {
            dims,
            view: cubes.create_view(&TextureViewDescriptor::default()),
            cubes,
            black: texture(
                "apply/export_black",
                "gi/apply/export_black",
                TextureUsages::COPY_DST,
            ),
            grid,
            left: PARTS,
            part: 0,
            unit: 1.0,
            job: None,
        }
    }
}

/// The light of a volume changes: it is exported again. A component of its entity.
#[derive(Component)]
pub(crate) struct ExportAgain;

/// The technique that lights forward-rendered objects. Irradiance volumes are the same for all cameras: where
/// techniques differ, the general one.
pub(crate) fn exported_technique<'a>(
    cameras: impl IntoIterator<Item = &'a ExtractedGiCamera>,
    settings: &GiSettings,
) -> Option<GiTechnique> {
    cameras
        .into_iter()
        .map(|camera| camera.technique)
        .filter(|technique| !technique.is_off())
        .max_by_key(|technique| *technique == settings.technique)
}

type ExportData = (
    Entity,
    &'static ExtractedVolume,
    &'static ExtractedExport,
    Has<ExportAgain>,
    Option<&'static mut ExportCubes>,
);

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
fn prepare_exports(
    mut commands: Commands,
    mut volumes: Query<ExportData>,
    cameras: Query<&ExtractedGiCamera>,
    settings: Res<GiSettings>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
) {
    let technique = exported_technique(cameras, &settings);
    let mut count = 0;
    for (entity, volume, export, again, cubes) in &mut volumes {
        count += u64::from(export.dims.element_product());
        let Some(mut cubes) = cubes.filter(|cubes| cubes.dims == export.dims) else {
            let new = ExportCubes::new(export.dims, volume.grid, &device, &statistics);
            commands.entity(entity).insert(new);
            continue;
        };
        if again || cubes.grid != volume.grid {
            cubes.grid = volume.grid;
            cubes.left = PARTS;
        }
        cubes.job = None;
        // Bevy takes the light for what it is in the new unit from this frame on.
        let rescaled = cubes.unit != export.unit;
        let Some(technique) = technique.filter(|_| rescaled || cubes.left > 0) else {
            continue;
        };
        cubes.unit = export.unit;
        let parts = if rescaled { 1 } else { PARTS };
        cubes.left = cubes.left.saturating_sub(1);
        cubes.part = (cubes.part + 1) % parts;
        let mut uniform = UniformBuffer::from(GpuExport {
            origin: volume.grid.origin,
            part: cubes.part,
            spacing: volume.grid.size() / cubes.dims.as_vec3(),
            parts,
            dims: cubes.dims,
            unit: cubes.unit,
        });
        uniform.write_buffer(&device, &queue);
        let group = export_layout()
            .bind(&device, &cache)
            .with("exported", &uniform)
            .with("ambient_cubes", &cubes.view)
            .build();
        cubes.job = Some(ExportJob {
            technique,
            layers: cubes.dims.z.div_ceil(parts),
            group,
        });
    }
    statistics.count("apply/ambient_cubes", count);
}

/// Fills Bevy's irradiance volumes before anything is drawn forward.
fn show_exports(
    _: ViewQuery<&ViewSurface>,
    volumes: Query<(&ExtractedExport, &ExportCubes)>,
    images: Res<RenderAssets<GpuImage>>,
    debug: Res<GiDebugSettings>,
    mut ctx: RenderContext,
) {
    if debug.view == GiView::Direct {
        return;
    }
    for (export, cubes) in &volumes {
        copy(export, &cubes.cubes, &images, &mut ctx);
    }
}

/// Empties them for the next camera.
fn hide_exports(
    _: ViewQuery<&ViewSurface>,
    volumes: Query<(&ExtractedExport, &ExportCubes)>,
    images: Res<RenderAssets<GpuImage>>,
    mut ctx: RenderContext,
) {
    for (export, cubes) in &volumes {
        copy(export, &cubes.black, &images, &mut ctx);
    }
}

/// Copies ambient cubes to where Bevy looks them up.
fn copy(
    export: &ExtractedExport,
    from: &Texture,
    images: &RenderAssets<GpuImage>,
    ctx: &mut RenderContext,
) {
    let Some(image) = images.get(export.image) else {
        return;
    };
    if image.texture.size() == from.size() {
        ctx.command_encoder().copy_texture_to_texture(
            from.as_image_copy(),
            image.texture.as_image_copy(),
            from.size(),
        );
    }
}

/// The pass of one technique.
pub(crate) struct TechniqueExportPlugin<T>(PhantomData<T>);

impl<T> Default for TechniqueExportPlugin<T> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<T: Technique> Plugin for TechniqueExportPlugin<T> {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_export_pass::<T>.run_if(possible::<T>))
            .add_systems(RenderGraph, export::<T>.in_set(GiSystems::Export));
    }
}

#[derive(Resource)]
struct ExportPass<T>(ComputePass, PhantomData<T>);

fn init_export_pass<T: Technique>(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let Some(LookupShader {
        shader,
        entry,
        defs,
    }) = T::export(&server)
    else {
        return;
    };
    let pass = ComputePass::new(
        &cache,
        pass_name(T::NAME, "export"),
        block::CUBE,
        &[&export_layout(), &scene_layout(), &T::cache_layout()],
        shader,
        entry,
        defs,
    );
    commands.insert_resource(ExportPass::<T>(pass, PhantomData));
}

fn export<T: Technique>(
    volumes: Query<(&ExportCubes, &T::Cache, &SceneBindGroup)>,
    pass: Option<Res<ExportPass<T>>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pass) = pass else { return };
    let runs: Vec<_> = volumes
        .iter()
        .filter_map(|(cubes, technique, scene)| {
            let job = cubes.job.as_ref()?;
            let threads = cubes.dims.with_z(job.layers * 6);
            (job.technique == GiTechnique::of::<T>()).then_some((
                Dispatch::Threads(threads),
                [&job.group, &scene.0, technique.bind_group()?],
            ))
        })
        .collect();
    if runs.is_empty() {
        return;
    }
    let diagnostics = ctx.diagnostic_recorder();
    Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics: diagnostics.as_deref(),
    }
    .run_all(&pass.0, None, runs);
}
