//! Memory of the maps, and which of them are drawn this frame.

use bevy::{
    core_pipeline::{
        core_3d::CORE_3D_DEPTH_FORMAT,
        deferred::{DEFERRED_LIGHTING_PASS_ID_FORMAT, DEFERRED_PREPASS_FORMAT},
    },
    ecs::{entity::EntityHashMap, prelude::*},
    math::{UVec2, UVec3},
    render::{
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    pipelines::{RsmCapture, RsmPipelines, rsm_layout},
    types::{GpuRsmMap, GpuRsmMaps, GpuRsmResolve, GpuVpl, GpuVpls},
};
use crate::{
    gpu::statistics::{GiStatistics, Tracked},
    scene::{
        capture::{CaptureQueue, CaptureViews},
        light_maps::LightMaps,
        light_views::LitScene,
        lights::SceneLight,
    },
    settings::{GiCaptureSettings, LightShare},
};

/// Virtual point lights that a lamp has at least, on the mean, whatever others there are: about as many as walls, floor and
/// ceiling of a room need to be lit from everywhere.
const VPLS_A_LIGHT: u32 = 16;

/// Virtual point lights of a volume at most.
const MAX_VPLS: u32 = 16384;

/// All reflective shadow maps, in the render world. See the [module](super) for their layout.
#[derive(Resource, Default)]
pub struct SceneRsm {
    pub(super) maps: LightMaps,
    /// Of each volume, finest first: its main-world entity, and how much each map matters there.
    relevance: Vec<(Entity, Vec<f32>)>,
    /// Volumes by their place in the buffer of virtual point lights.
    volumes: EntityHashMap<u32>,
    /// Maps as shaders see them.
    pub(super) gpu: StorageBuffer<GpuRsmMaps>,
    /// [`relevance`](Self::relevance), as shaders see it: by volume, by map.
    pub(super) weights: StorageBuffer<Vec<f32>>,
    pub(super) textures: Option<RsmTextures>,
    /// Those of before, from which pages are copied this frame.
    copy: Option<RsmTextures>,
    /// [`LightMaps::layout`] of the textures.
    layout: u64,
    /// Reads all of it: group 3 of whoever looks it up.
    pub(crate) bind_group: Option<BindGroup>,
    /// Grows whenever texels or virtual point lights have changed.
    pub version: u64,
    /// How lights share the virtual point lights.
    share: LightShare,
    /// Whether that has changed this frame.
    stale: bool,
    pub(super) job: Option<RsmJob>,
}

/// How large all of it is.
#[derive(Clone, Copy, PartialEq, Eq)]
struct RsmShape {
    /// Texels along the side of a page.
    size: u32,
    pages: u32,
    volumes: u32,
    /// Maps that the sums have room for.
    maps: u32,
    /// Virtual point lights of each volume.
    vpls: u32,
}

/// Textures and buffers, as many as there are maps.
pub(super) struct RsmTextures {
    shape: RsmShape,
    texels: Tracked<Texture>,
    flux: Tracked<Texture>,
    vpls: Tracked<Buffer>,
    /// Of each volume, the sum of what its maps are worth up to each.
    sums: Tracked<Buffer>,
    /// A light's G-buffer, before it becomes texels.
    pub gbuffer: Tracked<TextureView>,
    pub pass_id: Tracked<TextureView>,
    pub depth: Tracked<TextureView>,
}

/// What a frame draws.
pub(super) struct RsmJob {
    /// What is kept of textures that were too small, or too large.
    pub copies: Vec<RsmCopy>,
    /// Maps to draw, each with the bind group that makes texels of it.
    pub draw: Vec<(usize, BindGroup)>,
    /// For each level of the flux: its threads, and its bind group.
    pub sum: Vec<(UVec3, BindGroup)>,
    pub vpls: BindGroup,
    /// Virtual point lights of each volume, and volumes.
    pub vpl_count: UVec2,
}

/// A texture that stays, in another one of more or fewer pages.
pub(super) struct RsmCopy {
    pub source: Tracked<Texture>,
    pub target: Tracked<Texture>,
}

impl RsmCopy {
    /// All levels.
    pub fn record(&self, encoder: &mut CommandEncoder) {
        let [from, to] = [&self.source, &self.target].map(|t| t.depth_or_array_layers());
        for mip_level in 0..self.source.mip_level_count() {
            let side = self.source.width() >> mip_level;
            let level = |texture| TexelCopyTextureInfo {
                texture,
                mip_level,
                origin: Origin3d::ZERO,
                aspect: TextureAspect::All,
            };
            encoder.copy_texture_to_texture(
                level(&**self.source),
                level(&**self.target),
                Extent3d {
                    width: side,
                    height: side,
                    depth_or_array_layers: from.min(to),
                },
            );
        }
    }
}

impl SceneRsm {
    /// Number of maps.
    pub fn count(&self) -> u32 {
        self.maps.maps.len() as u32
    }

    /// Virtual point lights of all volumes; 0 while there are no maps.
    pub fn vpl_count(&self) -> u32 {
        let textures = self.textures.as_ref().filter(|_| self.count() > 0);
        textures.map_or(0, |textures| textures.shape.vpls * textures.shape.volumes)
    }

    /// The virtual point lights that a volume looks at: the first, and their number, a power of two. `volume` is its
    /// main-world entity.
    pub fn vpls_of(&self, volume: Entity) -> (u32, u32) {
        let place = self.volumes.get(&volume);
        match (place, self.textures.as_ref().filter(|_| self.count() > 0)) {
            (Some(place), Some(RsmTextures { shape, .. })) => (place * shape.vpls, shape.vpls),
            _ => (0, 0),
        }
    }

    /// `array<GpuVpl>`, while there are maps.
    pub fn vpls(&self) -> Option<&Buffer> {
        self.textures.as_ref().map(|textures| &*textures.vpls)
    }

    /// How much each map matters to each volume.
    pub(super) fn look_from_volumes(&mut self, scene: &LitScene, lights: &[SceneLight]) {
        self.relevance = scene.volumes().map(|volume| (volume, Vec::new())).collect();
        for map in &self.maps.maps {
            let matters = scene.relevance(&lights[map.number as usize], map.view.face);
            for ((_, weights), matters) in self.relevance.iter_mut().zip(matters) {
                weights.push(matters);
            }
        }
        let places = self.relevance.iter().zip(0..);
        self.volumes = places
            .map(|((volume, _), place)| (*volume, place))
            .collect();
    }

    /// Makes room for all tiles and virtual point lights, if there is another number of them.
    fn allocate(&mut self, vpls: u32, device: &RenderDevice, statistics: &GiStatistics) {
        self.copy = None;
        let shape = RsmShape {
            size: self.maps.atlas.side(),
            pages: self.maps.atlas.pages().max(1),
            volumes: self.relevance.len() as u32,
            maps: (self.count() + 1).next_power_of_two(),
            vpls,
        };
        let stays = self.layout == self.maps.layout;
        self.layout = self.maps.layout;
        if self.textures.as_ref().is_some_and(|t| t.shape == shape) {
            return;
        }
        let new = RsmTextures::new(shape, device, statistics);
        let before = self.textures.replace(new);
        self.copy = before.filter(|old| stays && old.shape.size == shape.size);
        self.bind_group = None;
    }
}

impl RsmTextures {
    fn new(shape: RsmShape, device: &RenderDevice, statistics: &GiStatistics) -> Self {
        let RsmShape { size, pages, .. } = shape;
        let texture = |name: &'static str, format, layers, mip_level_count, usage| {
            let texture = device.create_texture(&TextureDescriptor {
                label: Some(&format!("gi/{name}")),
                size: Extent3d {
                    width: size,
                    height: size,
                    depth_or_array_layers: layers,
                },
                mip_level_count,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: usage | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            statistics.texture(name, texture)
        };
        let written =
            TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC | TextureUsages::COPY_DST;
        let drawn = TextureUsages::RENDER_ATTACHMENT;
        let target = |name, format| {
            texture(name, format, 1, 1, drawn)
                .map(|texture| texture.create_view(&TextureViewDescriptor::default()))
        };
        let levels = size.ilog2() + 1;
        let floats = |name, count: u32, usage| {
            statistics.storage_buffer(device, name, u64::from(count), usage)
        };
        Self {
            shape,
            texels: texture(
                "scene/rsm/texels",
                TextureFormat::Rgba32Uint,
                pages,
                1,
                written,
            ),
            flux: texture(
                "scene/rsm/flux",
                TextureFormat::R32Float,
                pages,
                levels,
                written,
            ),
            vpls: floats(
                "scene/rsm/vpls",
                shape.volumes * shape.vpls * GpuVpl::min_size().get() as u32 / 4,
                BufferUsages::COPY_SRC,
            ),
            sums: floats(
                "scene/rsm/sums",
                shape.volumes * shape.maps,
                BufferUsages::empty(),
            ),
            gbuffer: target("scene/rsm/gbuffer", DEFERRED_PREPASS_FORMAT),
            pass_id: target("scene/rsm/pass_id", DEFERRED_LIGHTING_PASS_ID_FORMAT),
            depth: target("scene/rsm/depth", CORE_3D_DEPTH_FORMAT),
        }
    }
}

fn array_view(texture: &Texture, level: u32, levels: Option<u32>) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2Array),
        base_mip_level: level,
        mip_level_count: levels,
        ..Default::default()
    })
}

