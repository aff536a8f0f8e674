// Axes around a direction.
#define_import_path bevy_gi::gpu::basis

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
