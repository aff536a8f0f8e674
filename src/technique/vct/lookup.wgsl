// The only door to the radiance cache: cones through it.
#define_import_path bevy_gi::technique::vct::lookup

#import bevy_gi::gpu::basis::{hemisphere_spiral, orthonormal}
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::opacity::lookup::{
    Cone, March, Passage, Station, direction_weights, first_station, inside_block, meet, station,
}
#import bevy_gi::scene::world::sky::sky_radiance
#import bevy_gi::technique::vct::bindings::{cell_sampler, cells, cones}
#import bevy_render::maths::HALF_PI


fn march() -> March {
    return March(cones.step, cones.bias, cones.clearance, cones.density, cones.opacity_cutoff);
}

// Radiance (in units of the cells, premultiplied) and opacity of the cells that a cone meets, as sums over the three
// directions of travel that make up its own.
fn sample_cells(cone: Cone, at: Station) -> vec4<f32> {
    let uvw = inside_block(at.uvw, at.level);
    let weights = direction_weights(cone.dir, cone.normal * at.near);
    let block = vec3(0.0, 2.0, 4.0) + select(vec3(0.0), vec3(1.0), cone.dir < vec3(0.0));
    var sum = vec4(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let texel = vec3(uvw.xy, (block[axis] + uvw.z) / #{DIRECTIONS}.0);
        sum += weights[axis] * textureSampleLevel(cells, cell_sampler, texel, at.level);
    }
    return sum;
}

// Radiance that arrives at the cone's origin from the scene (nits, premultiplied), and how much of
// the cone is blocked.
fn trace_cone(cone: Cone) -> vec4<f32> {
    let march = march();
    var passage = Passage(1.0, 0.0);
    var light = vec3(0.0);
    var open = 0.0;
    var t = first_station(cone, march);
    for (var i = 0u; i < cone.steps && passage.clear > 0.0; i++) {
        let at = station(cone, march, t);
        if !at.inside {
            open = passage.clear;
            break;
        }
        let met = sample_cells(cone, at);
        let stopped = meet(&passage, met.a, cone, march, at);
        if stopped > 0.0 {
            light += stopped * met.rgb / met.a;
        }
        t += at.stride;
    }
    // All that does not leave the volume looks like what was met from its front; so does what runs out of steps.
    let blocked = 1.0 - open;
    return vec4(light * cones.unit * blocked / max(passage.hit, 1e-4), blocked);
}

// Direction of diffuse cone `i` of `count` around +z, turned by `turn` in 0..1.
fn cone_direction(i: u32, count: u32, turn: f32) -> vec3<f32> {
    if cones.arrangement == #{LAYOUT_FREED}u && count == 5u {
        // Freed 2018, section 4.5.2: one along the normal, four tilted by 45 degrees.
        if i == 0u {
            return vec3(0.0, 0.0, 1.0);
        }
        let phi = f32(i - 1u) * HALF_PI;
        return vec3(cos(phi), sin(phi), 1.0) * 0.70710678;
    }
    return hemisphere_spiral(i, count, turn);
}

struct Diffuse {
    // E / pi, nits.
    radiance: vec3<f32>,
    // Part of the hemisphere, cosine weighted, through which the sky is seen.
    sky: f32,
}

// Irradiance over pi at `p` on a surface facing `n`. Light from the sky counts if `with_sky`.
fn diffuse_cones(p: vec3<f32>, n: vec3<f32>, count: u32, turn: f32, jitter: f32, with_sky: bool) -> Diffuse {
    let basis = orthonormal(n);
    let origin = p + n * cones.bias * volume.voxel;
    var sum = vec3(0.0);
    var open = 0.0;
    for (var i = 0u; i < count; i++) {
        let dir = basis * cone_direction(i, count, turn);
        let hit = trace_cone(Cone(origin, dir, cones.tan_half, n, cones.diffuse_steps, jitter));
        sum += hit.rgb;
        open += 1.0 - hit.a;
        if with_sky && hit.a < 0.999 {
            sum += (1.0 - hit.a) * sky_radiance(dir, cones.tan_half);
        }
    }
    return Diffuse(sum / f32(count), open / f32(count));
}

// Radiance along `dir`, averaged over the lobe of a surface of perceptual roughness `roughness`.
fn specular_cone(p: vec3<f32>, n: vec3<f32>, dir: vec3<f32>, roughness: f32, jitter: f32, with_sky: bool) -> vec3<f32> {
    // Half of a GGX lobe lies within tan(theta) = alpha = roughness^2.
    let tan_half = clamp(cones.specular_scale * roughness * roughness, 0.02, 1.0);
    let origin = p + n * cones.bias * volume.voxel;
    let hit = trace_cone(Cone(origin, dir, tan_half, n, cones.specular_steps, jitter));
    if with_sky {
        return hit.rgb + (1.0 - hit.a) * sky_radiance(dir, tan_half);
    }
    return hit.rgb;
}
