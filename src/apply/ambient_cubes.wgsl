// The ambient cubes of an export as spheres.

#import bevy_gi::debug::types::Shape

struct AmbientCubes {
    // Corner of the grid of cubes, metres.
    origin: vec3<f32>,
    radius: f32,
    // Distance of cubes along each axis, metres.
    spacing: vec3<f32>,
    // Nits that are 1 in the ambient cubes.
    unit: f32,
    // Cubes along each axis.
    dims: vec3<u32>,
}

@group(0) @binding(0) var<uniform> grid: AmbientCubes;
@group(0) @binding(1) var ambient_cubes: texture_3d<f32>;
@group(0) @binding(2) var<storage, read_write> shapes: array<Shape>;

@compute @workgroup_size(4, 4, 4)
fn show_ambient_cubes(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id >= grid.dims) {
        return;
    }
    var shape: Shape;
    shape.center = grid.origin + (vec3<f32>(id) + 0.5) * grid.spacing;
    shape.radius = grid.radius;
    for (var i = 0u; i < 6u; i++) {
        // As `apply/export.wgsl` stores them.
        let block = vec3(0u, i % 2u, i / 2u);
        let light = textureLoad(ambient_cubes, vec3<i32>(id + block * grid.dims), 0);
        shape.sides[i] = vec4(light.rgb * grid.unit, 1.0);
    }
    shapes[(id.z * grid.dims.y + id.y) * grid.dims.x + id.x] = shape;
}
