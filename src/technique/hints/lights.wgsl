// Light of lamps that arrives at the hints after its first bounce, from the reflective shadow maps.

#import bevy_gi::gpu::random::random3
#import bevy_gi::gpu::sh::sh_basis
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::probes::types::{cell_center, probe_coords, probe_count}
#import bevy_gi::scene::probes::bindings::{offsets, probes}
#import bevy_gi::scene::light_maps::lookup::{load_lit_surface, maps, texels, vpls}
#import bevy_gi::scene::light_maps::types::{vpl_map, vpl_normal}
#import bevy_gi::scene::voxels::trace::{occupied_at, voxels_between}
#import bevy_gi::surface::kept_depth::CameraDepth
#import bevy_gi::technique::hints::accumulate::{asleep, blend_slot}
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::disk::{disk_center, disk_sample, flux_to_share, map_samples}
#import bevy_gi::technique::hints::slots::store_distances
#import bevy_gi::technique::hints::types::SLOT_LIGHTS
#import bevy_render::maths::PI
#import bevy_render::view::ndc_to_uv

// What the camera saw in the last frame.
@group(0) @binding(4) var camera_depth: texture_2d<f32>;
@group(0) @binding(5) var<uniform> camera: CameraDepth;

// A small patch of surface that sends light on.
struct Patch {
    position: vec3<f32>,
    normal: vec3<f32>,
    // Lumens.
    flux: vec3<f32>,
    // Square metres over pi.
    radius_squared: f32,
    // In which it was found.
    map: u32,
}

// What a hint has collected.
struct Collected {
    light: array<vec3<f32>, 9>,
    nearest: f32,
    farthest: f32,
}

// A point around the hint, another for each sample: a hint stands for all of its cell. Not beyond the nearest
// surface, at distance `clearance`.
fn receiver(p: vec3<f32>, clearance: f32, random: vec3<f32>) -> vec3<f32> {
    return p + (random - 0.5) * min(0.5 * probes.cell, clearance);
}

// Where rays to a patch end: above the voxels of its own surface. Beside a wall, that is in one of the wall's voxels; light
// came to the patch nevertheless, and on its way there is an empty one.
fn vantage(position: vec3<f32>, normal: vec3<f32>, map: u32) -> vec3<f32> {
    let above = position + normal * 1.5 * volume.voxel;
    let light = maps.array[min(map, maps.count)];
    var to_light = -light.direction;
    if light.kind != #{LIGHT_DIRECTIONAL}u {
        to_light = normalize(light.position - position);
    }
    for (var k = 0u; k < 4u; k++) {
        let end = above + f32(k) * volume.voxel * to_light;
        if !occupied_at(end, volume) {
            return end;
        }
    }
    return above;
}

// Adds what a patch sends to `y`: the irradiance across the way (Papaioannou 2011, equation 4, with unit vectors),
// of a patch that is no point.
fn add_patch(collected: ptr<function, Collected>, y: vec3<f32>, patch_: Patch, seen: f32) {
    let to = patch_.position - y;
    let d2 = dot(to, to);
    let dir = to * inverseSqrt(max(d2, 1e-12));
    let facing = -dot(patch_.normal, dir);
    let distance = saturate(sqrt(d2) / hints.reach);
    (*collected).nearest = min((*collected).nearest, distance);
    (*collected).farthest = max((*collected).farthest, distance);
    if facing <= 0.0 || seen <= 0.0 {
        return;
    }
    if hints.occlusion == #{OCCLUSION_VOXELS}u {
        if voxels_between(y, vantage(patch_.position, patch_.normal, patch_.map), volume) {
            return;
        }
    }
    // From farther away than its radius, patches of a surface add up as points do; from nearer, none is brighter
    // than its surface.
    let e = seen * patch_.flux * facing / (PI * max(d2, patch_.radius_squared));
    var y_lm = sh_basis(dir);
    for (var c = 0u; c < hints.coefficients; c++) {
        (*collected).light[c] += e * y_lm[c];
    }
}

// The virtual point lights whose turn it is.
fn add_vpls(collected: ptr<function, Collected>, p: vec3<f32>, clearance: f32, probe: u32) {
    // Each stands for all that this frame leaves out.
    let scale = f32(hints.vpls) / f32(hints.samples);
    for (var i = 0u; i < hints.samples; i++) {
        let vpl = vpls[hints.first_vpl + (hints.first_sample + i) % hints.vpls];
        if all(vpl.flux <= vec3(0.0)) {
            continue;
        }
        let y = receiver(p, clearance, random3(probe, i, hints.frame));
        let patch_ = Patch(vpl.position, vpl_normal(vpl), scale * vpl.flux, vpl.radius_squared, vpl_map(vpl));
        var seen = 1.0;
        if hints.occlusion == #{OCCLUSION_LIGHT_DEPTH}u || hints.occlusion == #{OCCLUSION_CAMERA_DEPTH}u {
            seen = march(vpl_map(vpl), patch_.position + patch_.normal * volume.voxel, y);
        }
        add_patch(collected, y, patch_, seen);
    }
}

