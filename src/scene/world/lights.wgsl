// Direct light at a point: every kind of light, with its shadow.
#define_import_path bevy_gi::scene::world::lights

#import bevy_gi::scene::bindings::{depth_sampler, light_depth, light_maps, lights, volume}
#import bevy_gi::scene::world::falloff::{distance_attenuation, spot_attenuation}
#import bevy_gi::scene::types::Light
#import bevy_render::maths::PI
#import bevy_render::view::ndc_to_uv

// Face of a cube map whose axis is nearest to `d`: +x -x +y -y +z -z.
fn cube_face(d: vec3<f32>) -> i32 {
    let a = abs(d);
    if a.x >= a.y && a.x >= a.z {
        return select(1, 0, d.x > 0.0);
    }
    if a.y >= a.z {
        return select(3, 2, d.y > 0.0);
    }
    return select(5, 4, d.z > 0.0);
}

// Part of the light that reaches `p`, 0..1: a 2x2 filtered depth test.
fn visibility(light: Light, p: vec3<f32>) -> f32 {
    if light.shadow < 0 {
        return 1.0;
    }
    var number = u32(light.shadow);
    if light.kind == #{LIGHT_POINT}u || light.kind == #{LIGHT_RECT}u {
        number += u32(cube_face(p - light.position));
    } else if light.kind == #{LIGHT_DIRECTIONAL}u {
        number += volume.light_map;
    }
    let map = light_maps.array[number];
    if map.depth_drawn == 0u {
        // What stands in the way is not known yet.
        return 0.0;
    }
    let clip = map.clip_from_world * vec4(p, 1.0);
    let ndc = clip.xyz / clip.w;
    let uv = ndc_to_uv(ndc.xy);
    if clip.w <= 0.0 || any(uv < vec2(0.0)) || any(uv > vec2(1.0)) || ndc.z <= 0.0 {
        // Beyond the map nothing is known to stand in the way.
        return 1.0;
    }
    // Not into the tiles beside it.
    let inset = vec2(map.depth_inset);
    let at = map.depth_origin + map.depth_size * clamp(uv, inset, 1.0 - inset);
    return textureSampleCompareLevel(light_depth, depth_sampler, at, map.page, ndc.z);
}

// Whether `p` is so near to a lamp that its maps do not see it: then Bevy lets the light through to what is behind, and
// what lies there must not bounce it as well.
fn before_near_plane(light: Light, p: vec3<f32>, margin: f32) -> bool {
    let d = p - light.position;
    if light.kind == #{LIGHT_POINT}u {
        let a = abs(d);
        return max(a.x, max(a.y, a.z)) < light.near + margin;
    }
    return light.kind == #{LIGHT_SPOT}u && dot(d, light.direction) < light.near + margin;
}

// Irradiance at `p` on a surface facing `n`, lux, shadows left out.
fn irradiance_unshadowed(light: Light, p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    if light.kind == #{LIGHT_DIRECTIONAL}u {
        return light.color * saturate(dot(n, -light.direction));
    }
    if light.kind == #{LIGHT_RECT}u {
        return rect_irradiance(light, p, n);
    }
    let to_light = light.position - p;
    let d2 = dot(to_light, to_light);
    let l = to_light * inverseSqrt(max(d2, 1e-8));
    var attenuation = distance_attenuation(d2, light.range);
    if light.kind == #{LIGHT_SPOT}u {
        let c = dot(-l, light.direction);
        attenuation *= spot_attenuation(c, light.cos_inner, light.cos_outer);
    }
    return light.color * saturate(dot(n, l)) * attenuation;
}

// A rect light as 2x2 small patches of its area.
fn rect_irradiance(light: Light, p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let area = 4.0 * length(light.half_width) * length(light.half_height);
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let s = vec2(f32(i & 1u), f32(i >> 1u)) - 0.5;
        let to_light = light.position + s.x * light.half_width + s.y * light.half_height - p;
        let d2 = dot(to_light, to_light);
        let l = to_light * inverseSqrt(max(d2, 1e-8));
        let window = distance_attenuation(d2, light.range) * max(d2, 1e-4);
        // A patch is no point: next to it, it fills at most the hemisphere.
        let solid_angle = saturate(dot(-l, light.direction)) * area * 0.25 / max(d2, area * 0.05);
        sum += saturate(dot(n, l)) * solid_angle * window;
    }
    return light.color * min(sum, PI);
}

// Irradiance at `p` on a surface facing `n`, lux, of all lights with their shadows. Visibility is
// that of a point `lift` above the surface, averaged over a patch of half width `spread`.
fn direct_irradiance(p: vec3<f32>, n: vec3<f32>, lift: f32, spread: f32) -> vec3<f32> {
    let t = normalize(select(cross(n, vec3(0.0, 0.0, 1.0)), cross(n, vec3(1.0, 0.0, 0.0)), abs(n.z) > 0.7));
    let b = cross(n, t);
    var sum = vec3(0.0);
    for (var i = 0u; i < lights.count; i++) {
        let light = lights.array[i];
        let e = irradiance_unshadowed(light, p, n);
        // The surface lies anywhere in its voxel.
        if all(e <= vec3(0.0)) || before_near_plane(light, p, 0.5 * lift) {
            continue;
        }
        var seen = 0.0;
        for (var s = 0u; s < 4u; s++) {
            let o = vec2(f32(s & 1u), f32(s >> 1u)) * 2.0 - 1.0;
            seen += 0.25 * visibility(light, p + lift * n + spread * (o.x * t + o.y * b));
        }
        sum += e * seen;
    }
    return sum;
}
