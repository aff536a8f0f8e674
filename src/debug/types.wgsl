// What debug passes share. Twin of shapes.rs.
#define_import_path bevy_gi::debug::types

// A sphere.
struct Shape {
    // Metres.
    center: vec3<f32>,
    radius: f32,
    // Nits, seen from +x, -x, +y, -y, +z, -z.
    sides: array<vec4<f32>, 6>,
}
