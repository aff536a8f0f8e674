// Colour of the surfaces around each hint: what a bounce there looks like (Papaioannou 2011, section 6, asks for
// a volume of albedos).

#import bevy_gi::scene::probes::bindings::probes
#import bevy_gi::scene::probes::types::{
    HIT_BACK, HIT_INSIDE, HIT_NOTHING, map_solid_angle, probe_count, ray_direction,
}
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_gi::technique::hints::bindings::hints

// See `bevy_gi::scene::probes`.
@group(0) @binding(0) var<storage, read> hits: array<vec2<u32>>;
@group(0) @binding(1) var<storage, read_write> albedos: array<vec4<f32>>;

// One thread a hint.
@compute @workgroup_size(64)
fn average_albedo(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= probe_count(probes.dims) {
        return;
    }
    let rays = probes.side * probes.side;
    var sum = vec4(0.0);
    for (var ray = 0u; ray < rays; ray++) {
        let hit = hits[id.x * rays + ray];
        if hit.x == HIT_NOTHING || hit.x == HIT_INSIDE {
            continue;
        }
        // The nearest ones count most: light bounces there.
        let distance = bitcast<f32>(hit.y) / probes.cell;
        let dir = ray_direction(ray, id.x, probes);
        let weight = map_solid_angle(dir, probes.side) / (1.0 + distance * distance);
        sum += weight * vec4(load_voxel(hit.x & ~HIT_BACK).albedo, 1.0);
    }
    let none = vec3(hints.average_albedo);
    albedos[id.x] = vec4(select(none, sum.rgb / max(sum.a, 1e-12), sum.a > 0.0), 1.0);
}