// Whether a point is behind what the light of map `index` sees. Reverse depth: smaller is farther.
fn hidden_from_light(index: u32, p: vec3<f32>) -> bool {
    let map = maps.array[min(index, maps.count)];
    let clip = map.clip_from_world * vec4(p, 1.0);
    let ndc = clip.xyz / clip.w;
    let uv = ndc_to_uv(ndc.xy);
    if clip.w <= 0.0 || any(uv < vec2(0.0)) || any(uv >= vec2(1.0)) {
        return false;
    }
    let texel = map.origin + vec2<u32>(uv * f32(map.size));
    let depth = bitcast<f32>(textureLoad(texels, texel, map.page, 0).z);
    return ndc.z < depth * 0.98;
}

// Whether a point is behind what the camera saw.
fn hidden_from_camera(p: vec3<f32>) -> bool {
    let clip = camera.clip_from_world * vec4(p, 1.0);
    let ndc = clip.xyz / clip.w;
    let uv = ndc_to_uv(ndc.xy);
    if camera.seen == 0u || clip.w <= 0.0 || any(uv < vec2(0.0)) || any(uv >= vec2(1.0)) {
        return false;
    }
    let size = vec2<f32>(textureDimensions(camera_depth));
    return ndc.z < textureLoad(camera_depth, vec2<i32>(uv * size), 0).x * 0.98;
}

// Part of the light from `x` to `y` that is left, as depth guesses: that of map `index`, or of the camera.
fn march(index: u32, x: vec3<f32>, y: vec3<f32>) -> f32 {
    var left = 1.0;
    for (var i = 1u; i <= hints.occlusion_points; i++) {
        let p = mix(x, y, f32(i) / f32(hints.occlusion_points + 1u));
        var hidden = false;
        if hints.occlusion == #{OCCLUSION_LIGHT_DEPTH}u {
            hidden = hidden_from_light(index, p);
        } else {
            hidden = hidden_from_camera(p);
        }
        left *= select(1.0, hints.occlusion_left, hidden);
    }
    return left;
}

// Texels of every map in a disk around the hint.
fn add_disks(collected: ptr<function, Collected>, p: vec3<f32>, clearance: f32, probe: u32) {
    let total = flux_to_share();
    // Of all texels, or of those in the disk.
    let part = select(PI * hints.spread * hints.spread, 1.0, hints.sampling == #{SAMPLE_DISK_LITERAL}u);
    for (var m = 0u; m < maps.count; m++) {
        let size = f32(maps.array[m].size);
        let center = disk_center(m, p);
        let each = map_samples(m, total);
        let scale = size * size * part / f32(max(each, 1u));
        for (var i = 0u; i < each; i++) {
            let uv = disk_sample(m, i, probe, center);
            if any(uv < vec2(0.0)) || any(uv >= vec2(1.0)) {
                continue;
            }
            let texel = load_lit_surface(m, vec2<u32>(uv * size));
            if !texel.exists {
                continue;
            }
            let y = receiver(p, clearance, random3(probe, m * hints.samples + i, 1u));
            var seen = 1.0;
            if hints.occlusion == #{OCCLUSION_LIGHT_DEPTH}u || hints.occlusion == #{OCCLUSION_CAMERA_DEPTH}u {
                seen = march(m, texel.position + texel.normal * volume.voxel, y);
            }
            // A texel that stands for many is no point.
            let radius_squared = hints.min_distance * hints.min_distance;
            add_patch(collected, y, Patch(texel.position, texel.normal, scale * texel.flux, radius_squared, m), seen);
        }
    }
}

// One thread a hint.
@compute @workgroup_size(64)
fn collect_lights(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= probe_count(probes.dims) || asleep(SLOT_LIGHTS, id.x) {
        return;
    }
    let offset = offsets[id.x];
    var collected: Collected;
    collected.nearest = 1.0;
    if offset.w > 0.0 && hints.vpls > 0u {
        let p = cell_center(probe_coords(id.x, probes.dims), probes) + offset.xyz;
        if hints.sampling == #{SAMPLE_VPLS}u {
            add_vpls(&collected, p, offset.w, id.x);
        } else {
            add_disks(&collected, p, offset.w, id.x);
        }
    }
    // A pointer to a part of a variable is no argument.
    var light = collected.light;
    blend_slot(SLOT_LIGHTS, id.x, &light, hints.blend_lights);
    let distances = vec2(collected.nearest, max(collected.nearest, collected.farthest));
    store_distances(distances, id.x, hints.coefficients, probe_count(probes.dims));
}