fn page_view(texture: &Texture, page: u32) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2),
        base_mip_level: 0,
        mip_level_count: Some(1),
        base_array_layer: page,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

/// Makes room for the maps, and has those drawn whose turn it is.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn prepare_maps(
    mut rsm: ResMut<SceneRsm>,
    settings: Res<GiCaptureSettings>,
    views: Res<CaptureViews<RsmCapture>>,
    pipelines: Option<Res<RsmPipelines>>,
    mut queue: ResMut<CaptureQueue>,
    statistics: Res<GiStatistics>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    render_queue: Res<RenderQueue>,
) {
    let rsm = &mut *rsm;
    rsm.stale = false;
    rsm.copy = None;
    statistics.count("scene/rsm_maps", rsm.maps.maps.len() as u64);
    statistics.count("scene/vpls", u64::from(rsm.vpl_count()));
    if rsm.maps.maps.is_empty() {
        // Nobody looks, or nothing shines: the memory is given back.
        rsm.version += u64::from(rsm.textures.is_some());
        statistics.count("scene/rsm_drawn", 0);
        rsm.textures = None;
        rsm.bind_group = None;
        return;
    }
    let mut lights: Vec<_> = rsm.maps.maps.iter().map(|map| map.number).collect();
    lights.dedup();
    let vpls = settings.vpls.max(VPLS_A_LIGHT * lights.len() as u32);
    let vpls = vpls.next_power_of_two().min(MAX_VPLS);
    rsm.allocate(vpls, &device, &statistics);

    let ready = pipelines.is_some_and(|p| p.ready(&cache));
    let drawn = rsm.maps.finish(&views, &cache, ready, &mut queue);
    statistics.count("scene/rsm_drawn", drawn as u64);

    let mut array: Vec<_> = rsm.maps.maps.iter().map(GpuRsmMap::new).collect();
    let count = array.len() as u32;
    array.push(GpuRsmMap::default());
    let weights: Vec<f32> = rsm.relevance.iter().flat_map(|(_, w)| w.clone()).collect();
    let same = rsm.gpu.get().array == array
        && *rsm.weights.get() == weights
        && rsm.share == settings.light_share
        && rsm.bind_group.is_some();
    rsm.share = settings.light_share;
    rsm.stale = drawn > 0 || !same;
    if same {
        rsm.version += u64::from(drawn > 0);
        return;
    }
    rsm.version += 1;
    rsm.gpu.set(GpuRsmMaps { count, array });
    rsm.gpu.write_buffer(&device, &render_queue);
    rsm.weights.set(weights);
    rsm.weights.write_buffer(&device, &render_queue);
}

