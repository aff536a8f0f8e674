// How far each probe sees: mean distance and mean squared distance by direction, an octahedral map each.

#import bevy_gi::scene::probes::types::{Probes, map_solid_angle, probe_index, wrap_texel}
#import bevy_pbr::utils::octahedral_decode

@group(0) @binding(0) var<uniform> probes: Probes;
@group(0) @binding(1) var<storage, read> hits: array<vec2<u32>>;
// A layer for each z of the lattice; maps have a border of a texel, for filtering.
@group(0) @binding(2) var moments: texture_storage_2d_array<rgba16float, write>;

// One thread a texel.
@compute @workgroup_size(8, 8)
fn store_moments(@builtin(global_invocation_id) id: vec3<u32>) {
    let side = i32(probes.side);
    let tile = probes.side + 2u;
    let probe = vec3(id.xy / tile, id.z);
    if any(probe >= probes.dims) {
        return;
    }
    let inner = wrap_texel(vec2<i32>(id.xy % tile) - 1, side);
    let dir = octahedral_decode((vec2<f32>(inner) + 0.5) / f32(side));
    let first = probe_index(probe, probes.dims) * probes.side * probes.side;
    // Farther than the other end of a cell's neighbours nobody asks.
    let farthest = 3.5 * probes.cell;
    var sum = vec3(0.0);
    for (var i = 0; i < 9; i++) {
        let texel = wrap_texel(inner + vec2(i % 3, i / 3) - 1, side);
        let ray = octahedral_decode((vec2<f32>(texel) + 0.5) / f32(side));
        let distance = min(bitcast<f32>(hits[first + u32(texel.y * side + texel.x)].y), farthest);
        let weight = pow(saturate(dot(ray, dir)), 32.0) * map_solid_angle(ray, probes.side);
        sum += weight * vec3(distance, distance * distance, 1.0);
    }
    textureStore(moments, id.xy, id.z, vec4(sum.xy / sum.z, 0.0, 0.0));
}
