// Spheres that show light from six sides, drawn as the squares around them.

#import bevy_gi::debug::types::Shape
#import bevy_gi::surface::{orthographic, view}

@group(1) @binding(0) var<storage, read> shapes: array<Shape>;

struct Vertex {
    @builtin(position) position: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) @interpolate(flat) index: u32,
}

struct Fragment {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

// Before the eye, spheres shrink away: they would hide everything, cut by the near plane.
fn visible_radius(shape: Shape) -> f32 {
    let radii = distance(shape.center, view.world_position) / max(shape.radius, 1e-6);
    return shape.radius * select(saturate(radii / 4.0 - 1.0), 1.0, orthographic());
}

@vertex
fn vertex(@builtin(vertex_index) vertex: u32, @builtin(instance_index) index: u32) -> Vertex {
    // Two triangles of a square.
    let corner = vec2<f32>(vec2(vertex % 3u % 2u, vertex % 3u / 2u)) * 2.0 - 1.0;
    let at = select(corner, -corner, vertex >= 3u);
    let shape = shapes[index];
    // Somewhat larger: seen near by, a sphere hides more than the square through its middle.
    let reach = 1.3 * visible_radius(shape);
    let world = shape.center + reach * (at.x * view.world_from_view[0].xyz + at.y * view.world_from_view[1].xyz);
    return Vertex(view.clip_from_world * vec4(world, 1.0), world, index);
}

@fragment
fn fragment(in: Vertex) -> Fragment {
    let shape = shapes[in.index];
    let dir = normalize(select(in.world - view.world_position, -view.world_from_view[2].xyz, orthographic()));
    let to_center = shape.center - in.world;
    let along = dot(to_center, dir);
    let radius = visible_radius(shape);
    let inside = radius * radius - dot(to_center, to_center) + along * along;
    if inside < 0.0 {
        discard;
    }
    let point = in.world + dir * (along - sqrt(inside));
    let n = (point - shape.center) / radius;
    // Ambient cube (Mitchell et al. 2006, "Shading in Valve's Source engine").
    var light = vec3(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let side = 2u * axis + select(0u, 1u, n[axis] < 0.0);
        let exposure = select(1.0, view.exposure, shape.sides[side].w > 0.0);
        light += n[axis] * n[axis] * shape.sides[side].rgb * exposure;
    }
    let clip = view.clip_from_world * vec4(point, 1.0);
    return Fragment(vec4(light, 1.0), clip.z / clip.w);
}
