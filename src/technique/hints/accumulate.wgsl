// New light into the slots, and which hints get any.
#define_import_path bevy_gi::technique::hints::accumulate

#import bevy_gi::gpu::row::LANES
#import bevy_gi::scene::probes::bindings::{offsets, probes}
#import bevy_gi::scene::probes::types::probe_count
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::slots::{UNKNOWN, slot_index, slots}
#import bevy_gi::technique::hints::types::{SLOT_EMISSION, SLOT_SKY}

// One of so many frames is a sleeping hint's turn; those of a workgroup have it together.
const TURNS: u32 = 4u;

// Whether a hint that lights no surface, or whose light has hardly changed, is left as it is in this frame. Sources are
// looked at once when they change, by all.
fn asleep(slot: u32, probe: u32) -> bool {
    if slot == SLOT_EMISSION || slot == SLOT_SKY {
        return false;
    }
    let turn = (probe / LANES + hints.frame) % TURNS == 0u;
    // How much its light changed when it was looked at last.
    let changed = slots[slot_index(slot, 0u, probe, hints.coefficients, probe_count(probes.dims))].w;
    let sleepy = offsets[probe].w >= hints.sleep_beyond || changed < hints.quiet;
    return !turn && sleepy && changed != UNKNOWN;
}

// Replaces a part of a slot's light by new light, and notes by what part of it the mean light differs from before.
fn blend_slot(slot: u32, probe: u32, light: ptr<function, array<vec3<f32>, 9>>, part: f32) {
    let count = probe_count(probes.dims);
    let first = slots[slot_index(slot, 0u, probe, hints.coefficients, count)];
    let difference = abs((*light)[0] - first.rgb);
    let larger = max((*light)[0], first.rgb);
    let changed = max(difference.r, max(difference.g, difference.b)) / max(max(larger.r, max(larger.g, larger.b)), 1e-30);
    for (var i = 0u; i < hints.coefficients; i++) {
        let at = slot_index(slot, i, probe, hints.coefficients, count);
        let before = slots[at];
        // What is there may be anything where nothing of it counts.
        let anew = part >= 1.0 || first.w == UNKNOWN;
        let light_ = mix(select(before.rgb, vec3(0.0), anew), (*light)[i], select(part, 1.0, anew));
        slots[at] = vec4(light_, select(changed, 1.0, first.w == UNKNOWN));
    }
}
