// Gives every marked brick a slot in the pool, and computes the arguments of indirect dispatches.

#import bevy_gi::gpu::row::{LANES, row_arguments, row_groups, row_index}
#import bevy_gi::scene::voxels::types::{BRICK_EMPTY, BRICK_MARKED, SLICES, emission_bound}

@group(0) @binding(0) var<storage, read_write> brick_map: array<u32>;
@group(0) @binding(1) var<storage, read_write> brick_list: array<u32>;
@group(0) @binding(2) var<storage, read_write> counters: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read_write> arguments: array<u32>;
@group(0) @binding(4) var<storage, read_write> emission_levels: array<u32>;

// One thread a brick of the grid. Slots come in any order; nothing depends on it.
@compute @workgroup_size(LANES)
fn allocate(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let brick = row_index(group, lane);
    if brick >= arrayLength(&brick_map) || brick_map[brick] < BRICK_MARKED {
        return;
    }
    let level = brick_map[brick] - BRICK_MARKED;
    if level > 0u {
        // Positive numbers are in the order of their bits.
        atomicMax(&counters[#{COUNTER_EMISSION}u], bitcast<u32>(emission_bound(level)));
    }
    let slot = atomicAdd(&counters[#{COUNTER_BRICKS}u], 1u);
    if slot < arrayLength(&brick_list) {
        brick_map[brick] = slot + 1u;
        brick_list[slot] = brick;
        emission_levels[slot] = level;
    } else {
        brick_map[brick] = BRICK_EMPTY;
    }
}

fn set_arguments(at: u32, workgroups: u32) {
    let groups = row_arguments(workgroups);
    arguments[at] = groups.x;
    arguments[at + 1u] = groups.y;
    arguments[at + 2u] = groups.z;
}

// One thread in all, after `allocate`.
@compute @workgroup_size(1)
fn brick_arguments() {
    let bricks = min(atomicLoad(&counters[#{COUNTER_BRICKS}u]), arrayLength(&brick_list));
    set_arguments(#{ARGUMENT_BRICKS}u, bricks);
    set_arguments(#{ARGUMENT_CELLS}u, row_groups(bricks * 8u));
}

// One thread in all, after `resolve`: where each slice starts, and how many workgroups it takes.
@compute @workgroup_size(1)
fn slice_arguments() {
    var start = 0u;
    for (var s = 0u; s < SLICES; s++) {
        let count = atomicLoad(&counters[#{COUNTER_SLICE_COUNT}u + s]);
        atomicStore(&counters[#{COUNTER_SLICE_START}u + s], start);
        atomicStore(&counters[#{COUNTER_SLICE_CURSOR}u + s], start);
        set_arguments(#{ARGUMENT_SLICE}u + 3u * s, row_groups(count));
        start += count;
    }
    atomicStore(&counters[#{COUNTER_VOXELS}u], start);
    set_arguments(#{ARGUMENT_VOXELS}u, row_groups(start));
}
