// Light at the hints of a volume that has moved: those that stay where they are keep theirs.

#import bevy_gi::scene::probes::types::{probe_coords, probe_count, probe_index}
#import bevy_gi::technique::hints::slots::{UNKNOWN, slots}

struct Carry {
    // Cells by which the lattice has moved.
    shift: vec3<i32>,
    // Coefficients of all slots.
    blocks: u32,
    dims: vec3<u32>,
}

@group(0) @binding(0) var<uniform> carry_: Carry;
// The slots as they were.
@group(0) @binding(1) var<storage, read> before: array<vec4<f32>>;

// One thread a hint.
@compute @workgroup_size(64)
fn carry(@builtin(global_invocation_id) id: vec3<u32>) {
    let count = probe_count(carry_.dims);
    if id.x >= count {
        return;
    }
    let from_ = vec3<i32>(probe_coords(id.x, carry_.dims)) + carry_.shift;
    let known = all(from_ >= vec3(0)) && all(from_ < vec3<i32>(carry_.dims));
    var old = 0u;
    if known {
        old = probe_index(vec3<u32>(from_), carry_.dims);
    }
    for (var block = 0u; block < carry_.blocks; block++) {
        slots[block * count + id.x] = select(vec4(vec3(0.0), UNKNOWN), before[block * count + old], known);
    }
}
