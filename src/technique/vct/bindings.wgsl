// Group 2: the radiance cache of voxel cone tracing.
#define_import_path bevy_gi::technique::vct::bindings

#import bevy_gi::technique::vct::types::Cones

@group(2) @binding(0) var<uniform> cones: Cones;
// Premultiplied radiance / `cones.unit` and opacity of cells of 2 voxels, by direction of travel:
// six blocks along z. Each mip level has cells of twice the size.
@group(2) @binding(1) var cells: texture_3d<f32>;
@group(2) @binding(2) var cell_sampler: sampler;
