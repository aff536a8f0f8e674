// What materials reflect, as Bevy's lamps have it: Burley's diffuse lobe and a GGX lobe with height-correlated Smith
// masking, added. Everything is the lobe integrated over the hemisphere: for light from everywhere, seen from one
// direction (or, by reciprocity, for light from one direction, seen from everywhere), or for both from everywhere.
#define_import_path bevy_gi::surface::reflectance

#import bevy_pbr::pbr_deferred_types::unpack_unorm4x8_

struct Material {
    base_color: vec3<f32>,
    // Perceptual.
    roughness: f32,
    metallic: f32,
    reflectance: vec3<f32>,
}

// The material in a texel of Bevy's G-buffer.
fn deferred_material(packed: vec4<u32>) -> Material {
    let color = unpack_unorm4x8_(packed.r);
    let properties = unpack_unorm4x8_(packed.b);
    return Material(pow(color.rgb, vec3(2.2)), color.a, properties.g, vec3(properties.r));
}

// Reflectance at most of what light bounces off. Bevy's lobes together may reflect more than all of it.
const ALBEDO_MOST: f32 = 0.98;

fn diffuse_color(m: Material) -> vec3<f32> {
    return m.base_color * (1.0 - m.metallic);
}

// Specular reflectance at normal incidence (`calculate_F0`).
fn f0(m: Material) -> vec3<f32> {
    return mix(0.16 * m.reflectance * m.reflectance, m.base_color, m.metallic);
}

// At grazing incidence.
fn f90(f: vec3<f32>) -> f32 {
    return saturate(16.5 * (f.r + f.g + f.b));
}

// Whether a specular lobe would be seen at all.
fn specular_matters(m: Material) -> bool {
    return max(max(m.reflectance.r, max(m.reflectance.g, m.reflectance.b)), m.metallic) > 0.01;
}

// The integrals over the cosine x of x (1 - x)^5, x^2 (1 - x)^5 and x^3 (1 - x)^5, twice.
const BURLEY: vec3<f32> = vec3(1.0 / 21.0, 1.0 / 84.0, 1.0 / 252.0);

// Burley's lobe (2012) over Lambert's for light from everywhere, seen at cosine `c`. Bevy's `Fd_Burley` is a polynomial in
// the cosine between the two directions, so that this is exact.
fn burley(roughness: f32, c: f32) -> f32 {
    let alpha = roughness * roughness;
    let t = 1.0 - c;
    let seen = t * t * t * t * t;
    let i = BURLEY;
    let once = i.x + c * i.y;
    let twice = i.x + 2.0 * c * i.y + c * c * i.z + 0.5 * (1.0 - c * c) * (i.x - i.z);
    let light = alpha * once - 0.5 * i.x;
    let view = alpha * (1.0 + 2.0 / 3.0 * c) - 0.5;
    let both = alpha * alpha * twice - alpha * once + 0.25 * i.x;
    return 1.0 + light + seen * (view + both);
}

// The same, seen from everywhere.
fn burley_mean(roughness: f32) -> f32 {
    let alpha = roughness * roughness;
    let i = BURLEY;
    let once = alpha * (i.x + 2.0 / 3.0 * i.y) - 0.5 * i.x;
    let twice = i.x * i.x + 2.0 * i.y * i.y + i.z * i.z + 0.5 * (i.x - i.z) * (i.x - i.z);
    return 1.0 + 2.0 * once + alpha * alpha * twice - alpha * (i.x * i.x + i.y * i.y) + 0.25 * i.x * i.x;
}

// Scale and offset of F0 in the reflectance of a GGX lobe, as Bevy fits them (`F_AB`, Karis 2014).
fn fitted_scale_and_offset(roughness: f32, n_dot_v: f32) -> vec2<f32> {
    let c0 = vec4(-1.0, -0.0275, -0.572, 0.022);
    let c1 = vec4(1.0, 0.0425, 1.04, -0.04);
    let r = roughness * c0 + c1;
    let a = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return max(vec2(-1.04, 1.04) * a + r.zw, vec2(5e-5));
}

// The same for the lobe that Bevy shades lamps with: GGX with height-correlated Smith masking, integrated over the
// hemisphere. Least-squares fits in roughness 0..1 and cosine 0.05..1, whose error is 0.01 (RMS). Bevy's own fit is
// of another lobe: at roughness 0.9 seen head-on, it has 0.46 where this one has 0.36.
fn scale_and_offset(roughness: f32, n_dot_v: f32) -> vec2<f32> {
    let r2 = roughness * roughness;
    let r = vec4(1.0, r2, r2 * roughness, r2 * r2);
    let c = n_dot_v;
    let t = 1.0 - n_dot_v;
    let whole = mat4x4(
        0.950, -0.987, 2.593, -1.670,
        0.390, -5.233, 2.900, 0.422,
        -0.731, 19.051, -30.528, 13.885,
        0.386, -11.957, 21.601, -10.779,
    );
    let grazing = mat4x4(
        0.345, -1.692, 1.348, 0.034,
        -2.084, 9.076, -3.830, -3.377,
        3.840, -3.670, -23.985, 24.378,
        -1.162, -13.261, 43.509, -29.476,
    );
    let sum = dot(r, whole * vec4(1.0, c, c * c, c * c * c));
    let offset = dot(r, grazing * (t * t * vec4(1.0, t, t * t, t * t * t)));
    return saturate(vec2(sum - offset, offset));
}

// Part of light from everywhere in the specular lobe that is reflected (`specular_multiscatter`), seen at cosine `c`: with
// the compensation for several bounces between microfacets, and grazing reflectance that vanishes with F0.
fn specular_albedo(m: Material, c: f32) -> vec3<f32> {
    let f = f0(m);
    let ab = scale_and_offset(m.roughness, c);
    let fitted = fitted_scale_and_offset(m.roughness, c);
    return (f * ab.x + f90(f) * ab.y) * (1.0 + f * (1.0 / (fitted.x + fitted.y) - 1.0));
}

// The same, seen from everywhere: least-squares fits in roughness, whose error is below 0.004 of F0.
fn specular_albedo_mean(m: Material) -> vec3<f32> {
    let r = m.roughness;
    let r2 = r * r;
    let powers = vec4(r, r2, r2 * r, r2 * r2);
    // Scale of F0 and of F90, of single scattering and of what the compensation adds over F0.
    let scale = 0.9529 + dot(powers, vec4(-0.0533, 0.7354, -2.7313, 1.5046));
    let offset = 0.0468 + dot(powers, vec4(0.0437, -0.4217, 0.5585, -0.2247));
    let more_scale = 0.0025 + dot(powers, vec4(0.4171, 1.0131, -1.2462, 0.3027));
    let more_offset = dot(powers, vec4(0.0386, -0.0516, 0.0, 0.0168));
    let f = f0(m);
    let grazing = f90(f);
    return f * scale + grazing * offset + f * (f * more_scale + grazing * more_offset);
}

fn diffuse_albedo(m: Material, c: f32) -> vec3<f32> {
    return diffuse_color(m) * burley(m.roughness, c);
}

// Both lobes together: what a bounce reflects of light from everywhere.
fn albedo_mean(m: Material) -> vec3<f32> {
    return min(diffuse_color(m) * burley_mean(m.roughness) + specular_albedo_mean(m), vec3(ALBEDO_MOST));
}

// Both lobes together: what a bounce reflects of light from a direction of cosine `c`.
fn albedo(m: Material, c: f32) -> vec3<f32> {
    return min(diffuse_albedo(m, c) + specular_albedo(m, c), vec3(ALBEDO_MOST));
}
