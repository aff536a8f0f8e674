// Light that surfaces send to the hints: their own, or what they reflect of a bounce.

#import bevy_gi::gpu::pack::{pack_radiance, unpack_radiance}
#import bevy_gi::gpu::sh::sh_basis
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::probes::bindings::probes
#import bevy_gi::scene::probes::types::{
    HIT_BACK, HIT_INSIDE, HIT_NOTHING, map_solid_angle, probe_count, ray_direction,
}
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_gi::scene::voxels::types::{BRICK, BRICK_VOXELS, brick_coords, local_coords, voxel_center}
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::types::{SLOT_EMISSION, SLOT_SKY, Stage}
#ifdef SURFACES
#import bevy_gi::gpu::row::{LANES, row_index}
#import bevy_gi::technique::hints::lookup::diffuse_light
#else
#import bevy_gi::scene::world::sky::sky_radiance
#import bevy_gi::technique::hints::accumulate::{asleep, blend_slot}
#import bevy_render::maths::PI
#endif

#ifdef SURFACES
@group(0) @binding(0) var<storage, read> brick_list: array<u32>;
@group(0) @binding(1) var<storage, read_write> reflected: array<vec2<u32>>;
@group(0) @binding(3) var<storage, read> voxel_list: array<u32>;
@group(0) @binding(4) var<storage, read> counters: array<u32>;

// One thread a voxel with a surface: what its front and its back reflect of the light at the hints.
@compute @workgroup_size(LANES)
fn light_surfaces(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let i = row_index(group, lane);
    if i >= counters[#{COUNTER_VOXELS}u] {
        return;
    }
    let index = voxel_list[i];
    let brick = brick_coords(brick_list[index / BRICK_VOXELS], volume.dims);
    let p = voxel_center(brick * BRICK + local_coords(index % BRICK_VOXELS), volume);
    let voxel = load_voxel(index);
    let front = voxel.albedo * diffuse_light(p, voxel.normal);
    var back = vec3(0.0);
    if voxel.two_sided {
        back = voxel.albedo * diffuse_light(p, -voxel.normal);
    }
    reflected[index] = vec2(pack_radiance(front), pack_radiance(back));
}
#else
@group(0) @binding(0) var<uniform> stage: Stage;
@group(0) @binding(1) var<storage, read> reflected: array<vec2<u32>>;
// See `bevy_gi::scene::probes`.
@group(0) @binding(4) var<storage, read> hits: array<vec2<u32>>;

// Radiance that arrives along a ray, nits.
fn arriving(hit: u32, dir: vec3<f32>, tan_half: f32) -> vec3<f32> {
    if hit == HIT_INSIDE {
        return vec3(0.0);
    }
    if (hit == HIT_NOTHING) != (stage.slot == SLOT_SKY) {
        return vec3(0.0);
    }
    if hit == HIT_NOTHING {
        return sky_radiance(dir, tan_half);
    }
    let index = hit & ~HIT_BACK;
    if stage.slot == SLOT_EMISSION {
        return load_voxel(index).emission;
    }
    let sides = reflected[index];
    return unpack_radiance(select(sides.x, sides.y, (hit & HIT_BACK) != 0u));
}

// One thread a hint.
@compute @workgroup_size(64)
fn collect_surfaces(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= probe_count(probes.dims) || asleep(stage.slot, id.x) {
        return;
    }
    let rays = probes.side * probes.side;
    // A cone as wide as a ray's share of the sphere.
    let tan_half = sqrt(4.0 / f32(rays));
    var light: array<vec3<f32>, 9>;
    var sphere = 0.0;
    for (var ray = 0u; ray < rays; ray++) {
        let dir = ray_direction(ray, id.x, probes);
        let solid_angle = map_solid_angle(dir, probes.side);
        sphere += solid_angle;
        let radiance = arriving(hits[id.x * rays + ray].x, dir, tan_half);
        if all(radiance <= vec3(0.0)) {
            continue;
        }
        var y_lm = sh_basis(dir);
        for (var i = 0u; i < hints.coefficients; i++) {
            light[i] += radiance * solid_angle * y_lm[i];
        }
    }
    for (var i = 0u; i < hints.coefficients; i++) {
        light[i] *= 4.0 * PI / sphere;
    }
    let sources = stage.slot == SLOT_EMISSION || stage.slot == SLOT_SKY;
    blend_slot(stage.slot, id.x, &light, select(hints.blend_bounces, hints.blend_sources, sources));
}
#endif
