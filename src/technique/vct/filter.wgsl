// The radiance cache: voxels into cells of 2x2x2, and cells into coarser ones.
//
// Each cell is seen from six sides, as the scene's opacity is: a thin wall stays opaque, and each of its sides keeps
// its own light, at every level.

#import bevy_gi::gpu::pack::unpack_radiance
#import bevy_gi::scene::opacity::cells::{coverage, facing, octant, row}
#ifdef VOXELS
#import bevy_gi::gpu::row::{LANES, row_index}
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_gi::scene::voxels::types::{BRICK_VOXELS, brick_coords, local_index}
#endif

struct Mip {
    cells: vec3<u32>,
    unit: f32,
}

@group(0) @binding(0) var<uniform> mip: Mip;
@group(0) @binding(1) var destination: texture_storage_3d<rgba16float, write>;

// `near` in front of `far`.
fn over(near: vec4<f32>, far: vec4<f32>) -> vec4<f32> {
    return near + (1.0 - near.a) * far;
}

// What light that travels along `direction` meets in 2x2x2 cells.
fn see(cells: ptr<function, array<vec4<f32>, 8>>, direction: u32) -> vec4<f32> {
    var sum = vec4(0.0);
    for (var i = 0u; i < 4u; i++) {
        let order = row(direction, i);
        sum += 0.25 * over((*cells)[order.x], (*cells)[order.y]);
    }
    return sum;
}

fn store(cell: vec3<u32>, direction: u32, value: vec4<f32>) {
    textureStore(destination, vec3(cell.xy, cell.z + direction * mip.cells.z), value);
}

#ifdef CLEAR
// After a capture: where no brick is left, there is nothing. One thread a cell of level 0.
@compute @workgroup_size(4, 4, 4)
fn clear_cells(@builtin(global_invocation_id) cell: vec3<u32>) {
    if any(cell >= mip.cells) {
        return;
    }
    for (var d = 0u; d < #{DIRECTIONS}u; d++) {
        store(cell, d, vec4(0.0));
    }
}
#endif

#ifdef VOXELS
@group(0) @binding(3) var<storage, read> brick_list: array<u32>;
@group(0) @binding(4) var<storage, read> radiance: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read> counters: array<u32>;

// One thread a cell of level 0, of which a brick has 8.
@compute @workgroup_size(LANES)
fn filter_voxels(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = row_index(group, lane);
    let slot = i / 8u;
    if slot >= min(counters[#{COUNTER_BRICKS}u], arrayLength(&brick_list)) {
        return;
    }
    let brick = brick_coords(brick_list[slot], mip.cells * 2u);
    let cell = brick * 2u + octant(i);
    // Of each voxel: radiance of front and back, and the normal, with 0 for "nothing there".
    var front: array<vec3<f32>, 8>;
    var back: array<vec3<f32>, 8>;
    var normal: array<vec3<f32>, 8>;
    var two_sided: array<bool, 8>;
    for (var i = 0u; i < 8u; i++) {
        let at = cell * 2u + octant(i);
        let index = slot * BRICK_VOXELS + local_index(at);
        let voxel = load_voxel(index);
        let light = radiance[index];
        // Half floats end there.
        front[i] = min(unpack_radiance(light.x) / mip.unit, vec3(65504.0));
        back[i] = min(unpack_radiance(light.y) / mip.unit, vec3(65504.0));
        normal[i] = select(vec3(0.0), voxel.normal, voxel.exists);
        two_sided[i] = voxel.two_sided;
    }
    for (var d = 0u; d < #{DIRECTIONS}u; d++) {
        var seen: array<vec4<f32>, 8>;
        for (var i = 0u; i < 8u; i++) {
            let cosine = facing(normal[i], d);
            let light = select(front[i], back[i], two_sided[i] && cosine <= 0.0);
            seen[i] = vec4(light, 1.0) * coverage(cosine, two_sided[i]);
        }
        store(cell, d, see(&seen, d));
    }
}
#endif

#ifdef CELLS
@group(0) @binding(2) var finer: texture_3d<f32>;

// One thread a cell of a coarser level.
@compute @workgroup_size(4, 4, 4)
fn filter_cells(@builtin(global_invocation_id) cell: vec3<u32>) {
    if any(cell >= mip.cells) {
        return;
    }
    for (var d = 0u; d < #{DIRECTIONS}u; d++) {
        var seen: array<vec4<f32>, 8>;
        for (var i = 0u; i < 8u; i++) {
            let at = cell * 2u + octant(i);
            seen[i] = textureLoad(finer, vec3(at.xy, at.z + d * mip.cells.z * 2u), 0);
        }
        store(cell, d, see(&seen, d));
    }
}
#endif
