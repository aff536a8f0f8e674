// Reflective shadow maps: a texel, and what one says. Twin of types.rs.
#define_import_path bevy_gi::scene::rsm::types

#import bevy_gi::gpu::color::luminance
#import bevy_gi::gpu::pack::unpack_normal
#import bevy_pbr::utils::{octahedral_decode, octahedral_encode}
#import bevy_pbr::rgb9e5::rgb9e5_to_vec3_
#import bevy_render::view::uv_to_ndc

struct RsmMap {
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    color: vec3<f32>,
    kind: u32,
    position: vec3<f32>,
    size: u32,
    direction: vec3<f32>,
    flux_scale: f32,
    range: f32,
    cos_inner: f32,
    cos_outer: f32,
    drawn: u32,
    light: u32,
    page: u32,
    bounce_min: vec3<f32>,
    bounce_max: vec3<f32>,
    origin: vec2<u32>,
}

struct RsmMaps {
    count: u32,
    array: array<RsmMap>,
}

struct Vpl {
    position: vec3<f32>,
    radius_squared: f32,
    flux: vec3<f32>,
    normal: u32,
}

// What a light lights in a texel of its map.
struct RsmTexel {
    exists: bool,
    position: vec3<f32>,
    normal: vec3<f32>,
    // Reflected, lumens.
    flux: vec3<f32>,
    albedo: vec3<f32>,
}

// Luminous flux of what the surfaces in a map reflect, lumens, from the top of its tile's mip chain: its light's colour is
// not yet in the texture.
fn luminous_flux(map: RsmMap, flux: texture_2d_array<f32>) -> f32 {
    let level = firstTrailingBit(map.size);
    let top = textureLoad(flux, map.origin >> vec2(level), map.page, level).x;
    return select(0.0, top * luminance(map.color), map.drawn != 0u);
}

// The normal of a virtual point light, and the number of its map.
fn pack_vpl_normal(n: vec3<f32>, map: u32) -> u32 {
    let e = vec2<u32>(saturate(octahedral_encode(n)) * 1023.0 + 0.5);
    return e.x | (e.y << 10u) | ((map + 1u) << 20u);
}

fn vpl_normal(vpl: Vpl) -> vec3<f32> {
    return octahedral_decode(vec2(f32(vpl.normal & 0x3ffu), f32((vpl.normal >> 10u) & 0x3ffu)) / 1023.0);
}

// Huge where there is none.
fn vpl_map(vpl: Vpl) -> u32 {
    return (vpl.normal >> 20u) - 1u;
}

// World position of a point of a map.
fn rsm_position(map: RsmMap, uv: vec2<f32>, z: f32) -> vec3<f32> {
    let ndc = vec3(uv_to_ndc(uv), z);
    let world = map.world_from_clip * vec4(ndc, 1.0);
    return world.xyz / world.w;
}

fn unpack_rsm(map: RsmMap, texel: vec2<u32>, words: vec4<u32>) -> RsmTexel {
    var t: RsmTexel;
    t.exists = (words.y >> 24u) != 0u;
    if !t.exists {
        return t;
    }
    let uv = (vec2<f32>(texel) + 0.5) / f32(map.size);
    t.position = rsm_position(map, uv, bitcast<f32>(words.z));
    t.normal = unpack_normal(words.y);
    t.flux = rgb9e5_to_vec3_(words.x) * map.color * map.flux_scale;
    t.albedo = unpack4x8unorm(words.w).rgb;
    return t;
}

// Area of the surface that a texel shows, square metres.
fn texel_area(map: RsmMap, p: vec3<f32>, n: vec3<f32>) -> f32 {
    if map.kind == #{LIGHT_DIRECTIONAL}u {
        return map.flux_scale / max(abs(dot(n, map.direction)), 0.1);
    }
    let d = p - map.position;
    let distance = max(length(d), 1e-6);
    // A texel's solid angle goes with the cube of the cosine to the axis.
    let c = saturate((map.clip_from_world * vec4(p, 1.0)).w / distance);
    return map.flux_scale * c * c * c * distance * distance / max(abs(dot(n, d / distance)), 0.1);
}
