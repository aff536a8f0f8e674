// Group 1: the scene's lights, their maps, the sky, and the grid and the opacity of the volume at hand.
#define_import_path bevy_gi::scene::bindings

#import bevy_gi::scene::types::{LightMaps, Lights, Sky, Volume}

@group(1) @binding(0) var<uniform> volume: Volume;
@group(1) @binding(1) var<storage, read> lights: Lights;
@group(1) @binding(2) var<storage, read> light_maps: LightMaps;
@group(1) @binding(3) var light_depth: texture_depth_2d_array;
@group(1) @binding(4) var depth_sampler: sampler_comparison;
@group(1) @binding(5) var<uniform> sky: Sky;
@group(1) @binding(6) var sky_map: texture_cube<f32>;
@group(1) @binding(7) var sky_sampler: sampler;
// Opacity of the volume's cells along x, y and z, for what travels in the positive directions, and below it, along z,
// in the negative ones.
@group(1) @binding(8) var opacity_cells: texture_3d<f32>;
@group(1) @binding(9) var opacity_sampler: sampler;
