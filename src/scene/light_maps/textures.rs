//! Textures and buffers behind the maps.

use bevy::{
    core_pipeline::{
        core_3d::CORE_3D_DEPTH_FORMAT,
        deferred::{DEFERRED_LIGHTING_PASS_ID_FORMAT, DEFERRED_PREPASS_FORMAT},
    },
    render::{render_resource::*, renderer::RenderDevice},
};

use super::types::GpuVpl;
use crate::gpu::statistics::{GiStatistics, Tracked};

/// Depth of all maps: what casts shadows.
pub(super) struct DepthPages {
    pub texture: Tracked<Texture>,
    /// All pages,
    pub all: TextureView,
    /// and each of them.
    pub each: Vec<TextureView>,
}

/// How large the pages are.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct PageShape {
    /// Texels along the side of a page.
    pub side: u32,
    pub pages: u32,
}

/// How large all that surfaces need is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct SurfaceShape {
    /// Of depth, and so of the G-buffer.
    pub drawn: PageShape,
    /// How often their side is halved for surfaces.
    pub reduction: u32,
    pub volumes: u32,
    /// Maps that the sums have room for.
    pub maps: u32,
    /// Virtual point lights of each volume.
    pub vpls: u32,
}

impl SurfaceShape {
    /// Texels along the side of a page of surfaces.
    pub fn side(&self) -> u32 {
        self.drawn.side >> self.reduction
    }
}

/// Surfaces of all maps, and the virtual point lights chosen from them.
pub(super) struct SurfacePages {
    pub shape: SurfaceShape,
    pub texels: Tracked<Texture>,
    pub flux: Tracked<Texture>,
    pub vpls: Tracked<Buffer>,
    /// Of each volume, the sum of what its maps are worth up to each.
    pub sums: Tracked<Buffer>,
    /// A map's G-buffer, before it becomes texels.
    pub gbuffer: Tracked<TextureView>,
    pub pass_id: Tracked<TextureView>,
}

/// Textures of the frame before, and those of this frame which get what they have.
pub(super) struct PageCopy {
    source: Tracked<Texture>,
    target: Tracked<Texture>,
}

impl PageCopy {
    /// If both have pages of the same size.
    pub fn new(source: &Tracked<Texture>, target: &Tracked<Texture>) -> Option<Self> {
        (source.width() == target.width()).then(|| Self {
            source: source.clone(),
            target: target.clone(),
        })
    }

    /// Copies all levels of as many pages as both have.
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

/// A texture of square pages; `name` without `gi/`.
fn pages(
    name: &'static str,
    PageShape { side, pages }: PageShape,
    mip_level_count: u32,
    format: TextureFormat,
    usage: TextureUsages,
    device: &RenderDevice,
    statistics: &GiStatistics,
) -> Tracked<Texture> {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some(&format!("gi/{name}")),
        size: Extent3d {
            width: side,
            height: side,
            depth_or_array_layers: pages,
        },
        mip_level_count,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: usage | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    statistics.texture(name, texture)
}

const COPIED: TextureUsages = TextureUsages::COPY_SRC.union(TextureUsages::COPY_DST);

impl DepthPages {
    pub fn new(shape: PageShape, device: &RenderDevice, statistics: &GiStatistics) -> Self {
        let texture = pages(
            "scene/light_maps/depth",
            shape,
            1,
            CORE_3D_DEPTH_FORMAT,
            TextureUsages::RENDER_ATTACHMENT | COPIED,
            device,
            statistics,
        );
        Self {
            all: array_view(&texture, 0, None),
            each: (0..shape.pages).map(|i| page_view(&texture, i)).collect(),
            texture,
        }
    }

    pub fn shape(&self) -> PageShape {
        PageShape {
            side: self.texture.width(),
            pages: self.texture.depth_or_array_layers(),
        }
    }
}

impl SurfacePages {
    pub fn new(shape: SurfaceShape, device: &RenderDevice, statistics: &GiStatistics) -> Self {
        let surfaces = PageShape {
            side: shape.side(),
            ..shape.drawn
        };
        let scratch = PageShape {
            pages: 1,
            ..shape.drawn
        };
        let texture = |name, of, levels, format, usage| {
            pages(name, of, levels, format, usage, device, statistics)
        };
        let written = TextureUsages::STORAGE_BINDING | COPIED;
        let target = |name, format| {
            texture(name, scratch, 1, format, TextureUsages::RENDER_ATTACHMENT)
                .map(|texture| texture.create_view(&TextureViewDescriptor::default()))
        };
        let floats = |name, count: u32, usage| {
            statistics.storage_buffer(device, name, u64::from(count), usage)
        };
        Self {
            shape,
            texels: texture(
                "scene/light_maps/surfaces",
                surfaces,
                1,
                TextureFormat::Rgba32Uint,
                written,
            ),
            flux: texture(
                "scene/light_maps/flux",
                surfaces,
                surfaces.side.ilog2() + 1,
                TextureFormat::R32Float,
                written,
            ),
            vpls: floats(
                "scene/light_maps/vpls",
                shape.volumes * shape.vpls * GpuVpl::min_size().get() as u32 / 4,
                BufferUsages::COPY_SRC,
            ),
            sums: floats(
                "scene/light_maps/sums",
                shape.volumes * shape.maps,
                BufferUsages::empty(),
            ),
            gbuffer: target("scene/light_maps/gbuffer", DEFERRED_PREPASS_FORMAT),
            pass_id: target("scene/light_maps/pass_id", DEFERRED_LIGHTING_PASS_ID_FORMAT),
        }
    }
}

/// All pages, of one level or of all.
pub(super) fn array_view(texture: &Texture, level: u32, levels: Option<u32>) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2Array),
        base_mip_level: level,
        mip_level_count: levels,
        ..Default::default()
    })
}

/// One page, its first level.
pub(super) fn page_view(texture: &Texture, page: u32) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2),
        base_mip_level: 0,
        mip_level_count: Some(1),
        base_array_layer: page,
        array_layer_count: Some(1),
        ..Default::default()
    })
}
