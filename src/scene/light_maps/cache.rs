//! Memory of the maps, and what a frame draws into them.

use bevy::{
    ecs::{entity::EntityHashMap, prelude::*},
    math::{UVec2, UVec3},
    render::{
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    atlas::Tile,
    choice::{Drawn, LightMaps, Limits},
    pipelines::{DepthCapture, LightMapPipelines, SurfaceCapture, rsm_layout},
    textures::{
        DepthPages, PageCopy, PageShape, SurfacePages, SurfaceShape, array_view, page_view,
    },
    types::{GpuLightMap, GpuLightMaps, GpuMapResolve, GpuVpls},
    views::LitScene,
};
use crate::{
    gpu::statistics::{GiStatistics, Tracked},
    scene::{
        needs::SceneNeeds,
        views::{CaptureQueue, CaptureViews, WantedView},
        world::lights::SceneLight,
    },
    settings::{GiCaptureSettings, LightShare},
};

/// Virtual point lights that a lamp has at least, on the mean, whatever others there are: about as many as walls, floor and
/// ceiling of a room need to be lit from everywhere.
const VPLS_A_LIGHT: u32 = 16;

/// Virtual point lights of a volume at most.
const MAX_VPLS: u32 = 16384;

/// The maps of all lights, in the render world. See the [module](super) for their layout.
#[derive(Resource, Default)]
pub struct SceneLightMaps {
    pub(super) maps: LightMaps,
    limits: Limits,
    /// Of each volume, finest first: its main-world entity, and how much each map matters there.
    relevance: Vec<(Entity, Vec<f32>)>,
    /// Volumes by their place in the buffer of virtual point lights.
    volumes: EntityHashMap<u32>,
    /// Maps as shaders see them.
    pub(crate) gpu: StorageBuffer<GpuLightMaps>,
    /// [`relevance`](Self::relevance), as shaders see it: by volume, by map.
    weights: StorageBuffer<Vec<f32>>,
    pub(super) depth: Option<DepthPages>,
    pub(super) surfaces: Option<SurfacePages>,
    /// What is kept of textures that were too small, or too large.
    pub(super) copies: Vec<PageCopy>,
    /// [`LightMaps::layout`] of the textures.
    layout: u64,
    /// What depth shows, by map.
    shown: Vec<Option<(Drawn, Tile)>>,
    /// Compares depths, reverse-Z, bilinear.
    pub(crate) sampler: Option<Sampler>,
    /// Reads surfaces and virtual point lights: group 3 of whoever looks them up.
    pub(crate) rsm_bind_group: Option<BindGroup>,
    /// Grows whenever shadows have changed, while anybody reads them.
    pub shadow_version: u64,
    /// Grows whenever surfaces or virtual point lights have changed.
    pub rsm_version: u64,
    /// Grows whenever maps show other surfaces or other light on them, and not only more or fewer texels of the same: the
    /// virtual point lights of one version are samples of the same light.
    pub content_version: u64,
    /// How lights share the virtual point lights.
    share: LightShare,
    /// Whether virtual point lights are to be chosen anew this frame.
    stale: bool,
    pub(super) job: Option<SurfaceJob>,
}

/// What a frame makes of the surfaces that it draws.
pub(super) struct SurfaceJob {
    /// By map that is drawn, in their order: what makes texels of its G-buffer.
    pub resolve: Vec<BindGroup>,
    /// For each level of the flux: its threads, and its bind group.
    pub sum: Vec<(UVec3, BindGroup)>,
    pub vpls: BindGroup,
    /// Virtual point lights of each volume, and volumes.
    pub vpl_count: UVec2,
}

impl SceneLightMaps {
    /// Number of maps.
    pub fn count(&self) -> u32 {
        self.maps.maps.len() as u32
    }

    /// First map of a light by its number, -1 if nothing casts shadows in its light.
    pub(crate) fn first_shadow(&self, number: usize) -> i32 {
        self.maps.first_shadow(number)
    }

    /// Depth of all pages.
    pub(crate) fn depth(&self) -> Option<&TextureView> {
        self.depth.as_ref().map(|depth| &depth.all)
    }

    /// Virtual point lights of all volumes; 0 while there are no surfaces.
    pub fn vpl_count(&self) -> u32 {
        let surfaces = self.surfaces.as_ref();
        surfaces.map_or(0, |s| s.shape.vpls * s.shape.volumes)
    }

    /// The virtual point lights that a volume looks at: the first, and their number, a power of two. `volume` is its
    /// main-world entity.
    pub fn vpls_of(&self, volume: Entity) -> (u32, u32) {
        match (self.volumes.get(&volume), &self.surfaces) {
            (Some(place), Some(SurfacePages { shape, .. })) => (place * shape.vpls, shape.vpls),
            _ => (0, 0),
        }
    }

    /// `array<GpuVpl>`, while there are surfaces.
    pub fn vpls(&self) -> Option<&Buffer> {
        self.surfaces.as_ref().map(|surfaces| &*surfaces.vpls)
    }

    /// Decides on the maps of a frame; without a scene there are none. Returns the views that draw them.
    pub(super) fn choose(
        &mut self,
        scene: Option<LitScene>,
        lights: &[SceneLight],
        limits: Limits,
    ) -> Vec<WantedView> {
        self.limits = limits;
        let Some(scene) = scene else {
            self.maps.clear();
            return Vec::new();
        };
        let wanted = self.maps.update(&scene, lights, &limits);
        // Only virtual point lights are weighed.
        self.relevance.clear();
        if limits.surfaces {
            self.look_from_volumes(&scene, lights);
        }
        wanted
    }

    /// How much each map matters to each volume.
    fn look_from_volumes(&mut self, scene: &LitScene, lights: &[SceneLight]) {
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

    /// Makes room for all maps; what is drawn stays. `vpls`: of each volume, where surfaces are drawn.
    fn allocate(&mut self, vpls: Option<u32>, device: &RenderDevice, statistics: &GiStatistics) {
        let stays = self.layout == self.maps.layout;
        self.layout = self.maps.layout;
        self.copies.clear();
        // Whether what is in the old texture gets into the new one.
        let mut keep = |old: &Tracked<Texture>, new: &Tracked<Texture>| {
            let copy = PageCopy::new(old, new).filter(|_| stays);
            let kept = copy.is_some();
            self.copies.extend(copy);
            kept
        };
        let drawn = PageShape {
            side: self.maps.atlas.side().max(1),
            pages: self.maps.atlas.pages().max(1),
        };
        if self.depth.as_ref().is_none_or(|d| d.shape() != drawn) {
            let new = DepthPages::new(drawn, device, statistics);
            if let Some(old) = self.depth.take() {
                keep(&old.texture, &new.texture);
            }
            self.depth = Some(new);
        }
        let Some(vpls) = vpls else {
            if self.surfaces.take().is_some() {
                self.maps.forget_surfaces();
                self.rsm_bind_group = None;
                self.rsm_version += 1;
                self.content_version += 1;
            }
            return;
        };
        let shape = SurfaceShape {
            drawn,
            reduction: self.limits.reduction,
            volumes: self.relevance.len() as u32,
            maps: (self.maps.maps.len() as u32 + 1).next_power_of_two(),
            vpls,
        };
        if self.surfaces.as_ref().is_none_or(|s| s.shape != shape) {
            let new = SurfacePages::new(shape, device, statistics);
            let kept = self.surfaces.take().filter(|old| {
                let pairs = [(&old.texels, &new.texels), (&old.flux, &new.flux)];
                pairs.map(|(old, new)| keep(old, new)) == [true; 2]
            });
            if kept.is_none() {
                self.maps.forget_surfaces();
            }
            self.surfaces = Some(new);
            self.rsm_bind_group = None;
        }
    }

    /// Brings the buffer of all maps up to date, and notes what has changed for whom.
    fn write(
        &mut self,
        drawn: usize,
        needs: &SceneNeeds,
        share: LightShare,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        let shown: Vec<_> = self.maps.maps.iter().map(|map| map.shown()).collect();
        let moved = std::mem::replace(&mut self.shown, shown) != self.shown;
        self.shadow_version += u64::from(needs.shadows && (drawn > 0 || moved));

        let side = self.maps.atlas.side();
        let maps = self.maps.maps.iter();
        let mut array: Vec<_> = maps
            .map(|map| GpuLightMap::new(map, side, &self.limits))
            .collect();
        let count = array.len() as u32;
        array.push(GpuLightMap::default());
        let weights: Vec<f32> = self.relevance.iter().flat_map(|(_, w)| w.clone()).collect();
        let same =
            self.gpu.get().array == array && *self.weights.get() == weights && self.share == share;
        if !same {
            self.gpu.set(GpuLightMaps { count, array });
            self.gpu.write_buffer(device, queue);
            self.weights.set(weights);
            self.weights.write_buffer(device, queue);
            self.share = share;
        }
        let anew = !same || self.rsm_bind_group.is_none();
        self.stale = self.surfaces.is_some() && (drawn > 0 || anew);
        self.rsm_version += u64::from(self.stale);
        self.content_version += u64::from(self.surfaces.is_some() && self.maps.changes);
    }
}

/// Makes room for the maps, and has those drawn whose turn it is.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn prepare_maps(
    mut maps: ResMut<SceneLightMaps>,
    settings: Res<GiCaptureSettings>,
    needs: Res<SceneNeeds>,
    depth_views: Res<CaptureViews<DepthCapture>>,
    surface_views: Res<CaptureViews<SurfaceCapture>>,
    pipelines: Option<Res<LightMapPipelines>>,
    mut queue: ResMut<CaptureQueue>,
    statistics: Res<GiStatistics>,
    cache: Res<PipelineCache>,
    (device, render_queue): (Res<RenderDevice>, Res<RenderQueue>),
) {
    let this = &mut *maps;
    this.sampler.get_or_insert_with(|| {
        device.create_sampler(&SamplerDescriptor {
            label: Some("gi/scene/light_maps/depth"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            compare: Some(CompareFunction::GreaterEqual),
            ..Default::default()
        })
    });
    // Without a map, the memory of surfaces is given back.
    let surfaces = needs.rsm && !this.maps.maps.is_empty();
    let vpls = surfaces.then(|| {
        let mut lights: Vec<_> = this.maps.maps.iter().map(|map| map.number).collect();
        lights.dedup();
        let vpls = settings.vpls.max(VPLS_A_LIGHT * lights.len() as u32);
        vpls.next_power_of_two().min(MAX_VPLS)
    });
    this.allocate(vpls, &device, &statistics);
    let ready = pipelines.is_some_and(|p| p.ready(surfaces, &cache));
    let drawn = match surfaces {
        true => this.maps.finish(&surface_views, &cache, ready, &mut queue),
        false => this.maps.finish(&depth_views, &cache, ready, &mut queue),
    };
    this.write(drawn, &needs, settings.light_share, &device, &render_queue);
    statistics.count("scene/light_maps", u64::from(this.count()));
    statistics.count("scene/light_maps_drawn", drawn as u64);
    statistics.count("scene/vpls", u64::from(this.vpl_count()));
}

/// What the passes over surfaces bind in this frame.
pub(crate) fn prepare_bind_groups(
    mut maps: ResMut<SceneLightMaps>,
    pipelines: Option<Res<LightMapPipelines>>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let this = &mut *maps;
    this.job = None;
    let (Some(pipelines), Some(depth), Some(surfaces), Some(gpu), Some(weights)) = (
        pipelines,
        &this.depth,
        &this.surfaces,
        this.gpu.binding(),
        this.weights.binding(),
    ) else {
        return;
    };
    if !this.stale {
        return;
    }
    let all_texels = array_view(&surfaces.texels, 0, None);
    let all_flux = array_view(&surfaces.flux, 0, None);
    this.rsm_bind_group = Some(
        rsm_layout()
            .bind(&device, &cache)
            .with("maps", gpu.clone())
            .with("texels", &all_texels)
            .with("flux", &all_flux)
            .with("vpls", surfaces.vpls.as_entire_binding())
            .build(),
    );
    let resolve: Vec<_> = this
        .maps
        .drawn_now()
        .map(|(number, _, tile)| {
            let map = number as u32;
            let mut uniform = UniformBuffer::from(GpuMapResolve { map });
            uniform.write_buffer(&device, &queue);
            pipelines
                .resolve_layout
                .bind(&device, &cache)
                .with("resolve_", &uniform)
                .with("maps", gpu.clone())
                .with("depth_texture", &depth.each[tile.page as usize])
                .with("deferred_texture", &*surfaces.gbuffer)
                .with("texels", &page_view(&surfaces.texels, tile.page))
                .with("flux", &page_view(&surfaces.flux, tile.page))
                .build()
        })
        .collect();
    // Without a new map, the sums are still those of before.
    let side = surfaces.shape.side();
    let levels = if resolve.is_empty() { 0 } else { side.ilog2() };
    let sum = (1..=levels)
        .map(|level| {
            let group = pipelines
                .sum_layout
                .bind(&device, &cache)
                .with("finer", &array_view(&surfaces.flux, level - 1, Some(1)))
                .with("coarser", &array_view(&surfaces.flux, level, Some(1)))
                .build();
            let side = side >> level;
            (UVec3::new(side, side, surfaces.shape.drawn.pages), group)
        })
        .collect();
    let mut uniform = UniformBuffer::from(GpuVpls {
        count: surfaces.shape.vpls,
        share: this.share as u32,
    });
    uniform.write_buffer(&device, &queue);
    let vpls = pipelines
        .vpls_layout
        .bind(&device, &cache)
        .with("vpls_", &uniform)
        .with("maps", gpu)
        .with("texels", &all_texels)
        .with("flux", &all_flux)
        .with("vpls", surfaces.vpls.as_entire_binding())
        .with("sums", surfaces.sums.as_entire_binding())
        .with("weights", weights)
        .build();
    this.job = Some(SurfaceJob {
        resolve,
        sum,
        vpls,
        vpl_count: UVec2::new(surfaces.shape.vpls, surfaces.shape.volumes),
    });
}
