// Turns a voxel's sums into its surface, in place, and lists the voxels that have one.

#import bevy_gi::gpu::pack::{pack_color, pack_normal, pack_radiance}
#import bevy_gi::gpu::row::row_group
#import bevy_gi::scene::voxels::types::{
    BRICK, BRICK_VOXELS, FLAG_FACES, FLAG_SURFACE, FLAG_TWO_SIDED, Voxelize, WORDS, brick_coords, brick_slice,
    emission_unit,
}

@group(0) @binding(0) var<uniform> voxelize: Voxelize;
@group(0) @binding(1) var<storage, read_write> pool: array<u32>;
@group(0) @binding(2) var<storage, read> brick_list: array<u32>;
@group(0) @binding(3) var<storage, read_write> counters: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> voxel_list: array<u32>;
@group(0) @binding(5) var<storage, read_write> occupancy: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read> emission_levels: array<u32>;

// Word of the record that says whether there is a surface, for `list`.
fn record(slot: u32, local: u32) -> u32 {
    return (slot * BRICK_VOXELS + local) * WORDS;
}

// One workgroup a brick, one thread a voxel.
@compute @workgroup_size(BRICK_VOXELS)
fn resolve(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let slot = row_group(group);
    if slot >= min(atomicLoad(&counters[#{COUNTER_BRICKS}u]), arrayLength(&brick_list)) {
        return;
    }
    let at = record(slot, local);
    let positive = vec3<f32>((vec3(pool[at + 3u]) >> vec3(0u, 10u, 20u)) & vec3(0x3ffu));
    let negative = vec3<f32>((vec3(pool[at + 4u]) >> vec3(0u, 10u, 20u)) & vec3(0x3ffu));
    let samples = positive + negative;
    let axis_sum = vec3<f32>(
        f32(bitcast<i32>(pool[at + 5u])),
        f32(bitcast<i32>(pool[at + 6u])),
        f32(bitcast<i32>(pool[at + 7u])),
    );
    let total = samples.x + samples.y + samples.z;
    if total == 0.0 {
        return;
    }
    // Each facing group votes with its own sign. A voxel is two-sided where its largest group
    // looks both ways.
    var main_axis = 0u;
    if samples.y > samples.x && samples.y >= samples.z {
        main_axis = 1u;
    } else if samples.z > samples.x {
        main_axis = 2u;
    }
    let two_sided = 4.0 * min(positive[main_axis], negative[main_axis]) > samples[main_axis];
    var n = axis_sum;
    if !two_sided {
        n *= select(vec3(1.0), vec3(-1.0), (negative > positive) & (samples > vec3(0.0)));
        if samples[main_axis] == total && negative[main_axis] > positive[main_axis] {
            n = -axis_sum;
        }
    }
    n = select(vec3(0.0, 1.0, 0.0), normalize(n), dot(n, n) > 0.0);

    let color = vec3<f32>(vec3(pool[at], pool[at + 1u], pool[at + 2u])) / 65535.0;
    let least = vec3(0.125 * total);
    let bits = vec3(1u, 2u, 4u);
    let looks = select(vec3(0u), bits, positive >= least) | select(vec3(0u), bits << vec3(3u), negative >= least);
    let faces = looks.x | looks.y | looks.z;
    // Layers behind one another count once: a lamp just below a ceiling shines as brightly as alone. A
    // layer across the voxel has an area of 1 over the largest component of its normal, and each view
    // samples what it sees of that.
    // At an edge, each of the faces has an area of its own, and the mean of their normals that of none.
    let a = abs(n);
    let groups = countOneBits((faces | (faces >> 3u)) & 7u);
    let area = select((a.x + a.y + a.z) / max(a.x, max(a.y, a.z)), 1.0, groups > 1u);
    let layer = vec3(#{LAYER_SAMPLES}.0 * area);
    let samples_once = dot(min(positive, layer) + min(negative, layer), vec3(1.0));
    // A lamp that fills a part of the voxel shines as a whole one that is as much darker: the cells that are
    // made of it know of no parts.
    let samples_full = max(samples_once, layer.x * select(1.0, 2.0, two_sided));
    let emission = vec3<f32>(vec3(pool[at + 8u], pool[at + 9u], pool[at + 10u]))
        * emission_unit(emission_levels[slot]);
    let flags = FLAG_SURFACE | select(0u, FLAG_TWO_SIDED, two_sided) | (faces << FLAG_FACES);
    pool[at] = pack_color(color / total);
    pool[at + 1u] = pack_normal(n, flags);
    pool[at + 2u] = pack_radiance(emission / samples_full);
    let slice = brick_slice(brick_coords(brick_list[slot], voxelize.volume.dims));
    atomicAdd(&counters[#{COUNTER_SLICE_COUNT}u + slice], 1u);
}

// One workgroup a brick, one thread a voxel, once the slices' starts are known.
@compute @workgroup_size(BRICK_VOXELS)
fn list(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let slot = row_group(group);
    if slot >= min(atomicLoad(&counters[#{COUNTER_BRICKS}u]), arrayLength(&brick_list)) {
        return;
    }
    if ((pool[record(slot, local) + 1u] >> 24u) & FLAG_SURFACE) == 0u {
        return;
    }
    let slice = brick_slice(brick_coords(brick_list[slot], voxelize.volume.dims));
    let i = atomicAdd(&counters[#{COUNTER_SLICE_CURSOR}u + slice], 1u);
    voxel_list[i] = slot * BRICK_VOXELS + local;
    atomicOr(&occupancy[2u * slot + local / 32u], 1u << (local % 32u));
}
