// From cell to cell of a volume along the ray through a pixel, for views that show cells as cubes, or in a cut.
#define_import_path bevy_gi::debug::cubes

#import bevy_gi::scene::types::Volume
#import bevy_render::view::{View, uv_to_ndc}

// Twin of voxels.rs.
struct VoxelView {
    // A GiView.
    content: u32,
    // Cells of level l are 2^l voxels wide.
    level: u32,
    // A GiSlice.
    slice: u32,
    // 0..1, from one side of the volume to the other.
    slice_at: f32,
}

struct Cubes {
    // False: the ray has left the volume, or never meets it.
    inside: bool,
    cell: vec3<i32>,
    level: u32,
    // The face through which the cell was entered is at right angles to this axis.
    axis: u32,
    // Whether the ray runs along the axis in its negative direction.
    negative: bool,
    // There is one cell, in a cut.
    cut: bool,
    // Where the cell was entered, metres from the near plane.
    t: f32,
    // Where it enters the next cell along each axis.
    next: vec3<f32>,
    // Relative to the corner of the volume.
    eye: vec3<f32>,
    dir: vec3<f32>,
    // Of a cell.
    size: f32,
    dims: vec3<i32>,
}

struct Fragment {
    @location(0) color: vec4<f32>,
    // Larger is nearer.
    @builtin(frag_depth) depth: f32,
}

// The first cell that the ray through a point of the target meets.
fn begin_cubes(position: vec2<f32>, shown: VoxelView, level: u32, volume: Volume, view: View) -> Cubes {
    var c: Cubes;
    c.level = level;
    c.size = volume.voxel * f32(1u << level);
    c.dims = vec3<i32>(volume.dims >> vec3(level));
    let extent = vec3<f32>(volume.dims) * volume.voxel;

    let uv = (position - view.viewport.xy) / view.viewport.zw;
    let ndc = uv_to_ndc(uv);
    // Reverse-Z: 1 is the near plane.
    let near = view.world_from_clip * vec4(ndc, 1.0, 1.0);
    let far = view.world_from_clip * vec4(ndc, 0.5, 1.0);
    c.eye = near.xyz / near.w - volume.origin;
    let dir = normalize(far.xyz / far.w - near.xyz / near.w);
    // No component is quite 0.
    c.dir = select(dir, vec3(1e-6), abs(dir) < vec3(1e-6));

    if shown.slice != 0u {
        c.cut = true;
        c.axis = shown.slice - 1u;
        c.negative = c.dir[c.axis] < 0.0;
        c.t = (shown.slice_at * extent[c.axis] - c.eye[c.axis]) / c.dir[c.axis];
        var at = (c.eye + c.t * c.dir) / c.size;
        // The last cell, at the very end.
        at[c.axis] = min(at[c.axis], f32(c.dims[c.axis]) - 0.5);
        c.cell = vec3<i32>(floor(at));
        c.inside = c.t >= 0.0 && all(c.cell >= vec3(0)) && all(c.cell < c.dims);
        return c;
    }

    let a = -c.eye / c.dir;
    let b = (extent - c.eye) / c.dir;
    let enter = min(a, b);
    let leave = max(a, b);
    c.t = max(max(enter.x, max(enter.y, enter.z)), 0.0);
    c.inside = c.t < min(leave.x, min(leave.y, leave.z));
    c.axis = select(select(2u, 1u, enter.y >= enter.z), 0u, enter.x >= max(enter.y, enter.z));
    c.negative = c.dir[c.axis] < 0.0;
    let first = (c.eye + c.t * c.dir) / c.size;
    c.cell = vec3<i32>(clamp(first, vec3(0.0), vec3<f32>(c.dims) - 0.001));
    c.next = ((vec3<f32>(c.cell) + max(sign(c.dir), vec3(0.0))) * c.size - c.eye) / c.dir;
    return c;
}

// The cell after it (Amanatides and Woo 1987, "A fast voxel traversal algorithm for ray tracing").
fn next_cube(before: Cubes) -> Cubes {
    var c = before;
    c.axis = select(select(2u, 1u, c.next.y < c.next.z), 0u, c.next.x < min(c.next.y, c.next.z));
    c.negative = c.dir[c.axis] < 0.0;
    c.t = c.next[c.axis];
    c.next[c.axis] += abs(c.size / c.dir[c.axis]);
    c.cell[c.axis] += select(1, -1, c.negative);
    c.inside = !c.cut && c.cell[c.axis] >= 0 && c.cell[c.axis] < c.dims[c.axis];
    return c;
}

// A cell as a cube with dark edges.
fn paint_cube(c: Cubes, color: vec3<f32>) -> Fragment {
    let on_face = fract((c.eye + c.t * c.dir) / c.size);
    var edge = min(on_face, 1.0 - on_face);
    edge[c.axis] = 1.0;
    let bright = c.cut || min(edge.x, min(edge.y, edge.z)) > 0.04;
    return Fragment(vec4(color * select(0.75, 1.0, bright), 1.0), 1.0 / (1.0 + c.t));
}

// An empty cell of a cut.
fn paint_empty(c: Cubes) -> Fragment {
    return Fragment(vec4(vec3(0.03), 1.0), 1.0 / (1.0 + c.t));
}
