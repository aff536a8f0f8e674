// Rays through the voxels. Bindings 0 and 1 of group 0 of whoever traces.
#define_import_path bevy_gi::scene::voxels::trace

#import bevy_gi::scene::types::Volume
#import bevy_gi::scene::voxels::types::{BRICK, BRICK_MARKED, BRICK_VOXELS, brick_index, local_index}

@group(0) @binding(0) var<storage, read> brick_map: array<u32>;
@group(0) @binding(1) var<storage, read> occupancy: array<u32>;

struct Hit {
    exists: bool,
    // In the pool.
    index: u32,
    // Where the voxel is entered, metres from the origin; where nothing is hit, the length of the ray.
    distance: f32,
}

// Slot in the pool of the brick of a voxel, or -1 where it has none.
fn brick_slot(voxel: vec3<i32>, volume: Volume) -> i32 {
    let slot = brick_map[brick_index(vec3<u32>(voxel), volume.dims)];
    return select(i32(slot) - 1, -1, slot >= BRICK_MARKED);
}

fn is_occupied(slot: u32, voxel: vec3<i32>) -> bool {
    let local = local_index(vec3<u32>(voxel));
    return ((occupancy[2u * slot + local / 32u] >> (local % 32u)) & 1u) != 0u;
}

// A point in voxels, rounded to 1/1024: probes of a regular lattice stand on faces of voxels, and which voxel they are
// in must not be left to what is lost in single precision, which differs with the place and the size of the world.
fn in_voxels(p: vec3<f32>, volume: Volume) -> vec3<f32> {
    return round((p - volume.origin) / volume.voxel * 1024.0) / 1024.0;
}

// Whether a surface is in the voxel at a point.
fn occupied_at(p: vec3<f32>, volume: Volume) -> bool {
    let voxel = vec3<i32>(floor(in_voxels(p, volume)));
    if any(voxel < vec3(0)) || any(voxel >= vec3<i32>(volume.dims)) {
        return false;
    }
    let slot = brick_slot(voxel, volume);
    return slot >= 0 && is_occupied(u32(slot), voxel);
}

// The first surface within `reach` metres of `p` along the unit vector `dir`: voxel by voxel through each
// face (Amanatides and Woo 1987), empty bricks in one step. No ray passes a closed surface.
fn trace_voxels(p: vec3<f32>, dir: vec3<f32>, reach: f32, volume: Volume) -> Hit {
    let none = Hit(false, 0u, reach);
    let dims = vec3<i32>(volume.dims);
    // In voxels from here on.
    let o = in_voxels(p, volume);
    let end = reach / volume.voxel;
    let forward = dir >= vec3(0.0);
    let inverse = 1.0 / select(select(vec3(-1e-7), vec3(1e-7), forward), dir, abs(dir) > vec3(1e-7));
    // From outside, the ray begins where it enters the grid.
    let near = (select(vec3<f32>(dims), vec3(0.0), forward) - o) * inverse;
    var t = max(0.0, max(near.x, max(near.y, near.z)));
    let far = (select(vec3(0.0), vec3<f32>(dims), forward) - o) * inverse;
    if t > min(end, min(far.x, min(far.y, far.z))) {
        return none;
    }
    var voxel = clamp(vec3<i32>(floor(o + dir * t)), vec3(0), dims - 1);
    // More steps than any ray through the grid takes.
    let most = volume.dims.x + volume.dims.y + volume.dims.z;
    for (var i = 0u; i < most; i++) {
        let slot = brick_slot(voxel, volume);
        if slot >= 0 && is_occupied(u32(slot), voxel) {
            return Hit(true, u32(slot) * BRICK_VOXELS + local_index(vec3<u32>(voxel)), t * volume.voxel);
        }
        // The box that is surely empty: the voxel, or the whole brick.
        let size = select(i32(BRICK), 1, slot >= 0);
        let low = (voxel / size) * size;
        let exits = (vec3<f32>(select(low, low + size, forward)) - o) * inverse;
        t = max(t, min(exits.x, min(exits.y, exits.z)));
        if t > end {
            return none;
        }
        let inside = clamp(vec3<i32>(floor(o + dir * t)), low, low + size - 1);
        let out = select(low - 1, low + size, forward);
        if exits.x <= exits.y && exits.x <= exits.z {
            voxel = vec3(out.x, inside.yz);
        } else if exits.y <= exits.z {
            voxel = vec3(inside.x, out.y, inside.z);
        } else {
            voxel = vec3(inside.xy, out.z);
        }
        if any(voxel < vec3(0)) || any(voxel >= dims) {
            return none;
        }
    }
    return none;
}

// Whether a surface stands between `p` and `q`.
fn voxels_between(p: vec3<f32>, q: vec3<f32>, volume: Volume) -> bool {
    let d = q - p;
    let distance = length(d);
    return distance > 0.0 && trace_voxels(p, d / distance, distance, volume).exists;
}
