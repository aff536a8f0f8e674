// Fragment shader of the voxelizer: sums a surface's attributes into the voxel it lies in.

#import bevy_pbr::{
    pbr_fragment::pbr_input_from_standard_material,
    pbr_functions::alpha_discard,
    pbr_types::{STANDARD_MATERIAL_FLAGS_DOUBLE_SIDED_BIT, STANDARD_MATERIAL_FLAGS_UNLIT_BIT},
    prepass_io::VertexOutput,
}
#import bevy_gi::scene::voxels::types::{
    BRICK_EMPTY, BRICK_MARKED, BRICK_VOXELS, Voxelize, WORDS, brick_index, local_index,
}

@group(1) @binding(0) var<uniform> voxelize: Voxelize;
@group(1) @binding(1) var<storage, read_write> brick_map: array<atomic<u32>>;
@group(1) @binding(2) var<storage, read_write> pool: array<atomic<u32>>;

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) {
    // Derivatives and textures first, while control flow is uniform.
    let geometric = cross(dpdx(in.world_position.xyz), dpdy(in.world_position.xyz));
    let pbr = pbr_input_from_standard_material(in, is_front);
    let base_color = alpha_discard(pbr.material, pbr.material.base_color);

    let len = length(geometric);
    if !(len > 0.0) {
        return;
    }
    var n = geometric / len;
    // See the module's docs: less than 60 degrees to the view's axis.
    if abs(n[voxelize.axis]) < 0.5 {
        return;
    }
#ifdef VERTEX_NORMALS
    n = select(n, -n, dot(n, in.world_normal) < 0.0);
#else
    // The view stands on the positive side of its axis: what it sees from the front faces there.
    n = select(n, -n, (n[voxelize.axis] > 0.0) != is_front);
#endif

    let volume = voxelize.volume;
    let p = (in.world_position.xyz - volume.origin) / volume.voxel;
    if !(all(p >= vec3(0.0)) && all(p < vec3<f32>(volume.dims))) {
        return;
    }
    let voxel = vec3<u32>(p);
    let brick = brick_index(voxel, volume.dims);
    if voxelize.step == #{STEP_MARK}u {
        atomicStore(&brick_map[brick], BRICK_MARKED);
        return;
    }
    let slot = atomicLoad(&brick_map[brick]);
    if slot == BRICK_EMPTY || slot == BRICK_MARKED {
        return;
    }
    let at = ((slot - 1u) * BRICK_VOXELS + local_index(voxel)) * WORDS;

    let unlit = (pbr.material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) != 0u;
    let double_sided = (pbr.material.flags & STANDARD_MATERIAL_FLAGS_DOUBLE_SIDED_BIT) != 0u;
    var albedo = saturate(base_color.rgb);
    var emission = max(pbr.material.emissive.rgb, vec3(0.0))
        * mix(voxelize.emission.x, voxelize.emission.y, pbr.material.emissive.a);
    if unlit {
        albedo = vec3(0.0);
        emission = saturate(base_color.rgb) * voxelize.emission.z;
    }

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
    // Low half: samples that face the positive way; high half: the negative way.
    var sides = select(1u, 1u << 16u, negative);
    var samples = 1u;
    if double_sided {
        // One sample on each side.
        sides = 1u | (1u << 16u);
        samples = 2u;
    }

    let color = samples * vec3<u32>(round(albedo * 65535.0));
    atomicAdd(&pool[at + 0u], color.r);
    atomicAdd(&pool[at + 1u], color.g);
    atomicAdd(&pool[at + 2u], color.b);
    atomicAdd(&pool[at + 3u + dominant], sides);
    atomicAdd(&pool[at + 6u], bitcast<u32>(axis.x));
    atomicAdd(&pool[at + 7u], bitcast<u32>(axis.y));
    atomicAdd(&pool[at + 8u], bitcast<u32>(axis.z));
    if any(emission > vec3(0.0)) {
        let e = samples * vec3<u32>(round(min(emission * voxelize.emission.w, vec3(65535.0))));
        atomicAdd(&pool[at + 9u], e.r);
        atomicAdd(&pool[at + 10u], e.g);
        atomicAdd(&pool[at + 11u], e.b);
    }
}
