//! Memory of the maps, and which of them are drawn this frame.

use std::collections::HashMap;

use bevy::{
    core_pipeline::{
        core_3d::CORE_3D_DEPTH_FORMAT,
        deferred::{DEFERRED_LIGHTING_PASS_ID_FORMAT, DEFERRED_PREPASS_FORMAT},
    },
    ecs::prelude::*,
    math::UVec3,
    render::{
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    capture::{RsmCapture, RsmMap},
    node::{RsmLayout, RsmPipelines},
    types::{GpuRsmMap, GpuRsmMaps, GpuRsmResolve, GpuVpl, GpuVpls},
};
use crate::{
    gpu::statistics::{GiStatistics, Tracked},
    scene::capture::{CaptureQueue, CaptureViews},
    settings::{GiSettings, LightShare},
};

/// All reflective shadow maps, in the render world. See the [module](super) for their layout.
#[derive(Resource, Default)]
pub struct SceneRsm {
    pub(super) maps: Vec<RsmMap>,
    /// Most maps that are drawn in a frame.
    updates: usize,
    pub(super) gpu: StorageBuffer<GpuRsmMaps>,
    pub(super) textures: Option<RsmTextures>,
    /// Those of before, from which layers are copied this frame.
    copy: Option<RsmTextures>,
    /// Reads all of it: group 3 of whoever looks it up.
    pub(crate) bind_group: Option<BindGroup>,
    /// Grows whenever texels or virtual point lights have changed.
    pub version: u64,
    /// The maps as they are on the GPU,
    written: Vec<GpuRsmMap>,
    /// and how lights share the virtual point lights.
    share: LightShare,
    /// Whether that has changed this frame.
    stale: bool,
    pub(super) job: Option<RsmJob>,
}

/// Textures and buffers, as many as there are maps.
pub(super) struct RsmTextures {
    pub size: u32,
    layers: u32,
    vpl_count: u32,
    texels: Tracked<Texture>,
    flux: Tracked<Texture>,
    vpls: Tracked<Buffer>,
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
    pub vpl_count: u32,
}

/// A layer of a texture that stays, in another one.
pub(super) struct RsmCopy {
    pub source: Tracked<Texture>,
    pub target: Tracked<Texture>,
    /// From which layer to which.
    pub layers: (u32, u32),
}

impl RsmCopy {
    /// All levels of the layer.
    pub fn record(&self, encoder: &mut CommandEncoder) {
        for mip_level in 0..self.source.mip_level_count() {
            let side = self.source.width() >> mip_level;
            let layer = |texture, z| TexelCopyTextureInfo {
                texture,
                mip_level,
                origin: Origin3d { x: 0, y: 0, z },
                aspect: TextureAspect::All,
            };
            encoder.copy_texture_to_texture(
                layer(&**self.source, self.layers.0),
                layer(&**self.target, self.layers.1),
                Extent3d {
                    width: side,
                    height: side,
                    depth_or_array_layers: 1,
                },
            );
        }
    }
}

impl SceneRsm {
    /// Number of maps.
    pub fn count(&self) -> u32 {
        self.maps.len() as u32
    }

    /// Virtual point lights; 0 while there are no maps.
    pub fn vpl_count(&self) -> u32 {
        match self.maps.is_empty() {
            true => 0,
            false => self.textures.as_ref().map_or(0, |t| t.vpl_count),
        }
    }

    /// `array<GpuVpl>`, while there are maps.
    pub fn vpls(&self) -> Option<&Buffer> {
        self.textures.as_ref().map(|textures| &*textures.vpls)
    }

    /// The maps of a new frame, each light's together. Those that were there before keep what they show,
    /// and their layer as long as all lights before theirs stay.
    pub(super) fn replace(&mut self, mut maps: Vec<RsmMap>, updates: u32) {
        self.updates = updates as usize;
        let mut places = HashMap::new();
        for (i, old) in self.maps.iter().enumerate() {
            places.entry(old.light).or_insert(i);
        }
        maps.sort_by_key(|new| places.get(&new.light).copied().unwrap_or(usize::MAX));
        for new in &mut maps {
            let first = places.get(&new.light).copied().unwrap_or(self.maps.len());
            let old = self.maps[first..].iter();
            let mut old = old.take_while(|old| old.light == new.light).enumerate();
            if let Some((i, old)) = old.find(|(_, old)| old.face == new.face) {
                new.layer = Some((first + i) as u32);
                new.drawn = old.drawn;
                new.in_doubt = old.in_doubt;
                new.incomplete = old.incomplete;
                new.waits = old.waits;
                new.age = old.age.saturating_add(1);
            }
        }
        self.maps = maps;
    }

    /// Makes room for all maps, if there is another number of them or they have moved.
    fn allocate(&mut self, vpl_count: u32, device: &RenderDevice, statistics: &GiStatistics) {
        let layers = self.maps.len() as u32;
        let size = self.maps.iter().map(|map| map.gpu.size).max().unwrap_or(64);
        let shape = (size, layers, vpl_count);
        let stay = (0..)
            .zip(&self.maps)
            .all(|(i, map)| map.layer.is_none_or(|layer| layer == i));
        let fits = |t: &RsmTextures| (t.size, t.layers, t.vpl_count) == shape;
        if stay && self.textures.as_ref().is_some_and(fits) {
            return;
        }
        let new = RsmTextures::new(size, layers, vpl_count, device, statistics);
        self.copy = self.textures.replace(new).filter(|old| old.size == size);
        if self.copy.is_none() {
            for map in &mut self.maps {
                map.drawn = None;
            }
        }
        self.written.clear();
    }
}

impl RsmTextures {
    fn new(
        size: u32,
        layers: u32,
        vpl_count: u32,
        device: &RenderDevice,
        statistics: &GiStatistics,
    ) -> Self {
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
        Self {
            size,
            layers,
            vpl_count,
            texels: texture(
                "scene/rsm/texels",
                TextureFormat::Rgba32Uint,
                layers,
                1,
                written,
            ),
            flux: texture(
                "scene/rsm/flux",
                TextureFormat::R32Float,
                layers,
                levels,
                written,
            ),
            vpls: statistics.storage_buffer(
                device,
                "scene/rsm/vpls",
                u64::from(vpl_count) * GpuVpl::min_size().get() / 4,
                BufferUsages::COPY_SRC,
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

fn layer_view(texture: &Texture, layer: u32) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2),
        base_mip_level: 0,
        mip_level_count: Some(1),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..Default::default()
    })
}

/// Chooses the maps that are drawn this frame, and makes room for them.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn prepare_maps(
    mut rsm: ResMut<SceneRsm>,
    settings: Res<GiSettings>,
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
    statistics.count("scene/rsm_maps", rsm.maps.len() as u64);
    statistics.count("scene/vpls", u64::from(rsm.vpl_count()));
    if rsm.maps.is_empty() {
        // Nobody looks, or nothing shines: the memory is given back.
        rsm.version += u64::from(rsm.textures.is_some());
        statistics.count("scene/rsm_drawn", 0);
        rsm.textures = None;
        rsm.bind_group = None;
        rsm.written.clear();
        return;
    }
    let vpl_count = settings.vpls.next_power_of_two();
    rsm.allocate(vpl_count, &device, &statistics);

    let ready = pipelines.is_some_and(|p| p.ready(&cache)) && views.ready(&cache);
    for map in &mut rsm.maps {
        map.in_doubt |= views.changed(map.light, map.face);
    }
    let mut stale: Vec<usize> = (0..rsm.maps.len())
        .filter(|i| {
            let map = &rsm.maps[*i];
            match map.drawn {
                None => true,
                // What was missing has come, or may have.
                Some(_) if map.incomplete || (map.waits && map.in_doubt) => true,
                Some(_) if settings.freeze_capture || map.age < map.interval => false,
                Some(drawn) => drawn != map.wanted() || map.in_doubt,
            }
        })
        .collect();
    // The longest waiting first. What has never been drawn is drawn at once: nothing stands in for it.
    stale.sort_by_key(|i| std::cmp::Reverse(rsm.maps[*i].age));
    let new = stale.iter().filter(|i| rsm.maps[**i].drawn.is_none());
    let budget = rsm.updates.max(new.count());
    for (rank, i) in stale.into_iter().enumerate() {
        let map = &mut rsm.maps[i];
        map.draw_now = rank < budget;
        if map.draw_now {
            map.age = 0;
            map.drawn = Some(map.wanted());
            map.in_doubt = false;
            map.incomplete = !ready;
            map.waits = views.waits(map.light, map.face);
            queue.0.extend(views.get(map.light, map.face));
        }
    }
    let shown: Vec<_> = rsm.maps.iter().map(RsmMap::shown).collect();
    let drawn = rsm.maps.iter().filter(|map| map.draw_now).count();
    statistics.count("scene/rsm_drawn", drawn as u64);
    rsm.stale = drawn > 0 || shown != rsm.written || rsm.share != settings.light_share;
    rsm.share = settings.light_share;
    if !rsm.stale {
        return;
    }
    rsm.version += 1;
    rsm.written.clone_from(&shown);
    let count = shown.len() as u32;
    let mut array = shown;
    array.push(GpuRsmMap::default());
    rsm.gpu.set(GpuRsmMaps { count, array });
    rsm.gpu.write_buffer(&device, &render_queue);
}

