// What the paper guesses from distances alone, and where it reads: functions of numbers, without any binding.
#define_import_path bevy_gi::technique::hints::guess

#import bevy_render::maths::PI_2

// Whether two places see each other, guessed from the distances of what is nearest to and farthest from each
// (Papaioannou 2011, equation 11), all metres: surely, if the empty balls around both meet; surely not, beyond what
// both see.
fn guessed_visibility(distance: f32, a: vec2<f32>, b: vec2<f32>) -> f32 {
    let low = a.x + b.x;
    let high = a.y + b.y;
    return 1.0 - saturate((distance - low) / max(high - low, 1e-4 * max(distance, 1e-30)));
}

// Tap `i` of `taps` over a surface, z along its normal, in units of their distance: one along the normal, the others
// on a ring at an angle to it, all lifted by a half (section 5), so that none is behind the surface.
fn tap_offset(i: u32, taps: u32, ring_cos: f32) -> vec3<f32> {
    let lift = vec3(0.0, 0.0, 0.5);
    if i == 0u {
        return lift + vec3(0.0, 0.0, 1.0);
    }
    let phi = PI_2 * f32(i) / f32(max(taps, 2u) - 1u);
    return lift + vec3(sqrt(1.0 - ring_cos * ring_cos) * vec2(cos(phi), sin(phi)), ring_cos);
}
