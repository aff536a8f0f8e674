//! The gather: one thread per gathered pixel and volume looks the technique's cache up.

use std::marker::PhantomData;

use bevy::{
    app::{App, Plugin},
    asset::AssetServer,
    camera::primitives::{Aabb, Frustum},
    core_pipeline::schedule::Core3d,
    ecs::prelude::*,
    log::warn,
    math::{Affine3A, UVec2, Vec3, primitives::ViewFrustum},
    render::{
        Render, RenderApp, RenderStartup,
        render_resource::{binding_types::*, *},
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::{ExtractedView, ViewUniformOffset},
    },
    shader::load_shader_library,
};

use crate::{
    camera::ExtractedGiCamera,
    debug::{GiView, Painter, ShownView},
    gpu::{
        caps::supported,
        compute::{ComputePass, Dispatch, Recorder, block, pass_name},
        layout::{GroupLayout, loaded, uniform},
        statistics::{GiStatistics, Tracked},
    },
    scene::{
        bind_group::{SceneBindGroup, scene_layout},
        units::LightUnits,
        volume::ExtractedVolume,
    },
    schedule::{GiPrepare, GiSystems},
    settings::{GiHistory, GiSettings, GiTechnique, Lookup},
    surface::{ViewSurface, surface_layout},
    technique::{Cache, LookupShader, Technique, ViewCache, possible},
};

/// Volumes that light one camera at most: each is a pass over its picture. Those that the camera does not see do
/// not count.
const MAX_VOLUMES: usize = 64;

/// A volume's box, for blending.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(crate) struct GpuBox {
    min: Vec3,
    /// Metres over which the volume fades out at its border.
    fade: f32,
    max: Vec3,
    pad: f32,
}

impl GpuBox {
    /// Everything.
    const ALL: Self = Self {
        min: Vec3::splat(-1e30),
        fade: 0.0,
        max: Vec3::splat(1e30),
        pad: 0.0,
    };

    fn new(volume: &ExtractedVolume) -> Self {
        let extent = volume.grid.size();
        Self {
            min: volume.grid.origin,
            max: volume.grid.origin + extent,
            fade: volume.fade * extent.min_element(),
            pad: 0.0,
        }
    }
}

/// Uniform of the gather.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(crate) struct GpuGather {
    /// Gathered pixels.
    size: UVec2,
    /// Pixels of the viewport.
    full_size: UVec2,
    /// Pixels per gathered pixel, along each axis.
    divisor: u32,
    /// Counts frames since the history was reset.
    frame: u32,
    /// Whether light from the sky is gathered too.
    with_sky: u32,
    /// Whether this is the first volume's pass.
    first: u32,
    /// The volume of this pass.
    volume_box: GpuBox,
    /// Nits of a unit of the light that is written.
    unit: f32,
}

/// The indirect light of a camera, at gather resolution, in the render world.
///
/// Two `Rgba16Float` textures: `E / pi` in units of [`unit`](Self::unit) nits with the part of the pixel that
/// some volume lights in alpha, and specular radiance likewise.
#[derive(Component)]
pub(crate) struct ViewIndirect {
    pub size: UVec2,
    pub full_size: UVec2,
    pub divisor: u32,
    /// Counts frames since the history was reset.
    pub frame: u32,
    /// Nits of a unit.
    pub unit: f32,
    epoch: u32,
    /// What a technique's own shader gathers in place of its light, if such a view is shown.
    view: Option<GiView>,
    /// The volumes that the camera sees, the finest first.
    pub volumes: Vec<Entity>,
    /// Diffuse and specular; volumes after the first read one pair and write the other.
    targets: [[Tracked<TextureView>; 2]; 2],
    /// The passes: the volume, and group 3. One a volume, or one in all, see [`Lookup`].
    passes: Vec<(Entity, BindGroup)>,
}

impl ViewIndirect {
    /// Diffuse and specular, once gathered.
    pub fn result(&self) -> &[Tracked<TextureView>; 2] {
        &self.targets[self.passes.len().saturating_sub(1) % 2]
    }
}

pub(crate) struct ViewIndirectPlugin;

impl Plugin for ViewIndirectPlugin {
    fn build(&self, app: &mut App) {
        load_shader_library!(app, "gather.wgsl");
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app.add_systems(
            Render,
            prepare_view_indirect
                .in_set(GiPrepare::Views)
                .run_if(supported),
        );
    }
}

/// Layout of group 3 of the gather; `gather.wgsl` is its twin.
fn gather_layout() -> GroupLayout {
    let target = || texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let source = || texture_2d(loaded());
    GroupLayout::new("gi/gather", ShaderStages::COMPUTE)
        .with("gather", uniform::<GpuGather>())
        .with("diffuse_before", source())
        .with("specular_before", source())
        .with("diffuse_target", target())
        .with("specular_target", target())
}

