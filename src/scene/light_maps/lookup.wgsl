// Group 3 of passes that read the surfaces in light maps: reflective shadow maps.
#define_import_path bevy_gi::scene::light_maps::lookup

#import bevy_gi::scene::types::LightMaps
#import bevy_gi::scene::light_maps::types::{LitSurface, Vpl, luminous_flux, unpack_lit_surface}

@group(3) @binding(0) var<storage, read> maps: LightMaps;
@group(3) @binding(1) var texels: texture_2d_array<u32>;
@group(3) @binding(2) var flux: texture_2d_array<f32>;
@group(3) @binding(3) var<storage, read> vpls: array<Vpl>;

// Luminous flux that the surfaces in a map reflect, lumens.
fn map_flux(index: u32) -> f32 {
    return luminous_flux(maps.array[index], flux);
}

// The texel of a map; its light counts once, so a sample of it must be weighted.
fn load_lit_surface(index: u32, texel: vec2<u32>) -> LitSurface {
    let map = maps.array[index];
    if map.drawn == 0u {
        var none: LitSurface;
        return none;
    }
    return unpack_lit_surface(map, texel, textureLoad(texels, map.origin + texel, map.page, 0));
}
