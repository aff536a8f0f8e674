// Cells of the radiance cache: what they send to the viewer, and how opaque they are.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_gi::debug::cubes::{
    Cubes, Fragment, VoxelView, begin_cubes, next_cube, paint_cube, paint_empty,
}
#import bevy_gi::scene::bindings::volume
#import bevy_gi::surface::view
#import bevy_gi::technique::vct::bindings::{cells, cones}

@group(3) @binding(0) var<uniform> shown: VoxelView;

// Premultiplied radiance and opacity of a cell of level 1 or more, for light that travels along `axis`,
// in its negative direction if `negative`.
fn load_cell(cell: vec3<u32>, level: u32, axis: u32, negative: bool) -> vec4<f32> {
    let block = 2u * axis + select(0u, 1u, negative);
    let layers = volume.dims.z >> level;
    let at = vec3<i32>(vec3(cell.xy, cell.z + block * layers));
    return textureLoad(cells, at, i32(level) - 1);
}

fn occupied(cell: vec3<u32>, level: u32) -> bool {
    var opacity = 0.0;
    for (var i = 0u; i < 6u; i++) {
        opacity += load_cell(cell, level, i / 2u, (i & 1u) != 0u).a;
    }
    return opacity > 0.0;
}

fn content(cubes: Cubes) -> vec3<f32> {
    let value = load_cell(vec3<u32>(cubes.cell), cubes.level, cubes.axis, cubes.negative);
    if shown.content == #{SHOW_OPACITY}u {
        return vec3(value.a);
    }
    return value.rgb / max(value.a, 1e-4) * cones.unit * view.exposure;
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> Fragment {
    // The finest cells are two voxels wide.
    let level = clamp(shown.level, 1u, volume.levels);
    var cubes = begin_cubes(in.position.xy, shown, level, volume, view);
    if !cubes.inside {
        discard;
    }
    while cubes.inside {
        if occupied(vec3<u32>(cubes.cell), level) {
            return paint_cube(cubes, content(cubes));
        }
        cubes = next_cube(cubes);
    }
    if !cubes.cut {
        discard;
    }
    return paint_empty(cubes);
}
