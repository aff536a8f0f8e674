// Passes over the voxels: bounced light, and from it what each voxel radiates.

#import bevy_gi::gpu::pack::{pack_radiance, unpack_radiance}
#import bevy_gi::gpu::random::hash3
#import bevy_gi::gpu::row::{LANES, row_index}
#import bevy_gi::scene::voxels::types::{
    BRICK, BRICK_VOXELS, Voxel, brick_coords, brick_index, local_coords, local_index, voxel_center,
}
#ifdef BOUNCE
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_gi::technique::vct::lookup::diffuse_cones
#import bevy_gi::technique::vct::bindings::cones
#endif
#ifdef LIGHT
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::world::lights::direct_irradiance
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_render::maths::PI
#endif

struct VoxelPass {
    slice: u32,
    shift: vec3<i32>,
    carry: u32,
    dims: vec3<u32>,
}

@group(0) @binding(0) var<uniform> pass_: VoxelPass;
@group(0) @binding(1) var<storage, read> brick_list: array<u32>;
@group(0) @binding(3) var<storage, read> voxel_list: array<u32>;
@group(0) @binding(4) var<storage, read> counters: array<u32>;
// Bounced irradiance over pi of front and back, one pair of words a voxel of the pool.
@group(0) @binding(5) var<storage, read_write> bounced: array<vec2<u32>>;
// What `light` writes: the radiance of front and back. What `carry` reads: the previous `bounced`.
@group(0) @binding(6) var<storage, read_write> other: array<vec2<u32>>;

struct Item {
    exists: bool,
    // Index in the pool.
    index: u32,
    coords: vec3<u32>,
}

fn item(group: vec3<u32>, lane: u32, first: u32, count: u32) -> Item {
    let i = row_index(group, lane);
    if i >= count {
        return Item(false, 0u, vec3(0u));
    }
    let index = voxel_list[first + i];
    let brick = brick_coords(brick_list[index / BRICK_VOXELS], pass_.dims);
    return Item(true, index, brick * BRICK + local_coords(index % BRICK_VOXELS));
}

#ifdef CARRY
@group(0) @binding(2) var<storage, read> previous_brick_map: array<u32>;

// After a capture: each voxel finds the bounced light that it had before.
@compute @workgroup_size(LANES)
fn carry(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let v = item(group, lane, 0u, counters[#{COUNTER_VOXELS}u]);
    if !v.exists {
        return;
    }
    if pass_.carry == 0u {
        bounced[v.index] = vec2(0u);
        return;
    }
    let old = vec3<i32>(v.coords) + pass_.shift;
    var light = previous(old);
    if all(light == vec2(0u)) {
        // A surface moved here: what is around it is lit alike, until its own turn comes.
        var front = vec3(0.0);
        var back = vec3(0.0);
        var count = 0.0;
        for (var i = 0; i < 27; i++) {
            let near = previous(old + vec3(i % 3, (i / 3) % 3, i / 9) - 1);
            if any(near != vec2(0u)) {
                front += unpack_radiance(near.x);
                back += unpack_radiance(near.y);
                count += 1.0;
            }
        }
        light = vec2(pack_radiance(front / max(count, 1.0)), pack_radiance(back / max(count, 1.0)));
    }
    bounced[v.index] = light;
}

// Bounced light of a voxel of the previous capture; 0 if there was none.
fn previous(at: vec3<i32>) -> vec2<u32> {
    if any(at < vec3(0)) || any(at >= vec3<i32>(pass_.dims)) {
        return vec2(0u);
    }
    let voxel = vec3<u32>(at);
    let slot = previous_brick_map[brick_index(voxel, pass_.dims)];
    if slot == 0u {
        return vec2(0u);
    }
    return other[(slot - 1u) * BRICK_VOXELS + local_index(voxel)];
}
#endif

#ifdef BOUNCE
// Traces the light that arrives at the voxels of one slice from all others.
@compute @workgroup_size(LANES)
fn bounce(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let first = counters[#{COUNTER_SLICE_START}u + pass_.slice];
    let v = item(group, lane, first, counters[#{COUNTER_SLICE_COUNT}u + pass_.slice]);
    if !v.exists {
        return;
    }
    let voxel = load_voxel(v.index);
    let p = voxel_center(v.coords, volume);
    // Neighbours look in different directions; a voxel always in the same ones, or it would flicker.
    let turn = hash3(v.coords);
    let front = diffuse_cones(p, voxel.normal, cones.bounce_cones, turn, 0.5, true);
    var back = vec3(0.0);
    if voxel.two_sided {
        back = diffuse_cones(p, -voxel.normal, cones.bounce_cones, turn, 0.5, true).radiance;
    }
    bounced[v.index] = vec2(pack_radiance(front.radiance), pack_radiance(back));
}
#endif

#ifdef LIGHT
// Radiance of a side: emission, and what it reflects.
fn side(voxel: Voxel, p: vec3<f32>, n: vec3<f32>, bounced: vec3<f32>) -> vec3<f32> {
    // The surface lies anywhere in the voxel: a whole voxel above its centre is surely outside.
    let direct = direct_irradiance(p, n, volume.voxel, 0.3 * volume.voxel) / PI;
    return voxel.emission + voxel.albedo * (direct + bounced);
}

// Lights every voxel.
@compute @workgroup_size(LANES)
fn light(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let v = item(group, lane, 0u, counters[#{COUNTER_VOXELS}u]);
    if !v.exists {
        return;
    }
    let voxel = load_voxel(v.index);
    let p = voxel_center(v.coords, volume);
    let light = bounced[v.index];
    let front = side(voxel, p, voxel.normal, unpack_radiance(light.x));
    var back = vec3(0.0);
    if voxel.two_sided {
        back = side(voxel, p, -voxel.normal, unpack_radiance(light.y));
    }
    other[v.index] = vec2(pack_radiance(front), pack_radiance(back));
}
#endif
