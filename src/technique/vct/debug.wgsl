// Voxels, and the cells that are made of them, as cubes met by a ray through each pixel; or in a cut.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_gi::gpu::pack::RADIANCE_SCALE
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::voxels::types::{
    BRICK_MARKED, BRICK_VOXELS, Voxel, WORDS, brick_index, local_index, unpack_voxel,
}
#import bevy_gi::surface::view
#import bevy_gi::technique::vct::bindings::cells

struct VoxelView {
    // A GiView.
    content: u32,
    // 0 are voxels, cells of level l are 2^l of them wide.
    level: u32,
    // A GiSlice.
    slice: u32,
    // 0..1, from one side of the volume to the other.
    slice_at: f32,
}

@group(3) @binding(0) var<uniform> shown: VoxelView;
@group(3) @binding(1) var<storage, read> brick_map: array<u32>;
@group(3) @binding(2) var<storage, read> pool: array<u32>;

struct Fragment {
    @location(0) color: vec4<f32>,
    // Larger is nearer.
    @builtin(frag_depth) depth: f32,
}

// The surface in a voxel.
fn load_voxel(voxel: vec3<u32>) -> Voxel {
    let slot = brick_map[brick_index(voxel, volume.dims)];
    var none: Voxel;
    if slot == 0u || slot == BRICK_MARKED {
        return none;
    }
    let at = ((slot - 1u) * BRICK_VOXELS + local_index(voxel)) * WORDS;
    return unpack_voxel(vec3(pool[at], pool[at + 1u], pool[at + 2u]));
}

// Premultiplied radiance and opacity of a cell of level 1 or more, for light that travels along `axis`,
// in its negative direction if `negative`.
fn load_cell(cell: vec3<u32>, level: u32, axis: u32, negative: bool) -> vec4<f32> {
    let block = 2u * axis + select(0u, 1u, negative);
    let layers = volume.dims.z >> level;
    let at = vec3<i32>(vec3(cell.xy, cell.z + block * layers));
    return textureLoad(cells, at, i32(level) - 1);
}

fn occupied(cell: vec3<u32>, level: u32) -> bool {
    if level == 0u {
        return load_voxel(cell).exists;
    }
    var opacity = 0.0;
    for (var i = 0u; i < 6u; i++) {
        opacity += load_cell(cell, level, i / 2u, (i & 1u) != 0u).a;
    }
    return opacity > 0.0;
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
        let v = load_voxel(cell * width + at);
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

// What is shown of a cell that is met while travelling along `axis`.
fn content(cell: vec3<u32>, level: u32, axis: u32, negative: bool) -> vec3<f32> {
    switch shown.content {
        case #{VIEW_VOXEL_ALBEDO}u: { return mean_voxel(cell, level).albedo; }
        case #{VIEW_VOXEL_NORMAL}u: { return mean_voxel(cell, level).normal * 0.5 + 0.5; }
        case #{VIEW_VOXEL_EMISSION}u: { return mean_voxel(cell, level).emission * view.exposure; }
        default: {}
    }
    // Voxels themselves have neither: the cells of two voxels are the finest.
    let up = 1u - min(level, 1u);
    let value = load_cell(cell >> vec3(up), level + up, axis, negative);
    if shown.content == #{VIEW_VOXEL_OPACITY}u {
        return vec3(value.a);
    }
    return value.rgb / max(value.a, 1e-4) * RADIANCE_SCALE * view.exposure;
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> Fragment {
    let level = min(shown.level, volume.levels);
    let size = volume.voxel * f32(1u << level);
    let dims = volume.dims >> vec3(level);
    let extent = vec3<f32>(volume.dims) * volume.voxel;

    let uv = (in.position.xy - view.viewport.xy) / view.viewport.zw;
    let ndc = uv * vec2(2.0, -2.0) + vec2(-1.0, 1.0);
    // Reverse-Z: 1 is the near plane.
    let near = view.world_from_clip * vec4(ndc, 1.0, 1.0);
    let far = view.world_from_clip * vec4(ndc, 0.5, 1.0);
    let eye = near.xyz / near.w - volume.origin;
    let dir_ = normalize(far.xyz / far.w - near.xyz / near.w);
    // No component is quite 0.
    let dir = select(dir_, vec3(1e-6), abs(dir_) < vec3(1e-6));

    if shown.slice != 0u {
        let axis = shown.slice - 1u;
        let t = (shown.slice_at * extent[axis] - eye[axis]) / dir[axis];
        var at = (eye + t * dir) / size;
        // The last cell, at the very end.
        at[axis] = min(at[axis], f32(dims[axis]) - 0.5);
        if t < 0.0 || any(at < vec3(0.0)) || any(at >= vec3<f32>(dims)) {
            discard;
        }
        let cell = vec3<u32>(at);
        var color = vec3(0.03);
        if occupied(cell, level) {
            color = content(cell, level, axis, dir[axis] < 0.0);
        }
        return Fragment(vec4(color, 1.0), 1.0 / (1.0 + t));
    }

    // Where the ray is inside of the volume.
    let a = -eye / dir;
    let b = (extent - eye) / dir;
    let enter = min(a, b);
    let leave = max(a, b);
    let start = max(max(enter.x, max(enter.y, enter.z)), 0.0);
    let end = min(leave.x, min(leave.y, leave.z));
    if start >= end {
        discard;
    }
    // From cell to cell (Amanatides and Woo 1987, "A fast voxel traversal algorithm for ray tracing").
    var axis = select(select(2u, 1u, enter.y >= enter.z), 0u, enter.x >= max(enter.y, enter.z));
    let first = clamp((eye + start * dir) / size, vec3(0.0), vec3<f32>(dims) - 0.001);
    var cell = vec3<i32>(first);
    let step = vec3<i32>(sign(dir));
    let delta = abs(size / dir);
    var next = (vec3<f32>(cell) + max(sign(dir), vec3(0.0))) * size;
    next = (next - eye) / dir;
    var t = start;
    for (var i = 0u; i < dims.x + dims.y + dims.z; i++) {
        if occupied(vec3<u32>(cell), level) {
            let color = content(vec3<u32>(cell), level, axis, dir[axis] < 0.0);
            // Edges of cubes are darker.
            let on_face = fract((eye + t * dir) / size);
            var edge = min(on_face, 1.0 - on_face);
            edge[axis] = 1.0;
            let shade = select(0.75, 1.0, min(edge.x, min(edge.y, edge.z)) > 0.04);
            return Fragment(vec4(color * shade, 1.0), 1.0 / (1.0 + t));
        }
        axis = select(select(2u, 1u, next.y < next.z), 0u, next.x < min(next.y, next.z));
        t = next[axis];
        next[axis] += delta[axis];
        cell[axis] += step[axis];
        if cell[axis] < 0 || cell[axis] >= i32(dims[axis]) {
            break;
        }
    }
    discard;
}