/// What the passes of this frame bind.
pub(crate) fn prepare_bind_groups(
    mut rsm: ResMut<SceneRsm>,
    pipelines: Option<Res<RsmPipelines>>,
    layout: Option<Res<RsmLayout>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let rsm = &mut *rsm;
    rsm.job = None;
    let (Some(pipelines), Some(layout), Some(textures), Some(maps)) =
        (pipelines, layout, &rsm.textures, rsm.gpu.binding())
    else {
        return;
    };
    if !rsm.stale && rsm.bind_group.is_some() {
        return;
    }
    let all_texels = array_view(&textures.texels, 0, None);
    let all_flux = array_view(&textures.flux, 0, None);
    rsm.bind_group = Some(device.create_bind_group(
        "gi/scene/rsm",
        &cache.get_bind_group_layout(&layout.0),
        &BindGroupEntries::sequential((
            maps.clone(),
            &all_texels,
            &all_flux,
            textures.vpls.as_entire_binding(),
        )),
    ));
    let kept = (0..).zip(&rsm.maps).filter(|(_, map)| map.drawn.is_some());
    let kept = kept.filter_map(|(i, map)| Some((map.layer?, i)));
    let copies = rsm.copy.iter().flat_map(|old| {
        let pairs = [(&old.texels, &textures.texels), (&old.flux, &textures.flux)];
        let copies = kept.clone().flat_map(move |layers| {
            pairs.map(|(source, target)| RsmCopy {
                source: source.clone(),
                target: target.clone(),
                layers,
            })
        });
        copies.collect::<Vec<_>>()
    });
    let copies = copies.collect();
    let drawn = rsm.maps.iter().enumerate().filter(|(_, map)| map.draw_now);
    let draw: Vec<_> = drawn
        .map(|(i, _)| {
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
                    &layer_view(&textures.texels, i as u32),
                    &layer_view(&textures.flux, i as u32),
                )),
            );
            (i, group)
        })
        .collect();
    // Without a new map, the sums are still those of before.
    let levels = if draw.is_empty() {
        0
    } else {
        textures.size.ilog2()
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
            let side = textures.size >> level;
            (UVec3::new(side, side, textures.layers), group)
        })
        .collect();
    let mut uniform = UniformBuffer::from(GpuVpls {
        count: textures.vpl_count,
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
        )),
    );
    rsm.job = Some(RsmJob {
        copies,
        draw,
        sum,
        vpls,
        vpl_count: textures.vpl_count,
    });
}
