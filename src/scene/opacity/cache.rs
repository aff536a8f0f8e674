//! The textures, and when they are built.

use bevy::{
    ecs::prelude::*,
    math::UVec3,
    render::{
        render_resource::*,
        renderer::{RenderDevice, RenderQueue},
    },
};

use super::{
    pipelines::{FORMAT, OpacityPipelines},
    types::{BLOCKS, GpuOpacityLevel},
};
use crate::{
    gpu::statistics::{GiStatistics, Tracked},
    scene::{
        needs::SceneNeeds,
        volume::{ExtractedVolume, Grid},
        voxels::SceneVoxels,
    },
};

/// Opacity of the voxels of a volume, in the render world. See the [module](super) for the layout.
#[derive(Component)]
pub struct SceneOpacity {
    dims: UVec3,
    levels: u32,
    texture: Tracked<Texture>,
    /// All levels.
    pub(crate) view: TextureView,
    /// [`SceneVoxels::version`] of what it shows.
    version: u64,
    pub(super) job: Option<OpacityJob>,
}

/// What a frame builds.
pub(super) struct OpacityJob {
    pub clear: BindGroup,
    pub voxels: BindGroup,
    /// For each level from the second on.
    pub cells: Vec<BindGroup>,
    /// Cells of each level.
    pub sizes: Vec<UVec3>,
}

/// What is bound where a volume has no opacity, as nobody reads it, and how it is read.
#[derive(Resource)]
pub(crate) struct OpacityTextures {
    /// A texel that stops nothing.
    pub none: TextureView,
    /// Trilinear, between levels too.
    pub sampler: Sampler,
}

pub(super) fn init_textures(mut commands: Commands, device: Res<RenderDevice>) {
    commands.insert_resource(OpacityTextures {
        none: texture(UVec3::ONE, 1, &device).create_view(&TextureViewDescriptor::default()),
        sampler: device.create_sampler(&SamplerDescriptor {
            label: Some("gi/scene/opacity"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            mipmap_filter: MipmapFilterMode::Linear,
            ..Default::default()
        }),
    });
}

/// All zero at first, as WebGPU promises.
fn texture(size: UVec3, levels: u32, device: &RenderDevice) -> Texture {
    device.create_texture(&TextureDescriptor {
        label: Some("gi/scene/opacity"),
        size: Extent3d {
            width: size.x,
            height: size.y,
            depth_or_array_layers: size.z,
        },
        mip_level_count: levels,
        sample_count: 1,
        dimension: TextureDimension::D3,
        format: FORMAT,
        usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

type VolumeData = (
    Entity,
    Option<&'static SceneVoxels>,
    Option<&'static mut SceneOpacity>,
);

/// Has the opacity built of each volume that was captured.
#[allow(clippy::too_many_arguments, reason = "a system's parameters")]
pub(super) fn prepare_opacity(
    mut commands: Commands,
    mut volumes: Query<VolumeData, With<ExtractedVolume>>,
    needs: Res<SceneNeeds>,
    pipelines: Res<OpacityPipelines>,
    cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    statistics: Res<GiStatistics>,
) {
    for (entity, voxels, opacity) in &mut volumes {
        let voxels = voxels.filter(|voxels| needs.opacity && voxels.version > 0);
        match (voxels, opacity) {
            (None, None) => {}
            // Nobody looks: the memory is given back.
            (None, Some(_)) => {
                commands.entity(entity).remove::<SceneOpacity>();
            }
            (Some(voxels), Some(mut opacity)) if opacity.fits(&voxels.grid) => {
                opacity.update(voxels, &pipelines, &cache, &device, &queue);
            }
            (Some(voxels), _) => {
                if pipelines.ready(&cache) {
                    let mut new = SceneOpacity::new(&voxels.grid, &device, &statistics);
                    new.update(voxels, &pipelines, &cache, &device, &queue);
                    commands.entity(entity).insert(new);
                }
            }
        }
    }
}

impl SceneOpacity {
    fn new(grid: &Grid, device: &RenderDevice, statistics: &GiStatistics) -> Self {
        let cells = grid.dims / 2;
        let size = UVec3::new(cells.x, cells.y, cells.z * BLOCKS);
        let texture = statistics.texture("scene/opacity", texture(size, grid.levels, device));
        Self {
            dims: grid.dims,
            levels: grid.levels,
            view: texture.create_view(&TextureViewDescriptor::default()),
            texture,
            version: 0,
            job: None,
        }
    }

    fn fits(&self, grid: &Grid) -> bool {
        (self.dims, self.levels) == (grid.dims, grid.levels)
    }

    /// Builds it anew if the voxels have changed.
    fn update(
        &mut self,
        voxels: &SceneVoxels,
        pipelines: &OpacityPipelines,
        cache: &PipelineCache,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        self.job = None;
        if self.version == voxels.version {
            return;
        }
        self.version = voxels.version;
        let view = |level: u32| {
            self.texture.create_view(&TextureViewDescriptor {
                base_mip_level: level,
                mip_level_count: Some(1),
                ..Default::default()
            })
        };
        let sizes: Vec<_> = (0..self.levels).map(|l| (self.dims / 2) >> l).collect();
        let uniform = |level: usize| {
            let mut uniform = UniformBuffer::from(GpuOpacityLevel {
                cells: sizes[level],
            });
            uniform.write_buffer(device, queue);
            uniform
        };
        let clear = pipelines
            .clear_layout
            .bind(device, cache)
            .with("level", &uniform(0))
            .with("destination", &view(0))
            .build();
        let finest = pipelines
            .voxels_layout
            .bind(device, cache)
            .with("level", &uniform(0))
            .with("destination", &view(0))
            .with("pool", voxels.pool.as_entire_binding())
            .with("brick_list", voxels.brick_list.as_entire_binding())
            .with("counters", voxels.counters.as_entire_binding())
            .build();
        let cells = (1..self.levels)
            .map(|level| {
                pipelines
                    .cells_layout
                    .bind(device, cache)
                    .with("level", &uniform(level as usize))
                    .with("destination", &view(level))
                    .with("finer", &view(level - 1))
                    .build()
            })
            .collect();
        self.job = Some(OpacityJob {
            clear,
            voxels: finest,
            cells,
            sizes,
        });
    }
}