/// What the passes of this frame bind.
pub(crate) fn prepare_bind_groups(
    mut rsm: ResMut<SceneRsm>,
    pipelines: Option<Res<RsmPipelines>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let rsm = &mut *rsm;
    rsm.job = None;
    let (Some(pipelines), Some(textures), Some(maps), Some(weights)) = (
        pipelines,
        &rsm.textures,
        rsm.gpu.binding(),
        rsm.weights.binding(),
    ) else {
        return;
    };
    if !rsm.stale && rsm.bind_group.is_some() {
        return;
    }
    let all_texels = array_view(&textures.texels, 0, None);
    let all_flux = array_view(&textures.flux, 0, None);
    rsm.bind_group = Some(device.create_bind_group(
        "gi/scene/rsm",
        &cache.get_bind_group_layout(&rsm_layout()),
        &BindGroupEntries::sequential((
            maps.clone(),
            &all_texels,
            &all_flux,
            textures.vpls.as_entire_binding(),
        )),
    ));
    let copies = rsm.copy.iter().flat_map(|old| {
        let pairs = [(&old.texels, &textures.texels), (&old.flux, &textures.flux)];
        pairs.map(|(source, target)| RsmCopy {
            source: source.clone(),
            target: target.clone(),
        })
    });
    let copies = copies.collect();
    let drawn = rsm.maps.maps.iter().enumerate();
    let drawn = drawn.filter_map(|(i, map)| Some((i, map.tile.filter(|_| map.draw_now)?)));
    let draw: Vec<_> = drawn
        .map(|(i, tile)| {
            let mut uniform = UniformBuffer::from(GpuRsmResolve { map: i as u32 });
            uniform.write_buffer(&device, &queue);
            let group = device.create_bind_group(
                "gi/scene/rsm_resolve",
                &cache.get_bind_group_layout(&pipelines.resolve_layout),
                &BindGroupEntries::sequential((
                    &uniform,
                    maps.clone(),
                    &*textures.depth,
                    &*textures.gbuffer,
                    &page_view(&textures.texels, tile.page),
                    &page_view(&textures.flux, tile.page),
                )),
            );
            (i, group)
        })
        .collect();
    // Without a new map, the sums are still those of before.
    let levels = if draw.is_empty() {
        0
    } else {
        textures.shape.size.ilog2()
    };
    let sum = (1..=levels)
        .map(|level| {
            let group = device.create_bind_group(
                "gi/scene/rsm_sum",
                &cache.get_bind_group_layout(&pipelines.sum_layout),
                &BindGroupEntries::sequential((
                    &array_view(&textures.flux, level - 1, Some(1)),
                    &array_view(&textures.flux, level, Some(1)),
                )),
            );
            let side = textures.shape.size >> level;
            (UVec3::new(side, side, textures.shape.pages), group)
        })
        .collect();
    let mut uniform = UniformBuffer::from(GpuVpls {
        count: textures.shape.vpls,
        share: rsm.share as u32,
    });
    uniform.write_buffer(&device, &queue);
    let vpls = device.create_bind_group(
        "gi/scene/rsm_vpls",
        &cache.get_bind_group_layout(&pipelines.vpls_layout),
        &BindGroupEntries::sequential((
            &uniform,
            maps,
            &all_texels,
            &all_flux,
            textures.vpls.as_entire_binding(),
            textures.sums.as_entire_binding(),
            weights,
        )),
    );
    rsm.job = Some(RsmJob {
        copies,
        draw,
        sum,
        vpls,
        vpl_count: UVec2::new(textures.shape.vpls, textures.shape.volumes),
    });
}
