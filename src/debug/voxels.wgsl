// The surfaces in voxels, and their means over larger cells.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_gi::debug::cubes::{
    Cubes, Fragment, VoxelView, begin_cubes, next_cube, paint_cube, paint_empty,
}
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::voxels::types::{
    BRICK_EMPTY, BRICK_MARKED, BRICK_VOXELS, Voxel, WORDS, brick_index, local_index, unpack_voxel,
}
#import bevy_gi::surface::view

@group(2) @binding(0) var<uniform> shown: VoxelView;
@group(2) @binding(1) var<storage, read> brick_map: array<u32>;
@group(2) @binding(2) var<storage, read> pool: array<u32>;

// The surface in a voxel.
fn voxel_at(voxel: vec3<u32>) -> Voxel {
    let slot = brick_map[brick_index(voxel, volume.dims)];
    var none: Voxel;
    if slot == BRICK_EMPTY || slot >= BRICK_MARKED {
        return none;
    }
    let at = ((slot - 1u) * BRICK_VOXELS + local_index(voxel)) * WORDS;
    return unpack_voxel(vec3(pool[at], pool[at + 1u], pool[at + 2u]));
}

// Mean of the surfaces in a cell; of large cells, of 512 voxels, among them some of each plane of voxels at
// right angles to an axis.
fn mean_voxel(cell: vec3<u32>, level: u32) -> Voxel {
    let width = 1u << level;
    let samples = min(width * width * width, 512u);
    var sum: Voxel;
    var count = 0.0;
    for (var i = 0u; i < samples; i++) {
        var at = vec3(i % width, (i / width) % width, i / (width * width));
        if width > 8u {
            at = vec3(i, 5u * i + i / width, 11u * i + i / width) % vec3(width);
        }
        let v = voxel_at(cell * width + at);
        if v.exists {
            sum.albedo += v.albedo;
            sum.normal += v.normal;
            sum.emission += v.emission;
            count += 1.0;
        }
    }
    sum.exists = count > 0.0;
    let scale = 1.0 / max(count, 1.0);
    sum.albedo *= scale;
    sum.emission *= scale;
    sum.normal = select(vec3(0.0), normalize(sum.normal), dot(sum.normal, sum.normal) > 0.0);
    return sum;
}

fn content(v: Voxel) -> vec3<f32> {
    switch shown.content {
        case #{VIEW_VOXEL_NORMAL}u: { return v.normal * 0.5 + 0.5; }
        case #{VIEW_VOXEL_EMISSION}u: { return v.emission * view.exposure; }
        default: { return v.albedo; }
    }
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> Fragment {
    let level = min(shown.level, volume.levels);
    var cubes = begin_cubes(in.position.xy, shown, level, volume, view);
    if !cubes.inside {
        discard;
    }
    while cubes.inside {
        let voxel = mean_voxel(vec3<u32>(cubes.cell), level);
        if voxel.exists {
            return paint_cube(cubes, content(voxel));
        }
        cubes = next_cube(cubes);
    }
    if !cubes.cut {
        discard;
    }
    return paint_empty(cubes);
}
