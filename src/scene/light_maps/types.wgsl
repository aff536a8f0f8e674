// Surfaces that a light sees, and the virtual point lights chosen from them. Twin of types.rs.
#define_import_path bevy_gi::scene::light_maps::types

#import bevy_gi::gpu::color::luminance
#import bevy_gi::gpu::pack::unpack_normal
#import bevy_gi::scene::types::LightMap
#import bevy_pbr::utils::{octahedral_decode, octahedral_encode}
#import bevy_pbr::rgb9e5::rgb9e5_to_vec3_
#import bevy_render::view::uv_to_ndc

struct Vpl {
    position: vec3<f32>,
    radius_squared: f32,
    flux: vec3<f32>,
    normal: u32,
}

// What a light lights in a texel of its map.
struct LitSurface {
    exists: bool,
    position: vec3<f32>,
    normal: vec3<f32>,
    // Reflected, lumens.
    flux: vec3<f32>,
    albedo: vec3<f32>,
}

// Luminous flux of what the surfaces in a map reflect, lumens, from the top of its tile's mip chain: its light's colour is
// not yet in the texture.
fn luminous_flux(map: LightMap, flux: texture_2d_array<f32>) -> f32 {
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
fn map_position(map: LightMap, uv: vec2<f32>, z: f32) -> vec3<f32> {
    let ndc = vec3(uv_to_ndc(uv), z);
    let world = map.world_from_clip * vec4(ndc, 1.0);
    return world.xyz / world.w;
}

// Where in a map the point of a surface lies that its texel stands for.
fn surface_uv(map: LightMap, texel: vec2<u32>) -> vec2<f32> {
    return (vec2<f32>(texel) + map.center) / f32(map.size);
}

fn unpack_lit_surface(map: LightMap, texel: vec2<u32>, words: vec4<u32>) -> LitSurface {
    var t: LitSurface;
    t.exists = (words.y >> 24u) != 0u;
    if !t.exists {
        return t;
    }
    let uv = surface_uv(map, texel);
    t.position = map_position(map, uv, bitcast<f32>(words.z));
    t.normal = unpack_normal(words.y);
    t.flux = rgb9e5_to_vec3_(words.x) * map.color * map.flux_scale;
    t.albedo = unpack4x8unorm(words.w).rgb;
    return t;
}

// Area of the surface that a texel shows, square metres.
fn texel_area(map: LightMap, p: vec3<f32>, n: vec3<f32>) -> f32 {
    if map.kind == #{LIGHT_DIRECTIONAL}u {
        return map.flux_scale / max(abs(dot(n, map.direction)), 0.1);
    }
    let d = p - map.position;
    let distance = max(length(d), 1e-6);
    // A texel's solid angle goes with the cube of the cosine to the axis.
    let c = saturate((map.clip_from_world * vec4(p, 1.0)).w / distance);
    return map.flux_scale * c * c * c * distance * distance / max(abs(dot(n, d / distance)), 0.1);
}
