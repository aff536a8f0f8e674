// Voxels into cells of 2x2x2, and cells into coarser ones.

#import bevy_gi::scene::opacity::cells::{coverage, facing, octant, row}
#ifdef VOXELS
#import bevy_gi::gpu::row::{LANES, row_index}
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_gi::scene::voxels::types::{BRICK_VOXELS, brick_coords, local_index}
#endif

struct OpacityLevel {
    cells: vec3<u32>,
}

@group(0) @binding(0) var<uniform> level: OpacityLevel;
@group(0) @binding(1) var destination: texture_storage_3d<rgba8unorm, write>;

// Opacity of eight cells in a row of directions: of two, the nearer covers the further one.
fn see(cells: ptr<function, array<f32, 8>>, direction: u32) -> f32 {
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let order = row(direction, i);
        let near = (*cells)[order.x];
        sum += 0.25 * (near + (1.0 - near) * (*cells)[order.y]);
    }
    return sum;
}

// `opacity` by direction.
fn store(cell: vec3<u32>, opacity: array<f32, 6>) {
    let positive = vec4(opacity[0], opacity[2], opacity[4], 0.0);
    let negative = vec4(opacity[1], opacity[3], opacity[5], 0.0);
    textureStore(destination, cell, positive);
    textureStore(destination, cell + vec3(0u, 0u, level.cells.z), negative);
}

#ifdef CLEAR
// One thread a cell of level 0.
@compute @workgroup_size(4, 4, 4)
fn clear_opacity(@builtin(global_invocation_id) cell: vec3<u32>) {
    if any(cell >= level.cells) {
        return;
    }
    store(cell, array<f32, 6>());
}
#endif

#ifdef VOXELS
@group(0) @binding(3) var<storage, read> brick_list: array<u32>;
@group(0) @binding(4) var<storage, read> counters: array<u32>;

// One thread a cell of level 0, of which a brick has 8.
@compute @workgroup_size(LANES)
fn filter_voxels(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = row_index(group, lane);
    let slot = i / 8u;
    if slot >= min(counters[#{COUNTER_BRICKS}u], arrayLength(&brick_list)) {
        return;
    }
    let brick = brick_coords(brick_list[slot], level.cells * 2u);
    let cell = brick * 2u + octant(i);
    var normal: array<vec3<f32>, 8>;
    var two_sided: array<bool, 8>;
    for (var v = 0u; v < 8u; v++) {
        let at = cell * 2u + octant(v);
        let voxel = load_voxel(slot * BRICK_VOXELS + local_index(at));
        // Without a normal, nothing is covered.
        normal[v] = select(vec3(0.0), voxel.normal, voxel.exists);
        two_sided[v] = voxel.two_sided;
    }
    var opacity: array<f32, 6>;
    for (var d = 0u; d < 6u; d++) {
        var covered: array<f32, 8>;
        for (var v = 0u; v < 8u; v++) {
            covered[v] = coverage(facing(normal[v], d), two_sided[v]);
        }
        opacity[d] = see(&covered, d);
    }
    store(cell, opacity);
}
#endif

#ifdef CELLS
@group(0) @binding(2) var finer: texture_3d<f32>;

// One thread a cell of a coarser level.
@compute @workgroup_size(4, 4, 4)
fn filter_cells(@builtin(global_invocation_id) cell: vec3<u32>) {
    if any(cell >= level.cells) {
        return;
    }
    var opacity: array<f32, 6>;
    for (var block = 0u; block < 2u; block++) {
        var finer_cells: array<vec3<f32>, 8>;
        for (var i = 0u; i < 8u; i++) {
            let at = cell * 2u + octant(i);
            finer_cells[i] = textureLoad(finer, vec3(at.xy, at.z + block * level.cells.z * 2u), 0).xyz;
        }
        for (var axis = 0u; axis < 3u; axis++) {
            var along: array<f32, 8>;
            for (var i = 0u; i < 8u; i++) {
                along[i] = finer_cells[i][axis];
            }
            let direction = 2u * axis + block;
            opacity[direction] = see(&along, direction);
        }
    }
    store(cell, opacity);
}
#endif
