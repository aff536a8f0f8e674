// The light of some slots into the texture that is looked up.

#import bevy_gi::scene::probes::types::{probe_count, probe_index}
#import bevy_gi::technique::hints::slots::{load_distances, slot_index, slots}
#import bevy_gi::technique::hints::types::{SLOT_BOUNCES, SLOT_LIGHTS, Stage}

@group(0) @binding(0) var<uniform> stage: Stage;
@group(0) @binding(1) var target_: texture_storage_3d<rgba16float, write>;
@group(0) @binding(2) var<storage, read> albedos: array<vec4<f32>>;

// One thread a hint.
@compute @workgroup_size(4, 4, 4)
fn sum_slots(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id >= stage.dims) {
        return;
    }
    let probe = probe_index(id, stage.dims);
    let count = probe_count(stage.dims);
    var sum: array<vec3<f32>, 9>;
    for (var slot = 0u; slot < stage.slots; slot++) {
        if ((stage.mask >> slot) & 1u) == 0u {
            continue;
        }
        var gain = select(1.0, stage.first_gain, slot == SLOT_LIGHTS);
        gain = select(gain, stage.later_gain, slot >= SLOT_BOUNCES);
        for (var i = 0u; i < stage.coefficients; i++) {
            sum[i] += gain * slots[slot_index(slot, i, probe, stage.coefficients, count)].rgb / stage.unit;
        }
    }
    for (var color = 0u; color < 3u; color++) {
        store(id, color, vec4(sum[0][color], sum[1][color], sum[2][color], sum[3][color]));
        if stage.coefficients > 4u {
            store(id, 3u + color, vec4(sum[4][color], sum[5][color], sum[6][color], sum[7][color]));
        }
    }
    if stage.coefficients > 4u {
        store(id, 6u, vec4(sum[8], 0.0));
    }
    // Without lamps nothing is known.
    let distances = load_distances(probe, stage.coefficients, count);
    let known = select(vec2(0.0, 1.0), distances, distances.y > 0.0);
    let last = select(3u, 7u, stage.coefficients > 4u);
    store(id, last, vec4(known, 0.0, 0.0));
    store(id, last + 1u, albedos[probe]);
}

fn store(probe: vec3<u32>, block: u32, value: vec4<f32>) {
    let at = vec3(probe.xy, probe.z + block * stage.dims.z);
    textureStore(target_, at, clamp(value, vec4(-65504.0), vec4(65504.0)));
}
