// Axes around a direction, and directions around an axis.
#define_import_path bevy_gi::gpu::basis

#import bevy_render::maths::PI_2

const GOLDEN_ANGLE: f32 = 2.39996323;

// A right-handed basis whose third axis is the unit vector `n`.
fn orthonormal(n: vec3<f32>) -> mat3x3<f32> {
    // Duff et al. 2017, "Building an orthonormal basis, revisited".
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return mat3x3(
        vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x),
        vec3(b, s + n.y * n.y * a, -n.y),
        n,
    );
}

// Direction `i` of `count` around +z, cosine-distributed: a Vogel spiral on the disk, lifted to the hemisphere, and
// turned by `turn` in 0..1.
fn hemisphere_spiral(i: u32, count: u32, turn: f32) -> vec3<f32> {
    let r2 = (f32(i) + 0.5) / f32(count);
    let phi = GOLDEN_ANGLE * f32(i) + PI_2 * turn;
    return vec3(sqrt(r2) * vec2(cos(phi), sin(phi)), sqrt(1.0 - r2));
}