/// A texture at gather resolution that passes write and read.
pub(crate) fn gather_texture(
    device: &RenderDevice,
    statistics: &GiStatistics,
    name: &'static str,
    size: UVec2,
) -> Tracked<TextureView> {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some(&format!("gi/{name}")),
        size: Extent3d {
            width: size.x.max(1),
            height: size.y.max(1),
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba16Float,
        usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    statistics
        .texture(name, texture)
        .map(|texture| texture.create_view(&TextureViewDescriptor::default()))
}

type ViewData<'a> = (
    Entity,
    &'a ExtractedView,
    Option<(&'a ViewSurface, &'a ExtractedGiCamera)>,
    Option<&'a mut ViewIndirect>,
);

/// The volumes that a camera sees, finest first; where they are too many, those that are nearest to it.
fn seen_volumes<'a>(
    view: &ExtractedView,
    volumes: &[(Entity, &'a ExtractedVolume)],
    statistics: &GiStatistics,
) -> Vec<(Entity, &'a ExtractedVolume)> {
    let clip_from_view = view.clip_from_view;
    let clip_from_world = clip_from_view * view.world_from_view.to_matrix().inverse();
    let frustum = Frustum(ViewFrustum::from_clip_from_world(&clip_from_world));
    let is_seen = |(_, volume): &&(Entity, &ExtractedVolume)| {
        let (center, half) = (volume.grid.center(), 0.5 * volume.grid.size());
        let aabb = Aabb {
            center: center.into(),
            half_extents: half.into(),
        };
        frustum.intersects_obb(&aabb, &Affine3A::IDENTITY, true, false)
    };
    let mut seen: Vec<_> = volumes.iter().filter(is_seen).copied().collect();
    if seen.len() > MAX_VOLUMES {
        let warning = format!(
            "a camera sees {} GiVolumes, more than {MAX_VOLUMES}: the farthest do not light it",
            seen.len()
        );
        if !statistics.warnings().contains(&warning) {
            warn!("{warning}");
        }
        statistics.warn(vec![warning]);
        let eye = view.world_from_view.translation();
        let distance =
            |volume: &ExtractedVolume| volume.grid.bounds().closest_point(eye).distance(eye.into());
        seen.sort_by(|(_, a), (_, b)| {
            distance(a)
                .total_cmp(&distance(b))
                .then(a.rank.cmp(&b.rank))
        });
        seen.truncate(MAX_VOLUMES);
        seen.sort_by_key(|(_, volume)| volume.rank);
    }
    if seen.is_empty() {
        // What lit the picture before is not seen any more: one pass writes that.
        seen.extend(volumes.first().copied());
    }
    seen
}

#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn prepare_view_indirect(
    mut commands: Commands,
    mut views: Query<ViewData>,
    volumes: Query<(Entity, &ExtractedVolume)>,
    settings: Res<GiSettings>,
    (history, units, shown): (Res<GiHistory>, Res<LightUnits>, ShownView),
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
) {
    let mut sorted: Vec<_> = volumes.iter().collect();
    sorted.sort_by_key(|(_, volume)| volume.rank);
    let layout = gather_layout();
    for (entity, view, surface, indirect) in &mut views {
        let Some((surface, camera)) = surface else {
            if indirect.is_some() {
                commands.entity(entity).remove::<ViewIndirect>();
            }
            continue;
        };
        let divisor = camera.settings.resolution.divisor();
        let size = UVec2::new(
            surface.size.x.div_ceil(divisor),
            surface.size.y.div_ceil(divisor),
        );
        let fits = |old: &ViewIndirect| {
            old.size == size && old.full_size == surface.size && old.divisor == divisor
        };
        let own = *shown.entry();
        let own = (own.painter == Painter::Gather && own.technique == Some(camera.technique))
            .then_some(own);
        let own_view = own.map(|own| own.view);
        // Plain numbers have no unit.
        let unit = match own {
            Some(own) if !own.is_luminance => 1.0,
            _ => units.light(),
        };
        let (targets, frame) = match indirect.as_deref() {
            Some(old) if fits(old) => (
                old.targets.clone(),
                if old.epoch == history.epoch() && old.view == own_view && !camera.settings.reset {
                    old.frame.wrapping_add(1)
                } else {
                    0
                },
            ),
            _ => {
                let texture = |name| gather_texture(&device, &statistics, name, size);
                let targets = [
                    ["apply/diffuse", "apply/specular"].map(texture),
                    ["apply/diffuse_blend", "apply/specular_blend"].map(texture),
                ];
                (targets, 0)
            }
        };
        let seen = seen_volumes(view, &sorted, &statistics);
        let boxes = seen
            .iter()
            .map(|(entity, volume)| (*entity, GpuBox::new(volume)));
        let boxes: Vec<_> = match camera.lookup {
            Lookup::PerVolume => boxes.collect(),
            Lookup::PerView => boxes
                .map(|(entity, _)| (entity, GpuBox::ALL))
                .take(1)
                .collect(),
        };
        let passes = boxes
            .into_iter()
            .enumerate()
            .map(|(i, (entity, volume_box))| {
                let mut uniform = UniformBuffer::from(GpuGather {
                    size,
                    full_size: surface.size,
                    divisor,
                    frame,
                    with_sky: settings.replace_ambient.into(),
                    first: (i == 0).into(),
                    volume_box,
                    unit,
                });
                uniform.write_buffer(&device, &queue);
                let [to, from] = [&targets[i % 2], &targets[1 - i % 2]];
                let group = layout
                    .bind(&device, &cache)
                    .with("gather", &uniform)
                    .with("diffuse_before", &*from[0])
                    .with("specular_before", &*from[1])
                    .with("diffuse_target", &*to[0])
                    .with("specular_target", &*to[1])
                    .build();
                (entity, group)
            })
            .collect();
        commands.entity(entity).insert(ViewIndirect {
            size,
            full_size: surface.size,
            divisor,
            frame,
            unit,
            epoch: history.epoch(),
            view: own_view,
            volumes: seen.iter().map(|(entity, _)| *entity).collect(),
            targets,
            passes,
        });
    }
}

