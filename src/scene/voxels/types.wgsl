// The sparse voxel grid: addressing, and the record of a voxel. Twin of types.rs.
#define_import_path bevy_gi::scene::voxels::types

#import bevy_gi::gpu::pack::{
    EXPONENT_LEAST, RADIANCE_MOST, exponent_of, power_of_two, unpack_color, unpack_normal, unpack_radiance,
}
#import bevy_gi::scene::types::Volume

const WORDS: u32 = #{WORDS}u;
const BRICK: u32 = #{BRICK}u;
const BRICK_VOXELS: u32 = #{BRICK_VOXELS}u;
const SLICES: u32 = #{SLICES}u;

// Content of the brick map besides "slot + 1": nothing, and, while bricks are marked, from this number on, the number
// plus the level of the brick's emission.
const BRICK_EMPTY: u32 = 0u;
const BRICK_MARKED: u32 = 0xffffff00u;

const FLAG_SURFACE: u32 = 1u;
const FLAG_TWO_SIDED: u32 = 2u;
// From this bit on, six: whether there are faces that look mostly along +x, +y, +z, -x, -y, -z.
const FLAG_FACES: u32 = 2u;

struct Voxelize {
    volume: Volume,
    axis: u32,
    step: u32,
    emission: vec3<f32>,
}

// A voxel's surface.
struct Voxel {
    albedo: vec3<f32>,
    // Of the front; the back of a two-sided voxel looks the other way.
    normal: vec3<f32>,
    // Nits.
    emission: vec3<f32>,
    exists: bool,
    two_sided: bool,
    // See FLAG_FACES.
    faces: u32,
}

fn unpack_voxel(words: vec3<u32>) -> Voxel {
    let flags = words.y >> 24u;
    var v: Voxel;
    v.albedo = unpack_color(words.x);
    v.normal = unpack_normal(words.y);
    v.emission = unpack_radiance(words.z);
    v.exists = (flags & FLAG_SURFACE) != 0u;
    v.two_sided = (flags & FLAG_TWO_SIDED) != 0u;
    v.faces = flags >> FLAG_FACES;
    return v;
}

// Whether a ray along `dir` meets a voxel from behind. The normal of an edge is the mean of its faces', and what passes
// over one of them may have that mean in its back: there, a single face that looks at the ray is met from its front.
fn met_from_behind(v: Voxel, dir: vec3<f32>) -> bool {
    let looks_back = select(vec3(8u, 16u, 32u), vec3(1u, 2u, 4u), dir < vec3(0.0));
    let meets_face = any((vec3(v.faces) & looks_back) != vec3(0u));
    let is_edge = countOneBits(v.faces) > 1u && !v.two_sided;
    return dot(v.normal, dir) > 0.0 && !(is_edge && meets_face);
}

// The level of an emission in nits: 0 of none, else its exponent, counted from 1. Of a brick: of its brightest.
fn emission_level(nits: vec3<f32>) -> u32 {
    let most = clamp(max(nits.r, max(nits.g, nits.b)), 0.0, RADIANCE_MOST);
    return u32(max(exponent_of(most) - EXPONENT_LEAST + 1, 0));
}

// Nits that no emission of that level reaches.
fn emission_bound(level: u32) -> f32 {
    return power_of_two(i32(level) + EXPONENT_LEAST);
}

// Nits of a unit of the sums of emission in a brick of that level.
fn emission_unit(level: u32) -> f32 {
    return emission_bound(level) * power_of_two(-#{EMISSION_BITS});
}

// Index of the brick that holds `voxel`.
fn brick_index(voxel: vec3<u32>, dims: vec3<u32>) -> u32 {
    let b = voxel / BRICK;
    let n = dims / BRICK;
    return (b.z * n.y + b.y) * n.x + b.x;
}

// Coordinates of a brick from its index.
fn brick_coords(index: u32, dims: vec3<u32>) -> vec3<u32> {
    let n = dims / BRICK;
    return vec3(index % n.x, (index / n.x) % n.y, index / (n.x * n.y));
}

// Index of `voxel` in its brick.
fn local_index(voxel: vec3<u32>) -> u32 {
    let l = voxel % BRICK;
    return (l.z * BRICK + l.y) * BRICK + l.x;
}

// Coordinates in the brick from the index in it.
fn local_coords(index: u32) -> vec3<u32> {
    return vec3(index % BRICK, (index / BRICK) % BRICK, index / (BRICK * BRICK));
}

// The slice that a brick belongs to.
fn brick_slice(brick: vec3<u32>) -> u32 {
    let p = brick & vec3(1u);
    return p.x | (p.y << 1u) | (p.z << 2u);
}

// Centre of a voxel, metres.
fn voxel_center(voxel: vec3<u32>, volume: Volume) -> vec3<f32> {
    return volume.origin + (vec3<f32>(voxel) + 0.5) * volume.voxel;
}
