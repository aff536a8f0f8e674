// Sums a surface's attributes into the voxel it lies in. What a voxelizing fragment shader calls.
#define_import_path bevy_gi::scene::voxels::splat

#import bevy_pbr::{
    mesh_bindings::mesh,
    mesh_types::MESH_FLAGS_SIGN_DETERMINANT_MODEL_3X3_BIT,
    prepass_io::VertexOutput,
}
#import bevy_gi::scene::voxels::types::{
    BRICK_EMPTY, BRICK_MARKED, BRICK_VOXELS, Voxelize, WORDS, brick_index, emission_level, emission_unit,
    local_index,
}

@group(1) @binding(0) var<uniform> voxelize: Voxelize;
@group(1) @binding(1) var<storage, read_write> brick_map: array<atomic<u32>>;
@group(1) @binding(2) var<storage, read_write> pool: array<atomic<u32>>;
// Of each slot.
@group(1) @binding(3) var<storage, read> emission_levels: array<u32>;

// What is to be known of a surface.
struct VoxelSurface {
    // Part of light from everywhere that is reflected, diffuse and specular together. 0..1.
    albedo: vec3<f32>,
    // Nits.
    emission: vec3<f32>,
    // Whether both its sides are lit and seen.
    double_sided: bool,
}

// Nits of a material's emission: colour, and `emissive_exposure_weight` in alpha.
fn emission_nits(emissive: vec4<f32>) -> vec3<f32> {
    return max(emissive.rgb, vec3(0.0)) * mix(voxelize.emission.x, voxelize.emission.y, emissive.a);
}

// Nits of an unlit colour.
fn unlit_nits(color: vec3<f32>) -> vec3<f32> {
    return saturate(color) * voxelize.emission.z;
}

// Normal of the triangle, not normalized. Call it first, while control flow is uniform.
fn triangle_normal(in: VertexOutput) -> vec3<f32> {
    return cross(dpdx(in.world_position.xyz), dpdy(in.world_position.xyz));
}

// Whether the unit normal `n` of a triangle points to the side that is its front: that of its vertices'
// normals, or of its winding where they say nothing. They may be missing, zero, NaN, or along the surface.
fn faces_front(in: VertexOutput, is_front: bool, n: vec3<f32>) -> bool {
#ifdef VERTEX_NORMALS
    let cosine = dot(n, in.world_normal);
    // Half a degree off the surface.
    if abs(cosine) > 0.01 * length(in.world_normal) {
        return cosine > 0.0;
    }
#endif
    // The view stands on the positive side of its axis: what it sees from the front faces there. A mirrored
    // mesh winds the other way round.
    let flags = mesh[in.instance_index].flags;
    let is_mirrored = (flags & MESH_FLAGS_SIGN_DETERMINANT_MODEL_3X3_BIT) == 0u;
    return (n[voxelize.axis] > 0.0) == (is_front != is_mirrored);
}

fn splat(in: VertexOutput, is_front: bool, geometric: vec3<f32>, surface: VoxelSurface) {
    let len = length(geometric);
    if !(len > 0.0) {
        return;
    }
    var n = geometric / len;
    // See the module's docs: less than 60 degrees to the view's axis.
    if !(abs(n[voxelize.axis]) >= 0.5) {
        return;
    }
    n = select(-n, n, faces_front(in, is_front, n));

    let volume = voxelize.volume;
    let p = (in.world_position.xyz - volume.origin) / volume.voxel;
    if !(all(p >= vec3(0.0)) && all(p < vec3<f32>(volume.dims))) {
        return;
    }
    let voxel = vec3<u32>(p);
    let brick = brick_index(voxel, volume.dims);
    if voxelize.step == #{STEP_MARK}u {
        atomicMax(&brick_map[brick], BRICK_MARKED + emission_level(surface.emission));
        return;
    }
    let slot = atomicLoad(&brick_map[brick]);
    if slot == BRICK_EMPTY || slot >= BRICK_MARKED {
        return;
    }
    let at = ((slot - 1u) * BRICK_VOXELS + local_index(voxel)) * WORDS;

    // Opposite sides of a wall share one axis and differ in sign: the axis' largest component is
    // made positive, and the sign is counted apart, for each such component.
    var dominant = 0u;
    let a = abs(n);
    if a.y > a.x && a.y >= a.z {
        dominant = 1u;
    } else if a.z > a.x {
        dominant = 2u;
    }
    let negative = n[dominant] < 0.0;
    let axis = vec3<i32>(round(select(n, -n, negative) * 1024.0));
    // Counts of samples that face the positive and the negative way, a word each, 10 bits an axis:
    // 4 samples a surface from each of 3 views, so that 85 surfaces fit into a voxel.
    let one = 1u << (10u * dominant);
    let positives = select(one, 0u, negative && !surface.double_sided);
    let negatives = select(0u, one, negative || surface.double_sided);
    // A double-sided surface is one on each side.
    let samples = select(1u, 2u, surface.double_sided);

    let color = samples * vec3<u32>(round(surface.albedo * 65535.0));
    atomicAdd(&pool[at + 0u], color.r);
    atomicAdd(&pool[at + 1u], color.g);
    atomicAdd(&pool[at + 2u], color.b);
    atomicAdd(&pool[at + 3u], positives);
    atomicAdd(&pool[at + 4u], negatives);
    atomicAdd(&pool[at + 5u], bitcast<u32>(axis.x));
    atomicAdd(&pool[at + 6u], bitcast<u32>(axis.y));
    atomicAdd(&pool[at + 7u], bitcast<u32>(axis.z));
    let level = emission_levels[slot - 1u];
    if level > 0u && any(surface.emission > vec3(0.0)) {
        let units = min(surface.emission / emission_unit(level), vec3(exp2(#{EMISSION_BITS}.0) - 1.0));
        let e = samples * vec3<u32>(round(units));
        atomicAdd(&pool[at + 8u], e.r);
        atomicAdd(&pool[at + 9u], e.g);
        atomicAdd(&pool[at + 10u], e.b);
    }
}
