// Which probes light a point, and how much each of them counts.
#define_import_path bevy_gi::scene::probes::lookup

#import bevy_gi::scene::probes::bindings::{moments, offsets, probe_sampler, probes}
#import bevy_gi::scene::probes::types::{cell_center, probe_index}
#import bevy_pbr::utils::octahedral_encode

// A point that is lit, among eight probes.
struct Lookup {
    position: vec3<f32>,
    normal: vec3<f32>,
    // The point whose visibility counts.
    lifted: vec3<f32>,
    // The lowest of the eight.
    base: vec3<i32>,
    fraction: vec3<f32>,
}

struct Corner {
    probe: vec3<u32>,
    weight: f32,
}

// Least weight of a probe: where nobody sees the point, those around it light it after all.
const LEAST: f32 = 1e-5;

fn probes_around(p: vec3<f32>, n: vec3<f32>) -> Lookup {
    var l: Lookup;
    l.position = p;
    l.normal = n;
    l.lifted = p + n * probes.bias * probes.cell;
    let at = (l.lifted - probes.origin) / probes.cell - 0.5;
    l.base = vec3<i32>(floor(at));
    l.fraction = at - floor(at);
    return l;
}

// Part of the light along a way of length `distance` in direction `dir` from a probe that arrives: an upper bound
// from the mean and the variance of the distances (Donnelly and Lauritzen 2006, equation 5), sharpened.
fn probe_sees(probe: vec3<u32>, dir: vec3<f32>, distance: f32) -> f32 {
    let tile = f32(probes.side + 2u);
    let texel = vec2<f32>(probe.xy) * tile + 1.0 + octahedral_encode(dir) * f32(probes.side);
    let size = vec2<f32>(probes.dims.xy) * tile;
    let m = textureSampleLevel(moments, probe_sampler, texel / size, probe.z, 0.0).xy;
    let beyond = distance - m.x;
    if beyond <= 0.0 {
        return 1.0;
    }
    let least = 0.03 * probes.cell;
    let variance = max(m.y - m.x * m.x, least * least);
    let bound = variance / (variance + beyond * beyond);
    return bound * bound * bound;
}

// Corner `i` of the eight.
fn probe_corner(l: Lookup, i: u32) -> Corner {
    let offset = vec3<i32>(vec3(i, i >> 1u, i >> 2u) & vec3(1u));
    var c: Corner;
    c.probe = vec3<u32>(clamp(l.base + offset, vec3(0), vec3<i32>(probes.dims) - 1));
    let share = mix(1.0 - l.fraction, l.fraction, vec3<f32>(offset));
    c.weight = share.x * share.y * share.z;
    let place = offsets[probe_index(c.probe, probes.dims)];
    if place.w == 0.0 {
        c.weight = 0.0;
        return c;
    }
    let position = cell_center(c.probe, probes) + place.xyz;
    // What is behind the surface does not see it; towards that, probes fade out.
    let facing = 0.5 + 0.5 * dot(normalize(position - l.position), l.normal);
    var seen = facing * facing;
    if probes.visibility != 0u {
        let way = l.lifted - position;
        let distance = max(length(way), 1e-4 * probes.cell);
        seen *= probe_sees(c.probe, way / distance, distance);
    }
    c.weight *= max(seen, LEAST);
    return c;
}
