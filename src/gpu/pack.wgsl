// Packing of colours and directions into 32 bits.
#define_import_path bevy_gi::gpu::pack

#import bevy_pbr::rgb9e5::{rgb9e5_to_vec3_, vec3_to_rgb9e5_}
#import bevy_pbr::utils::{octahedral_decode, octahedral_encode}

// Radiance is stored divided by this, in nits: half floats end at 65504, sunlit snow does not.
const RADIANCE_SCALE: f32 = 64.0;

fn pack_radiance(nits: vec3<f32>) -> u32 {
    return vec3_to_rgb9e5_(nits / RADIANCE_SCALE);
}

fn unpack_radiance(packed: u32) -> vec3<f32> {
    return rgb9e5_to_vec3_(packed) * RADIANCE_SCALE;
}

// A unit vector in 24 bits, flags in the other 8.
fn pack_normal(n: vec3<f32>, flags: u32) -> u32 {
    let e = vec2<u32>(saturate(octahedral_encode(n)) * 4095.0 + 0.5);
    return e.x | (e.y << 12u) | (flags << 24u);
}

fn unpack_normal(packed: u32) -> vec3<f32> {
    return octahedral_decode(vec2(f32(packed & 0xfffu), f32((packed >> 12u) & 0xfffu)) / 4095.0);
}
