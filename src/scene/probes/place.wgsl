// Where each probe of the lattice stands, and what it sees from there.

#import bevy_gi::gpu::row::{LANES, row_index}
#import bevy_gi::scene::probes::types::{
    HIT_BACK, HIT_INSIDE, HIT_NOTHING, Probes, cell_center, probe_coords, probe_count, ray_direction,
}
#import bevy_gi::scene::types::Volume
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_gi::scene::voxels::trace::{occupied_at, trace_voxels}
#import bevy_gi::scene::voxels::types::met_from_behind

struct ProbePass {
    volume: Volume,
    probes: Probes,
    // Probes placed by hand.
    pins: u32,
}

@group(0) @binding(3) var<uniform> pass_: ProbePass;
// Metres from the middle of the cell; w: metres to the nearest surface, 0 inside of something.
@group(0) @binding(4) var<storage, read_write> offsets: array<vec4<f32>>;
// Of each ray: a voxel of the pool with HIT_BACK, or another HIT, and the distance in metres as bits.
@group(0) @binding(5) var<storage, read_write> hits: array<vec2<u32>>;
// Where those stand.
@group(0) @binding(6) var<storage, read> pins: array<vec4<f32>>;

// Directions in which a probe looks around: to the neighbours in a cube.
const LOOKS: u32 = 26u;
const TRIES: u32 = 3u;
// Distance that a probe keeps from surfaces, and its longest way along each axis, as fractions of a cell.
const CLEARANCE: f32 = 0.3;
const FARTHEST: f32 = 0.45;
// Part of the looks that may meet the inside of something before the probe counts as inside.
const INSIDE: f32 = 0.25;

fn look(i: u32) -> vec3<f32> {
    let j = i + select(0u, 1u, i >= 13u);
    return normalize(vec3(f32(j % 3u), f32((j / 3u) % 3u), f32(j / 9u)) - 1.0);
}

struct Around {
    // Part of the looks that met a back.
    backs: f32,
    nearest: f32,
    nearest_dir: vec3<f32>,
    // The nearest surface met from behind: there is the way out.
    back: f32,
    back_dir: vec3<f32>,
}

fn look_around(p: vec3<f32>) -> Around {
    // As far as the inside of anything can be.
    let reach = 1e9;
    var a = Around(0.0, reach, vec3(0.0), reach, vec3(0.0));
    for (var i = 0u; i < LOOKS; i++) {
        let dir = look(i);
        let hit = trace_voxels(p, dir, reach, pass_.volume);
        if !hit.exists {
            continue;
        }
        let voxel = load_voxel(hit.index);
        if met_from_behind(voxel, dir) && !voxel.two_sided {
            a.backs += 1.0 / f32(LOOKS);
            if hit.distance < a.back {
                a.back = hit.distance;
                a.back_dir = dir;
            }
        } else if hit.distance < a.nearest {
            a.nearest = hit.distance;
            a.nearest_dir = dir;
        }
    }
    return a;
}

// The nearest free point around one in a surface's voxel.
fn step_out(p: vec3<f32>) -> vec3<f32> {
    for (var k = 1u; k <= 4u; k++) {
        for (var i = 0u; i < LOOKS; i++) {
            let q = p + look(i) * f32(k) * pass_.volume.voxel;
            if !occupied_at(q, pass_.volume) {
                return q;
            }
        }
    }
    return p;
}

// One thread a probe.
@compute @workgroup_size(LANES)
fn place(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let probe = row_index(group, lane);
    let probes = pass_.probes;
    let volume = pass_.volume;
    if probe >= probe_count(probes.dims) {
        return;
    }
    let cell = probe_coords(probe, probes.dims);
    let center = cell_center(cell, probes);
    var p = center;
    var pinned = probes.relocation == 0u;
    for (var i = 0u; i < pass_.pins; i++) {
        let pin = pins[i].xyz;
        if all(vec3<i32>(floor((pin - probes.origin) / probes.cell)) == vec3<i32>(cell)) {
            p = pin;
            pinned = true;
        }
    }
    var clear = 0.0;
    for (var try_ = 0u; try_ < TRIES; try_++) {
        let stuck = occupied_at(p, volume);
        let around = look_around(p);
        let outside = !stuck && around.backs <= INSIDE;
        clear = select(0.0, max(around.nearest, 1e-3 * volume.voxel), outside);
        let clearance = max(CLEARANCE * probes.cell, volume.voxel);
        if pinned || (outside && around.nearest >= clearance) {
            break;
        }
        var to = p;
        if stuck {
            to = step_out(p);
        } else if !outside {
            to = p + around.back_dir * (around.back + 2.0 * volume.voxel);
        } else {
            let away = -around.nearest_dir;
            let room = trace_voxels(p, away, probes.cell, volume).distance;
            to = p + away * max(0.0, min(clearance - around.nearest, 0.5 * (room - around.nearest)));
        }
        to = center + clamp(to - center, vec3(-FARTHEST * probes.cell), vec3(FARTHEST * probes.cell));
        // Out of one thing and into another is no way.
        if occupied_at(to, volume) && !stuck {
            break;
        }
        p = to;
    }
    offsets[probe] = vec4(p - center, clear);
}

// One thread a ray.
@compute @workgroup_size(LANES)
fn look_at_scene(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let probes = pass_.probes;
    let rays = probes.side * probes.side;
    let i = row_index(group, lane);
    if i >= probe_count(probes.dims) * rays {
        return;
    }
    let probe = i / rays;
    let offset = offsets[probe];
    if offset.w == 0.0 {
        hits[i] = vec2(HIT_INSIDE, 0u);
        return;
    }
    let p = cell_center(probe_coords(probe, probes.dims), probes) + offset.xyz;
    let dir = ray_direction(i % rays, probe, probes);
    let hit = trace_voxels(p, dir, 1e9, pass_.volume);
    if !hit.exists {
        hits[i] = vec2(HIT_NOTHING, bitcast<u32>(1e9));
        return;
    }
    let voxel = load_voxel(hit.index);
    var what = hit.index;
    if met_from_behind(voxel, dir) {
        what = select(HIT_INSIDE, hit.index | HIT_BACK, voxel.two_sided);
    }
    hits[i] = vec2(what, bitcast<u32>(hit.distance));
}
