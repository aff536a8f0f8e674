// The hints as spheres, and the taps over a picked surface.

#import bevy_gi::debug::types::Shape
#import bevy_gi::gpu::sh::sh_cosine
#import bevy_gi::scene::probes::bindings::{offsets, probes}
#import bevy_gi::scene::probes::lookup::probe_sees
#import bevy_gi::scene::probes::types::{cell_center, probe_coords, probe_count, probe_index}
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::guess::guessed_visibility
#import bevy_gi::technique::hints::lookup::{
    Coefficients, distance_block, load_block, load_hint, tap, weigh_signed,
}
#import bevy_gi::technique::hints::slots::{slot_index, slots}
#import bevy_gi::technique::hints::types::{HintsView, Picked}

@group(0) @binding(0) var<storage, read_write> shapes: array<Shape>;
@group(0) @binding(1) var<uniform> shown: HintsView;
@group(0) @binding(2) var<storage, read> picked: Picked;

fn hint_position(probe: u32) -> vec3<f32> {
    return cell_center(probe_coords(probe, probes.dims), probes) + offsets[probe].xyz;
}

// Light of some slots, as `load_hint` has that of all.
fn load_slots(probe: u32, mask: u32) -> Coefficients {
    let count = probe_count(probes.dims);
    var sum: array<vec3<f32>, 9>;
    for (var slot = 0u; slot < shown.slots; slot++) {
        for (var i = 0u; i < hints.coefficients && ((mask >> slot) & 1u) != 0u; i++) {
            sum[i] += slots[slot_index(slot, i, probe, hints.coefficients, count)].rgb / hints.unit;
        }
    }
    var c: Coefficients;
    for (var color = 0u; color < 3u; color++) {
        c.low[color] = vec4(sum[0][color], sum[1][color], sum[2][color], sum[3][color]);
        c.high[color] = vec4(sum[4][color], sum[5][color], sum[6][color], sum[7][color]);
    }
    c.last = sum[8];
    return c;
}

// What is no light: a number, or a colour.
fn plain_value(probe: u32) -> vec3<f32> {
    let at = probe_coords(probe, probes.dims);
    let distances = load_block(at, distance_block()).xy;
    switch shown.content {
        case #{SHOW_NEAREST}u: { return vec3(distances.x); }
        case #{SHOW_FARTHEST}u: { return vec3(distances.y); }
        case #{SHOW_CONFIDENCE}u: { return vec3(1.0 - distances.x); }
        case #{SHOW_VISIBILITY}u: {
            let own = load_block(probe_coords(picked.probe, probes.dims), distance_block()).xy;
            let apart = distance(hint_position(probe), hint_position(picked.probe));
            return vec3(guessed_visibility(apart, own * hints.reach, distances * hints.reach));
        }
        case #{SHOW_LEAK}u: { return vec3(hidden_neighbours(at, probe), 0.0, 0.0); }
        default: { return load_block(at, distance_block() + 1u).rgb; }
    }
}

// Part of the ways to the six neighbours that end before: between those, light would go through what is there.
fn hidden_neighbours(at: vec3<u32>, probe: u32) -> f32 {
    let p = hint_position(probe);
    var hidden = 0.0;
    var count = 1e-6;
    for (var i = 0u; i < 6u; i++) {
        let next = vec3<i32>(at) + vec3<i32>(side(i));
        if any(next < vec3(0)) || any(next >= vec3<i32>(probes.dims)) {
            continue;
        }
        let neighbour = probe_index(vec3<u32>(next), probes.dims);
        // Those inside of something light nothing.
        if offsets[neighbour].w == 0.0 {
            continue;
        }
        let way = hint_position(neighbour) - p;
        let distance = max(length(way), 1e-4 * probes.cell);
        hidden += 1.0 - probe_sees(at, way / distance, distance);
        count += 1.0;
    }
    return hidden / count;
}

fn side(i: u32) -> vec3<f32> {
    var axis = vec3(0.0);
    axis[i / 2u] = select(1.0, -1.0, (i & 1u) != 0u);
    return axis;
}

// Whether a hint is in the layer that is shown.
fn in_layer(at: vec3<u32>) -> bool {
    if shown.slice == 0u {
        return true;
    }
    let axis = shown.slice - 1u;
    return at[axis] == min(u32(shown.slice_at * f32(probes.dims[axis])), probes.dims[axis] - 1u);
}

@compute @workgroup_size(64)
fn show_hints(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= probe_count(probes.dims) {
        return;
    }
    let at = probe_coords(id.x, probes.dims);
    var shape: Shape;
    shape.center = hint_position(id.x);
    // Those that are inside of something light nothing.
    shape.radius = select(0.0, 0.12 * probes.cell, offsets[id.x].w > 0.0 && in_layer(at));
    var hint: Coefficients;
    if shown.is_light != 0u && shown.content != #{SHOW_LIGHT}u {
        hint = load_slots(id.x, shown.mask);
    } else {
        hint = load_hint(at);
    }
    var plain = vec3(0.0);
    if shown.is_light == 0u {
        plain = plain_value(id.x);
    }
    for (var i = 0u; i < 6u; i++) {
        let light = weigh_signed(hint, sh_cosine(side(i)));
        if shown.is_light != 0u {
            shape.sides[i] = vec4(max(light, vec3(0.0)), 1.0);
        } else if shown.content == #{SHOW_NEGATIVE}u {
            // Over what the mean of all directions would be.
            let mean = weigh_signed(hint, array(sh_cosine(side(i))[0], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0));
            let lacking = max(-light / max(mean, vec3(1e-30)), vec3(0.0));
            shape.sides[i] = vec4(saturate(max(lacking.r, max(lacking.g, lacking.b))), 0.0, 0.0, 0.0);
        } else {
            shape.sides[i] = vec4(plain, 0.0);
        }
    }
    shapes[id.x] = shape;
}

// The surface in white, the hint in red, and the taps in green.
@compute @workgroup_size(64)
fn show_taps(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= shown.taps {
        return;
    }
    let taps = hints.taps;
    var shape: Shape;
    shape.radius = select(0.0, 0.25 * probes.cell, picked.exists != 0u && id.x < taps + 2u);
    var color = vec3(0.1, 0.8, 0.2);
    if id.x < taps {
        shape.center = tap(picked.position, picked.normal, id.x);
    } else if id.x == taps {
        shape.center = picked.position;
        color = vec3(1.0);
    } else {
        shape.center = hint_position(picked.probe);
        // Still around the sphere of the hint itself.
        shape.radius *= 0.6;
        color = vec3(0.9, 0.1, 0.1);
    }
    for (var i = 0u; i < 6u; i++) {
        shape.sides[i] = vec4(color, 0.0);
    }
    shapes[id.x] = shape;
}