/// Adds the gather of a technique.
pub(crate) struct GatherPlugin<T>(PhantomData<T>);

impl<T> Default for GatherPlugin<T> {
    fn default() -> Self {
        Self(PhantomData)
    }
}

impl<T: Technique> Plugin for GatherPlugin<T> {
    fn build(&self, app: &mut App) {
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .add_systems(RenderStartup, init_gather_passes::<T>.run_if(possible::<T>))
            .add_systems(Core3d, gather::<T>.in_set(GiSystems::Gather));
    }
}

/// The gather of a technique.
#[derive(Resource)]
struct GatherPasses<T: Technique> {
    light: ComputePass,
    /// What runs in its place for a view.
    views: Vec<(GiView, ComputePass)>,
    marker: PhantomData<T>,
}

fn init_gather_passes<T: Technique>(
    mut commands: Commands,
    server: Res<AssetServer>,
    cache: Res<PipelineCache>,
) {
    let layouts = [
        &surface_layout(),
        &scene_layout(),
        &T::cache_layout(),
        &gather_layout(),
    ];
    let pass = |name, lookup: LookupShader| {
        let LookupShader {
            shader,
            entry,
            defs,
        } = lookup;
        let name = pass_name(T::NAME, name);
        ComputePass::new(&cache, name, block::TILE, &layouts, shader, entry, defs)
    };
    let views = T::VIEWS
        .iter()
        .filter_map(|own| Some((own.view, pass("show", own.shader?(&server)))));
    commands.insert_resource(GatherPasses::<T> {
        light: pass("gather", T::gather(&server)),
        views: views.collect(),
        marker: PhantomData,
    });
}

fn gather<T: Technique>(
    view: ViewQuery<(
        &ViewSurface,
        &ViewIndirect,
        &ViewUniformOffset,
        Option<&T::ViewCache>,
    )>,
    volumes: Query<(Option<&T::Cache>, &SceneBindGroup)>,
    passes: Option<Res<GatherPasses<T>>>,
    cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (surface, indirect, offset, own) = view.into_inner();
    let Some(passes) = passes else { return };
    if surface.technique != GiTechnique::of::<T>() {
        return;
    }
    let shown = passes
        .views
        .iter()
        .find(|(view, _)| indirect.view == Some(*view));
    let pass = shown.map_or(&passes.light, |(_, pass)| pass);
    let runs = indirect.passes.iter().filter_map(|(volume, group)| {
        let (cache, scene) = volumes.get(*volume).ok()?;
        let lookup = match T::LOOKUP {
            Lookup::PerVolume => cache?.bind_group(),
            Lookup::PerView => own?.bind_group(),
        };
        Some((
            Dispatch::Threads(indirect.size.extend(1)),
            [&surface.bind_group, &scene.0, lookup?, group],
        ))
    });
    let diagnostics = ctx.diagnostic_recorder();
    Recorder {
        encoder: ctx.command_encoder(),
        cache: &cache,
        diagnostics: diagnostics.as_deref(),
    }
    .run_all(pass, Some(offset.offset), runs);
}
