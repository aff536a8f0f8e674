// Cones through the opacity of a volume: the only door to it.
#define_import_path bevy_gi::scene::opacity::lookup

#import bevy_gi::scene::bindings::{opacity_cells, opacity_sampler, volume}

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

// How cones are marched.
struct March {
    // Length of a step, in widths of the cells.
    step: f32,
    // Height of the start above the surface, voxels.
    bias: f32,
    // Diameter at most, in heights above the start's plane.
    clearance: f32,
    // Part of a cone that a full cell stops over its own width; 1 is what it covers.
    density: f32,
    // Opacity from which on nothing more is seen.
    cutoff: f32,
}

// Where a cone is after `t` metres.
struct Station {
    // Whether that is inside of the volume.
    inside: bool,
    // 0..1 over the volume.
    uvw: vec3<f32>,
    // Whose cells are as wide as the cone: rounded, which takes half the reads of two blended levels.
    level: f32,
    // 1 at the start, 0 from a cell's width and a half on.
    near: f32,
    // Metres to the next one: a part of a cell of that level. What filtering gives two stations of a wall between them adds
    // up to one wall only if they are not farther apart than its cells are wide.
    stride: f32,
}

// Distance of a cone's first sample, metres: half a finest step, as nearer, edges show the cells of their other side.
fn first_station(cone: Cone, march: March) -> f32 {
    return 2.0 * volume.voxel * march.step * (0.25 + 0.5 * cone.jitter);
}

fn station(cone: Cone, march: March, t: f32) -> Station {
    let cell = 2.0 * volume.voxel;
    let extent = vec3<f32>(volume.dims) * volume.voxel;
    // A cell must not reach back behind the plane that the cone comes from.
    let height = t * dot(cone.dir, cone.normal) + march.bias * volume.voxel;
    let diameter = max(cell, min(2.0 * t * cone.tan_half, march.clearance * height));
    let uvw = (cone.origin + cone.dir * t - volume.origin) / extent;
    let outside = any(uvw < vec3(0.0)) || any(uvw > vec3(1.0));
    let level = round(min(log2(diameter / cell), f32(volume.levels - 1u)));
    return Station(!outside, uvw, level, saturate(1.5 - t / cell), march.step * cell * exp2(level));
}

// Weights of the directions of travel that make up `dir`, in a plane that the cone starts from (`near_normal`; 0:
// none) only those that leave it: what lies in it does not count.
fn direction_weights(dir: vec3<f32>, near_normal: vec3<f32>) -> vec3<f32> {
    let in_plane = select(vec3(0.0), near_normal * near_normal, dir * near_normal > vec3(0.0));
    return abs(dir) * (1.0 - in_plane);
}

// `uvw` kept half a cell away from the ends along z: filtering must not reach into another block of directions. (Not
// from `textureDimensions`: Mesa's software driver answers for the level of its first lane.)
fn inside_block(uvw: vec3<f32>, level: f32) -> vec3<f32> {
    let margin = exp2(level) / f32(volume.dims.z);
    return vec3(uvw.xy, clamp(uvw.z, margin, 1.0 - margin));
}

// Opacity of the cells at `uvw` for what travels along `dir`, whose three directions count by `weights`: a flat wall, opaque
// along its normal only, has the same optical depth at every angle then.
fn cell_opacity(uvw: vec3<f32>, dir: vec3<f32>, weights: vec3<f32>, level: f32) -> f32 {
    let at = inside_block(uvw, level);
    let positive = textureSampleLevel(opacity_cells, opacity_sampler, vec3(at.xy, 0.5 * at.z), level);
    let negative = textureSampleLevel(opacity_cells, opacity_sampler, vec3(at.xy, 0.5 + 0.5 * at.z), level);
    return dot(weights, select(positive.xyz, negative.xyz, dir < vec3(0.0)));
}

// How a cone has fared.
struct Passage {
    // Part of it that goes on.
    clear: f32,
    // Part that met a surface from its front.
    hit: f32,
}

// A cone meets cells of opacity `front`. Returns the part of it that they stop.
//
// Of two stations before and behind a wall, filtering gives each a part of the wall, and the two parts add up to one. So
// what cells stop is subtracted from what is left of the cone; as a product, two halves would let a quarter through.
fn meet(passage: ptr<function, Passage>, front: f32, cone: Cone, march: March, at: Station) -> f32 {
    let density = march.density * march.step;
    let stopped = min((*passage).clear, density * front);
    (*passage).hit += stopped;
    (*passage).clear -= stopped;
    // A surface is met from behind only inside of something: what got in through the front
    // without being stopped, since a wall is thin, is stopped there. Not behind an edge that the cone only grazed.
    if (*passage).hit > 0.5 {
        let back = cell_opacity(at.uvw, -cone.dir, abs(cone.dir), at.level);
        (*passage).clear -= min((*passage).clear, (*passage).hit * density * back);
    }
    if (*passage).clear < 1.0 - march.cutoff {
        (*passage).clear = 0.0;
    }
    return stopped;
}

// Part of a cone that nothing stops within the volume, 0..1. Of one that runs out of steps, nothing is known to get through.
fn transmittance(cone: Cone, march: March) -> f32 {
    var passage = Passage(1.0, 0.0);
    var t = first_station(cone, march);
    for (var i = 0u; i < cone.steps && passage.clear > 0.0; i++) {
        let at = station(cone, march, t);
        if !at.inside {
            return passage.clear;
        }
        let weights = direction_weights(cone.dir, cone.normal * at.near);
        meet(&passage, cell_opacity(at.uvw, cone.dir, weights, at.level), cone, march, at);
        t += at.stride;
    }
    return 0.0;
}
