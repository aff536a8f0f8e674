// The only door to the hints: light at a point.
#define_import_path bevy_gi::technique::hints::lookup

#import bevy_gi::gpu::basis::orthonormal
#import bevy_gi::gpu::sh::{sh_cosine, sh_lobe}
#import bevy_gi::scene::probes::bindings::{probe_sampler, probes}
#import bevy_gi::scene::probes::lookup::{probe_corner, probes_around}
#import bevy_gi::technique::hints::bindings::{coefficients, hints}
#import bevy_gi::technique::hints::guess::tap_offset

// Coefficients at a hint, of red, green and blue.
struct Coefficients {
    low: array<vec4<f32>, 3>,
    high: array<vec4<f32>, 3>,
    last: vec3<f32>,
}

struct HintLight {
    // `E / pi`, nits.
    diffuse: vec3<f32>,
    // Nits.
    specular: vec3<f32>,
}

fn distance_block() -> u32 {
    return select(3u, 7u, hints.coefficients > 4u);
}

fn load_block(probe: vec3<u32>, block: u32) -> vec4<f32> {
    return textureLoad(coefficients, vec3(probe.xy, probe.z + block * probes.dims.z), 0);
}

fn load_hint(probe: vec3<u32>) -> Coefficients {
    var c: Coefficients;
    c.low = array(load_block(probe, 0u), load_block(probe, 1u), load_block(probe, 2u));
    if hints.coefficients > 4u {
        c.high = array(load_block(probe, 3u), load_block(probe, 4u), load_block(probe, 5u));
        c.last = load_block(probe, 6u).rgb;
    }
    return c;
}

// Light weighted by the coefficients of a lobe: nits; below zero where few bands ring.
fn weigh_signed(c: Coefficients, l: array<f32, 9>) -> vec3<f32> {
    let low = vec4(l[0], l[1], l[2], l[3]);
    let high = vec4(l[4], l[5], l[6], l[7]);
    let light = vec3(dot(c.low[0], low), dot(c.low[1], low), dot(c.low[2], low))
        + vec3(dot(c.high[0], high), dot(c.high[1], high), dot(c.high[2], high))
        + c.last * l[8];
    return light * hints.unit;
}

// The same, not negative.
fn weigh(c: Coefficients, l: array<f32, 9>) -> vec3<f32> {
    return max(weigh_signed(c, l), vec3(0.0));
}

// A point in the texture's first block, 0..1 each.
fn hint_point(p: vec3<f32>) -> vec3<f32> {
    return (p - probes.origin) / (vec3<f32>(probes.dims) * probes.cell);
}

// A block, interpolated.
fn sample_block(point: vec3<f32>, block: u32) -> vec4<f32> {
    let blocks = f32(distance_block() + 2u);
    // Half a texel: filtering must not reach into the next block.
    let margin = 0.5 / f32(probes.dims.z);
    let z = (f32(block) + clamp(point.z, margin, 1.0 - margin)) / blocks;
    return textureSampleLevel(coefficients, probe_sampler, vec3(point.xy, z), 0.0);
}

// The hints around a point, interpolated whatever they see.
fn sample_hint(point: vec3<f32>) -> Coefficients {
    var c: Coefficients;
    c.low = array(sample_block(point, 0u), sample_block(point, 1u), sample_block(point, 2u));
    if hints.coefficients > 4u {
        c.high = array(sample_block(point, 3u), sample_block(point, 4u), sample_block(point, 5u));
        c.last = sample_block(point, 6u).rgb;
    }
    return c;
}

// Distances of the nearest and the farthest of what lights the hints around a point, over the reach.
fn sample_distances(point: vec3<f32>) -> vec2<f32> {
    return sample_block(point, distance_block()).xy;
}

// Mean albedo of the surfaces around a point.
fn sample_albedo(point: vec3<f32>) -> vec3<f32> {
    return sample_block(point, distance_block() + 1u).rgb;
}

// Tap `i` over a surface.
fn tap(p: vec3<f32>, n: vec3<f32>, i: u32) -> vec3<f32> {
    return p + hints.tap_distance * (orthonormal(n) * tap_offset(i, hints.taps, hints.ring_cos));
}

// Light at the taps, weighted by a lobe.
fn tapped_light(p: vec3<f32>, n: vec3<f32>, lobe: array<f32, 9>) -> vec3<f32> {
    var sum = vec3(0.0);
    for (var i = 0u; i < hints.taps; i++) {
        sum += weigh(sample_hint(hint_point(tap(p, n, i))), lobe);
    }
    return sum / f32(hints.taps);
}

// `E / pi` on a surface that faces `n`, nits.
fn diffuse_light(p: vec3<f32>, n: vec3<f32>) -> vec3<f32> {
    let lobe = sh_cosine(n);
    if hints.reconstruction == #{RECONSTRUCT_TAPS}u {
        return tapped_light(p, n, lobe);
    }
    let around = probes_around(p, n);
    var sum = vec4(0.0);
    for (var i = 0u; i < 8u; i++) {
        let corner = probe_corner(around, i);
        if corner.weight > 0.0 {
            sum += corner.weight * vec4(weigh(load_hint(corner.probe), lobe), 1.0);
        }
    }
    return sum.rgb / max(sum.a, 1e-12);
}

// The same, and the radiance along `dir` averaged over the lobe of a surface of perceptual roughness
// `roughness`: a lobe of `cos^s` has a share of about `exp(-l^2 / 2s)` of band l, and one of GGX has
// `s = 2 / alpha^2`.
fn all_light(p: vec3<f32>, n: vec3<f32>, dir: vec3<f32>, roughness: f32) -> HintLight {
    let cosine = sh_cosine(n);
    let alpha = roughness * roughness;
    let x = 0.25 * alpha * alpha;
    let glossy = sh_lobe(dir, vec3(1.0, exp(-x), exp(-4.0 * x)));
    var light: HintLight;
    if hints.reconstruction == #{RECONSTRUCT_TAPS}u {
        light.diffuse = tapped_light(p, n, cosine);
        light.specular = tapped_light(p, n, glossy);
        return light;
    }
    let around = probes_around(p, n);
    var total = 1e-12;
    for (var i = 0u; i < 8u; i++) {
        let corner = probe_corner(around, i);
        if corner.weight > 0.0 {
            let c = load_hint(corner.probe);
            light.diffuse += corner.weight * weigh(c, cosine);
            light.specular += corner.weight * weigh(c, glossy);
            total += corner.weight;
        }
    }
    light.diffuse /= total;
    light.specular /= total;
    return light;
}
