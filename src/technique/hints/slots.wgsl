// Light at the hints by where it comes from, in full precision.
#define_import_path bevy_gi::technique::hints::slots

#import bevy_gi::technique::hints::types::SLOT_LIGHTS

// In a fourth component: nothing is known yet.
const UNKNOWN: f32 = -1.0;

// Coefficients of radiance in nits: of each slot, for each coefficient, a block of all hints. The fourth component of
// the first says by how much the light changed, those of the next two of lamps have the distances below: a buffer
// of their own would be one too many for WebGPU.
@group(0) @binding(3) var<storage, read_write> slots: array<vec4<f32>>;

// Where coefficient `i` of a hint is, of `count` hints with `coefficients` each.
fn slot_index(slot: u32, i: u32, probe: u32, coefficients: u32, count: u32) -> u32 {
    return (slot * coefficients + i) * count + probe;
}

// Distances of the nearest and the farthest of what lamps light a hint with, over the reach.
fn load_distances(probe: u32, coefficients: u32, count: u32) -> vec2<f32> {
    return vec2(
        slots[slot_index(SLOT_LIGHTS, 1u, probe, coefficients, count)].w,
        slots[slot_index(SLOT_LIGHTS, 2u, probe, coefficients, count)].w,
    );
}

fn store_distances(distances: vec2<f32>, probe: u32, coefficients: u32, count: u32) {
    slots[slot_index(SLOT_LIGHTS, 1u, probe, coefficients, count)].w = distances.x;
    slots[slot_index(SLOT_LIGHTS, 2u, probe, coefficients, count)].w = distances.y;
}
