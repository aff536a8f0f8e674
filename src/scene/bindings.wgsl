// Group 1: the scene's lights, their maps, the sky, and the grid of the volume at hand.
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
