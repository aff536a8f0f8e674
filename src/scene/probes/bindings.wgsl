// The first bindings of group 2 of whoever looks probes up.
#define_import_path bevy_gi::scene::probes::bindings

#import bevy_gi::scene::probes::types::Probes

@group(2) @binding(0) var<uniform> probes: Probes;
// Metres from the middle of the cell; w: metres to the nearest surface, 0 inside of something.
@group(2) @binding(1) var<storage, read> offsets: array<vec4<f32>>;
// Mean and mean squared distance of what each probe sees, metres.
@group(2) @binding(2) var moments: texture_2d_array<f32>;
@group(2) @binding(3) var probe_sampler: sampler;
