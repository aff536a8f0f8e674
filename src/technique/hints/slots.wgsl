// Light at the hints by where it comes from, in full precision.
#define_import_path bevy_gi::technique::hints::slots

// In a fourth component: nothing is known yet.
const UNKNOWN: f32 = -1.0;

// Coefficients of radiance in nits: of each slot, for each coefficient, a block of all hints.
@group(0) @binding(4) var<storage, read_write> slots: array<vec4<f32>>;

// Where coefficient `i` of a hint is, of `count` hints with `coefficients` each.
fn slot_index(slot: u32, i: u32, probe: u32, coefficients: u32, count: u32) -> u32 {
    return (slot * coefficients + i) * count + probe;
}
