// Turns the G-buffer that a light sees into surfaces, the texels of its reflective shadow map.

#import bevy_gi::gpu::color::luminance
#import bevy_gi::gpu::pack::pack_normal
#import bevy_gi::scene::world::falloff::{range_window, spot_attenuation}
#import bevy_gi::scene::light_maps::types::{map_position, surface_uv}
#import bevy_gi::scene::types::{LightMap, LightMaps}
#import bevy_gi::surface::reflectance::{albedo, albedo_mean, deferred_material}
#import bevy_pbr::{
    pbr_deferred_types::{
        DEFERRED_FLAGS_UNLIT_BIT, unpack_24bit_normal, unpack_flags,
    },
    rgb9e5::vec3_to_rgb9e5_,
    utils::octahedral_decode,
}

struct MapResolve {
    map: u32,
}

@group(0) @binding(0) var<uniform> resolve_: MapResolve;
@group(0) @binding(1) var<storage, read> maps: LightMaps;
@group(0) @binding(2) var depth_texture: texture_depth_2d;
@group(0) @binding(3) var deferred_texture: texture_2d<u32>;
@group(0) @binding(4) var texels: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(5) var flux: texture_storage_2d<r32float, write>;

// Whether a surface's light is counted here. Not that of surfaces far from the volume, which only throw their shadow into it;
// and where maps of a sun overlap, that of the finest, which come first.
fn is_of_this_map(map: LightMap, p: vec3<f32>) -> bool {
    if any(p < map.bounce_min) || any(p > map.bounce_max) {
        return false;
    }
    if map.kind != #{LIGHT_DIRECTIONAL}u {
        return true;
    }
    for (var i = resolve_.map; i > 0u; i--) {
        let finer = maps.array[i - 1u];
        if finer.light != map.light {
            break;
        }
        let ndc = finer.clip_from_world * vec4(p, 1.0);
        let bounces = all(p >= finer.bounce_min) && all(p <= finer.bounce_max);
        if all(abs(ndc.xy) < vec2(1.0)) && bounces {
            return false;
        }
    }
    return true;
}

// Texel of the G-buffer that a surface is made of.
fn drawn_at(map: LightMap, at: vec2<u32>) -> vec2<u32> {
    let tile = vec2<u32>(map.depth_origin * vec2<f32>(textureDimensions(depth_texture)));
    return tile + (at << vec2(map.reduction)) + ((1u << map.reduction) >> 1u);
}

// Where something is seen in a texel, metres; w is 0 if there is nothing.
fn seen_at(map: LightMap, at: vec2<i32>) -> vec4<f32> {
    if any(at < vec2(0)) || any(at >= vec2(i32(map.size))) {
        return vec4(0.0);
    }
    let z = textureLoad(depth_texture, drawn_at(map, vec2<u32>(at)), 0);
    if z == 0.0 {
        return vec4(0.0);
    }
    return vec4(map_position(map, surface_uv(map, vec2<u32>(at)), z), 1.0);
}

// A vector along the surface at `p`, towards the nearer of two neighbours: beyond an edge lies another surface.
fn tangent(map: LightMap, p: vec3<f32>, at: vec2<i32>, next: vec2<i32>) -> vec3<f32> {
    let after = seen_at(map, at + next);
    let before = seen_at(map, at - next);
    let a = after.xyz - p;
    let b = p - before.xyz;
    if after.w == 0.0 || (before.w != 0.0 && dot(b, b) < dot(a, a)) {
        return b * before.w;
    }
    return a;
}

// The normal on the lit side by the depths around a texel.
fn normal_of_depths(map: LightMap, p: vec3<f32>, at: vec2<i32>, to_light: vec3<f32>) -> vec3<f32> {
    let n = cross(tangent(map, p, at, vec2(1, 0)), tangent(map, p, at, vec2(0, 1)));
    let len = length(n);
    if !(len > 0.0) {
        return to_light;
    }
    return select(n, -n, dot(n, to_light) < 0.0) / len;
}

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    let map = maps.array[resolve_.map];
    if any(id.xy >= vec2(map.size)) {
        return;
    }
    let at = vec2<i32>(id.xy);
    let z = textureLoad(depth_texture, drawn_at(map, id.xy), 0);
    let packed = textureLoad(deferred_texture, drawn_at(map, id.xy), 0);
    let unlit = (unpack_flags(packed.a) & DEFERRED_FLAGS_UNLIT_BIT) != 0u;
    let texel = map.origin + id.xy;
    if z == 0.0 || all(packed == vec4(0u)) || unlit {
        textureStore(texels, texel, vec4(0u));
        textureStore(flux, texel, vec4(0.0));
        return;
    }
    let uv = surface_uv(map, id.xy);
    let p = map_position(map, uv, z);
    var n = octahedral_decode(unpack_24bit_normal(packed.a));

    // Part of the light that arrives in this texel, over `flux_scale`.
    var arrives = select(0.0, 1.0, is_of_this_map(map, p));
    var to_light = -map.direction;
    if map.kind != #{LIGHT_DIRECTIONAL}u {
        let d = p - map.position;
        let distance = length(d);
        to_light = -d / max(distance, 1e-6);
        // Solid angle of a texel over that of one in the middle: the cube of the cosine to the axis.
        let side = 2.0 * uv - 1.0;
        let axis = map_position(map, vec2(0.5), z) - map.position;
        let c = saturate(dot(normalize(axis), -to_light));
        arrives *= c * c * c * range_window(distance * distance, map.range);
        let cosine = dot(-to_light, map.direction);
        if map.kind == #{LIGHT_SPOT}u {
            arrives *= spot_attenuation(cosine, map.cos_inner, map.cos_outer);
        }
        if map.kind == #{LIGHT_RECT}u {
            // From afar, it shows less of its area to the side.
            arrives *= saturate(cosine);
        }
    }
    // A normal of zero or NaN becomes a corner of the octahedron in Bevy's G-buffer, as -z does.
    if n.z < -0.9999 {
        n = normal_of_depths(map, p, at, to_light);
    }
    // What the light sees is lit, whichever way a normal map or a two-sided leaf has turned it.
    n = select(n, -n, dot(n, to_light) < -0.2);
    let material = deferred_material(packed);
    let reflected = arrives * albedo(material, saturate(dot(n, to_light)));
    let words = vec4(
        vec3_to_rgb9e5_(reflected),
        pack_normal(n, 1u),
        bitcast<u32>(z),
        pack4x8unorm(vec4(albedo_mean(material), 1.0)),
    );
    textureStore(texels, texel, words);
    // Without the colour of the light, which may change without a new map.
    textureStore(flux, texel, vec4(luminance(reflected) * map.flux_scale));
}
