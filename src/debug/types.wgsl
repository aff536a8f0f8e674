// What debug passes share. Twin of shapes.rs.
#define_import_path bevy_gi::debug::types

// A sphere.
struct Shape {
    // Metres.
    center: vec3<f32>,
    radius: f32,
    // Nits, seen from +x, -x, +y, -y, +z, -z; with a fourth component of 0, plain numbers that are not exposed.
    sides: array<vec4<f32>, 6>,
}

// A place in a reflective shadow map.
struct Mark {
    // 0..1 over the map.
    uv: vec2<f32>,
    // Of a circle around it, in the same unit; 0: a point; negative: nothing.
    radius: f32,
    map: u32,
}
