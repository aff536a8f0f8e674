// Group 2: probes, and the light at them.
#define_import_path bevy_gi::technique::hints::bindings

#import bevy_gi::technique::hints::types::Hints

// 0 to 3 are `bevy_gi::scene::probes::bindings`.
@group(2) @binding(4) var<uniform> hints: Hints;
// Coefficients of radiance / `hints.unit`, in blocks above each other along z: 0 to 3 of red, of green, of
// blue; then 4 to 7 likewise; then 8 of all three. Then a block of distances of the nearest and the farthest of what
// lights the hint, over the reach, and one of the mean albedo around it.
@group(2) @binding(5) var coefficients: texture_3d<f32>;
