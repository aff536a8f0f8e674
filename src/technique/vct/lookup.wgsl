// The only door to the radiance cache: cones through it.
#define_import_path bevy_gi::technique::vct::lookup

#import bevy_gi::gpu::basis::orthonormal
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::sky::sky_radiance
#import bevy_gi::technique::vct::bindings::{cell_sampler, cells, cones}
#import bevy_render::maths::{HALF_PI, PI_2}

const GOLDEN_ANGLE: f32 = 2.39996323;

struct Cone {
    origin: vec3<f32>,
    // Unit vector.
    dir: vec3<f32>,
    tan_half: f32,
    // Normal of the surface it starts from.
    normal: vec3<f32>,
    steps: u32,
    // 0..1, shifts all samples by that part of the first step.
    jitter: f32,
}

// Radiance (in units of the cells, premultiplied) and opacity of a cell at `uvw` as met in direction `dir`. The
// three directions of travel that make up `dir` count by its components: a flat wall, opaque along
// its normal only, then has the same optical depth at every angle. `near_normal` suppresses what
// lies in the plane the cone starts from.
fn sample_cell(uvw: vec3<f32>, dir: vec3<f32>, level: f32, near_normal: vec3<f32>) -> vec4<f32> {
    // Half a cell: filtering must not reach into the next direction's block. (Not from
    // `textureDimensions`: Mesa's software driver answers for the level of its first lane.)
    let margin = exp2(level) / f32(volume.dims.z);
    let z = clamp(uvw.z, margin, 1.0 - margin);
    let facing = select(vec3(0.0), near_normal * near_normal, dir * near_normal > vec3(0.0));
    return sample_blocks(vec3(uvw.xy, z), dir, abs(dir) * (1.0 - facing), level);
}

// Opacity of a cell for what goes the other way: of surfaces that `dir` meets from behind.
fn sample_backs(uvw: vec3<f32>, dir: vec3<f32>, level: f32) -> f32 {
    let margin = exp2(level) / f32(volume.dims.z);
    let z = clamp(uvw.z, margin, 1.0 - margin);
    return sample_blocks(vec3(uvw.xy, z), -dir, abs(dir), level).a;
}

// Weighted sum of the cells at `uvw` for the three directions of travel that make up `dir`.
fn sample_blocks(uvw: vec3<f32>, dir: vec3<f32>, weight: vec3<f32>, level: f32) -> vec4<f32> {
    let block = vec3(0.0, 2.0, 4.0) + select(vec3(0.0), vec3(1.0), dir < vec3(0.0));
    var sum = vec4(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let at = vec3(uvw.xy, (block[axis] + uvw.z) / #{DIRECTIONS}.0);
        sum += weight[axis] * textureSampleLevel(cells, cell_sampler, at, level);
    }
    return sum;
}

// Radiance that arrives at the cone's origin from the scene (nits, premultiplied), and how much of
// the cone is blocked.
fn trace_cone(cone: Cone) -> vec4<f32> {
    let cell = 2.0 * volume.voxel;
    let extent = vec3<f32>(volume.dims) * volume.voxel;
    let top = f32(volume.levels - 1u);
    var light = vec3(0.0);
    var clear = 1.0;
    // Part of the cone that met a surface from its front.
    var hit = 0.0;
    // The first sample lies half a finest step away: nearer, edges show the cells of their other side.
    var t = cell * cones.step * (0.25 + 0.5 * cone.jitter);
    for (var i = 0u; i < cone.steps; i++) {
        // A cell must not reach back behind the plane that the cone comes from.
        let height = t * dot(cone.dir, cone.normal) + cones.bias * volume.voxel;
        let diameter = max(cell, min(2.0 * t * cone.tan_half, cones.clearance * height));
        let uvw = (cone.origin + cone.dir * t - volume.origin) / extent;
        if any(uvw < vec3(0.0)) || any(uvw > vec3(1.0)) {
            break;
        }
        // One level, rounded: half the reads of two blended ones.
        let level = round(min(log2(diameter / cell), top));
        let near = saturate(1.5 - t / cell);
        let s = sample_cell(uvw, cone.dir, level, cone.normal * near);
        let stride = diameter * cones.step;
        if s.a > 1e-4 {
            let a = step_opacity(s.a, level);
            light += clear * a * s.rgb / s.a;
            hit += clear * a;
            clear *= 1.0 - a;
        }
        // A surface is met from behind only inside of something: what got in through the front
        // without being stopped, since a wall is thin, is stopped there.
        if hit > 0.02 {
            clear *= 1.0 - hit * step_opacity(sample_backs(uvw, cone.dir, level), level);
        }
        if clear < 1.0 - cones.opacity_cutoff {
            clear = 0.0;
            break;
        }
        t += stride;
    }
    // All that is blocked looks like what was met from its front.
    let blocked = 1.0 - clear;
    return vec4(light * cones.unit * blocked / max(hit, 1e-4), blocked);
}

// Opacity of a whole cell, brought to the length of a step.
fn step_opacity(cell: f32, level: f32) -> f32 {
    let density = select(cones.density, cones.finest_density, level < 0.5);
    return 1.0 - pow(1.0 - clamp(cell, 0.0, 0.999), cones.step * density);
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
    // A Vogel spiral on the disk, lifted to the hemisphere: cosine-distributed.
    let r2 = (f32(i) + 0.5) / f32(count);
    let phi = GOLDEN_ANGLE * f32(i) + PI_2 * turn;
    return vec3(sqrt(r2) * vec2(cos(phi), sin(phi)), sqrt(1.0 - r2));
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
