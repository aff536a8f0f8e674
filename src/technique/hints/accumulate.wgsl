// New light into the slots, and which hints get any.
#define_import_path bevy_gi::technique::hints::accumulate

#import bevy_gi::scene::probes::bindings::{offsets, probes}
#import bevy_gi::scene::probes::types::probe_count
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::slots::{UNKNOWN, slot_index, slots}

// One of so many frames is a sleeping hint's turn; those of a workgroup have it together.
const TURNS: u32 = 4u;
const WORKGROUP: u32 = 64u;
// Whether a hint that lights no surface is left as it is in this frame.
fn asleep(slot: u32, probe: u32) -> bool {
    let turn = (probe / WORKGROUP + hints.frame) % TURNS == 0u;
    if turn || offsets[probe].w < hints.sleep_beyond {
        return false;
    }
    return slots[slot_index(slot, 0u, probe, hints.coefficients, probe_count(probes.dims))].w != UNKNOWN;
}

// Replaces a part of a slot's light by new light.
fn blend_slot(slot: u32, probe: u32, light: ptr<function, array<vec3<f32>, 9>>, part: f32) {
    let count = probe_count(probes.dims);
    for (var i = 0u; i < hints.coefficients; i++) {
        let at = slot_index(slot, i, probe, hints.coefficients, count);
        let before = slots[at];
        // What is there may be anything where nothing of it counts.
        let anew = part >= 1.0 || before.w == UNKNOWN;
        slots[at] = vec4(mix(select(before.rgb, vec3(0.0), anew), (*light)[i], select(part, 1.0, anew)), 0.0);
    }
}
