// Probes: their lattice, and the octahedral maps of what they see. Twin of types.rs.
#define_import_path bevy_gi::scene::probes::types

#import bevy_gi::gpu::random::hash3
#import bevy_pbr::utils::octahedral_decode

const HIT_NOTHING: u32 = #{HIT_NOTHING}u;
const HIT_INSIDE: u32 = #{HIT_INSIDE}u;
const HIT_BACK: u32 = #{HIT_BACK}u;

struct Probes {
    origin: vec3<f32>,
    cell: f32,
    dims: vec3<u32>,
    side: u32,
    bias: f32,
    visibility: u32,
    relocation: u32,
    round: u32,
    sleeping: u32,
}

fn probe_index(at: vec3<u32>, dims: vec3<u32>) -> u32 {
    return (at.z * dims.y + at.y) * dims.x + at.x;
}

fn probe_count(dims: vec3<u32>) -> u32 {
    return dims.x * dims.y * dims.z;
}

fn probe_coords(index: u32, dims: vec3<u32>) -> vec3<u32> {
    return vec3(index % dims.x, (index / dims.x) % dims.y, index / (dims.x * dims.y));
}

// The middle of a probe's cell, metres.
fn cell_center(at: vec3<u32>, probes: Probes) -> vec3<f32> {
    return probes.origin + (vec3<f32>(at) + 0.5) * probes.cell;
}

// Direction of a ray of a probe: in its texel's middle, or elsewhere in it in later rounds.
fn ray_direction(ray: u32, probe: u32, probes: Probes) -> vec3<f32> {
    var at = vec2(0.5);
    if probes.round > 0u {
        at.x = hash3(vec3(probe, ray, 2u * probes.round));
        at.y = hash3(vec3(probe, ray, 2u * probes.round + 1u));
    }
    let texel = vec2(f32(ray % probes.side), f32(ray / probes.side));
    return octahedral_decode((texel + at) / f32(probes.side));
}

// Solid angle of a texel of a map of `side` x `side`, in the direction `dir`, sr: a face of the octahedron
// seen from its middle.
fn map_solid_angle(dir: vec3<f32>, side: u32) -> f32 {
    // The point of the octahedron is dir / m, its distance 1 / m.
    let m = abs(dir.x) + abs(dir.y) + abs(dir.z);
    return m * m * m * 4.0 / f32(side * side);
}

// The texel that is really at `at`, which may lie one beyond the border: there the map goes on
// where it is folded.
fn wrap_texel(at: vec2<i32>, side: i32) -> vec2<i32> {
    var t = at;
    if t.x < 0 || t.x >= side {
        t = vec2(clamp(t.x, 0, side - 1), side - 1 - t.y);
    }
    if t.y < 0 || t.y >= side {
        t = vec2(side - 1 - t.x, clamp(t.y, 0, side - 1));
    }
    return t;
}
