// Group 3 of passes that read reflective shadow maps.
#define_import_path bevy_gi::scene::rsm::lookup

#import bevy_gi::scene::rsm::types::{RsmMaps, RsmTexel, Vpl, luminous_flux, unpack_rsm}

@group(3) @binding(0) var<storage, read> maps: RsmMaps;
@group(3) @binding(1) var texels: texture_2d_array<u32>;
@group(3) @binding(2) var flux: texture_2d_array<f32>;
@group(3) @binding(3) var<storage, read> vpls: array<Vpl>;

// Luminous flux that the surfaces in a map reflect, lumens.
fn map_flux(index: u32) -> f32 {
    return luminous_flux(maps.array[index], flux);
}

// The texel of a map; its light counts once, so a sample of it must be weighted.
fn load_rsm(index: u32, texel: vec2<u32>) -> RsmTexel {
    let map = maps.array[index];
    if map.drawn == 0u {
        var none: RsmTexel;
        return none;
    }
    return unpack_rsm(map, texel, textureLoad(texels, map.origin + texel, map.page, 0));
}
