// Real spherical harmonics up to band 2, in the order l = 0; l = 1: y, z, x; l = 2: xy, yz, z^2, xz,
// x^2 - y^2. Light is stored under the direction that it comes from.
#define_import_path bevy_gi::gpu::sh

// The nine functions.
fn sh_basis(d: vec3<f32>) -> array<f32, 9> {
    return array(
        0.28209479,
        0.48860251 * d.y,
        0.48860251 * d.z,
        0.48860251 * d.x,
        1.09254843 * d.x * d.y,
        1.09254843 * d.y * d.z,
        0.31539157 * (3.0 * d.z * d.z - 1.0),
        1.09254843 * d.x * d.z,
        0.54627422 * (d.x * d.x - d.y * d.y),
    );
}

// What coefficients of radiance are multiplied with to get the mean radiance over a lobe around `d`:
// `band` is the lobe's share of each band (Ramamoorthi and Hanrahan 2001, section 3.2).
fn sh_lobe(d: vec3<f32>, band: vec3<f32>) -> array<f32, 9> {
    var y = sh_basis(d);
    y[0] *= band.x;
    for (var i = 1u; i < 4u; i++) {
        y[i] *= band.y;
    }
    for (var i = 4u; i < 9u; i++) {
        y[i] *= band.z;
    }
    return y;
}

// The cosine lobe over pi: irradiance / pi on a surface that faces `n` (`A_l = pi, 2 pi / 3, pi / 4`).
fn sh_cosine(n: vec3<f32>) -> array<f32, 9> {
    return sh_lobe(n, vec3(1.0, 2.0 / 3.0, 0.25));
}
