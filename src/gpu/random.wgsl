// Low-discrepancy numbers for dithering; the same every run.
#define_import_path bevy_gi::gpu::random

// Interleaved gradient noise (Jimenez 2014): neighbouring pixels get well spread values, 0..1.
fn gradient_noise(pixel: vec2<f32>) -> f32 {
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// The R2 sequence (Roberts 2018) in time on top of a start value, 0..1 each: any stretch of frames
// covers the square evenly.
fn advance(start: vec2<f32>, frame: u32) -> vec2<f32> {
    return fract(start + f32(frame % 1024u) * vec2(0.7548776662, 0.5698402910));
}

// Three hashes of an integer point, one set for each round.
fn random3(a: u32, b: u32, round: u32) -> vec3<f32> {
    return vec3(
        hash3(vec3(a, b, 3u * round)),
        hash3(vec3(a, b, 3u * round + 1u)),
        hash3(vec3(a, b, 3u * round + 2u)),
    );
}

// A hash of an integer point, 0..1.
fn hash3(p: vec3<u32>) -> f32 {
    var h = p.x * 1597334677u ^ p.y * 3812015801u ^ p.z * 2798796415u;
    h = (h ^ (h >> 16u)) * 2246822519u;
    h = (h ^ (h >> 13u)) * 3266489917u;
    return f32((h ^ (h >> 16u)) >> 8u) / 16777216.0;
}
