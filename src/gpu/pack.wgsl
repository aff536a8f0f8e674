// Packing of colours and directions into 32 bits.
#define_import_path bevy_gi::gpu::pack

#import bevy_pbr::utils::{octahedral_decode, octahedral_encode}

// Radiance has one exponent for all channels, as in Ward's RGBE (1991), but of seven bits: 2^-64 to 2^63 nits, from
// less than starlight to more than any star. The bit that is saved goes to green, which weighs most.
const EXPONENT_LEAST: i32 = -64;
const EXPONENT_MOST: i32 = 62;
const RADIANCE_MOST: f32 = 9e18;
const MANTISSAS: vec3<f32> = vec3(256.0, 512.0, 256.0);

// The exponent of a positive number: that of the power of two at or just below it.
fn exponent_of(x: f32) -> i32 {
    return i32((bitcast<u32>(x) >> 23u) & 0xffu) - 127;
}

// 2^e, exactly, for -126 to 127.
fn power_of_two(e: i32) -> f32 {
    return bitcast<f32>(u32(e + 127) << 23u);
}

// Rounded to nearest, so that light that is packed often is neither lost nor gained.
fn pack_radiance(nits: vec3<f32>) -> u32 {
    let c = clamp(nits, vec3(0.0), vec3(RADIANCE_MOST));
    let e = exponent_of(max(c.r, max(c.g, c.b)));
    if e < EXPONENT_LEAST {
        return 0u;
    }
    // All channels are below 2^(e + 1); one that is rounded up to it needs the next exponent.
    let m = round(c * power_of_two(-e - 1) * MANTISSAS);
    let up = any(m >= MANTISSAS);
    let bits = vec3<u32>(select(m, round(c * power_of_two(-e - 2) * MANTISSAS), up));
    let exponent = u32(e - EXPONENT_LEAST) + select(0u, 1u, up);
    return bits.r | (bits.g << 8u) | (bits.b << 17u) | (exponent << 25u);
}

fn unpack_radiance(packed: u32) -> vec3<f32> {
    let m = vec3<f32>((vec3(packed) >> vec3(0u, 8u, 17u)) & vec3(0xffu, 0x1ffu, 0xffu));
    return m / MANTISSAS * power_of_two(i32(packed >> 25u) + EXPONENT_LEAST + 1);
}

// A unit vector in 24 bits, flags in the other 8.
fn pack_normal(n: vec3<f32>, flags: u32) -> u32 {
    let e = vec2<u32>(saturate(octahedral_encode(n)) * 4095.0 + 0.5);
    return e.x | (e.y << 12u) | (flags << 24u);
}

fn unpack_normal(packed: u32) -> vec3<f32> {
    return octahedral_decode(vec2(f32(packed & 0xfffu), f32((packed >> 12u) & 0xfffu)) / 4095.0);
}

// A colour of 0..1 in 11, 11 and 10 bits: light that bounces many times multiplies the error of each.
const COLOR_STEPS: vec3<f32> = vec3(2047.0, 2047.0, 1023.0);

fn pack_color(c: vec3<f32>) -> u32 {
    let bits = vec3<u32>(round(saturate(c) * COLOR_STEPS));
    return bits.r | (bits.g << 11u) | (bits.b << 22u);
}

fn unpack_color(packed: u32) -> vec3<f32> {
    return vec3<f32>((vec3(packed) >> vec3(0u, 11u, 22u)) & vec3(0x7ffu, 0x7ffu, 0x3ffu)) / COLOR_STEPS;
}

// A positive number as a half float has it, rounded up or down at random (`random`: 0..1) so that its mean is kept:
// storing it is exact then, however a GPU rounds.
fn half_at_random(x: vec3<f32>, random: f32) -> vec3<f32> {
    // Of 23 bits of the mantissa, halves keep 10.
    let up = u32(random * 8192.0);
    let bits = bitcast<vec3<u32>>(clamp(x, vec3(0.0), vec3(65504.0))) + vec3(up);
    return bitcast<vec3<f32>>(bits & vec3(0xffffe000u));
}
