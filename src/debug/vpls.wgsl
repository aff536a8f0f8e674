// Virtual point lights as spheres.

#import bevy_gi::debug::types::Shape
#import bevy_gi::scene::light_maps::lookup::vpls
#import bevy_gi::scene::light_maps::types::vpl_normal
#import bevy_render::maths::PI

struct ShowVpls {
    count: u32,
}

@group(0) @binding(0) var<uniform> shown: ShowVpls;
@group(0) @binding(1) var<storage, read_write> shapes: array<Shape>;

@compute @workgroup_size(64)
fn show_vpls(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= shown.count {
        return;
    }
    let vpl = vpls[id.x];
    var shape: Shape;
    shape.center = vpl.position;
    // A part of the patch that it stands for.
    shape.radius = 0.25 * sqrt(vpl.radius_squared);
    // The radiance of that patch, as far as a side looks the same way.
    let n = vpl_normal(vpl);
    let radiance = vpl.flux / max(PI * PI * vpl.radius_squared, 1e-12);
    for (var i = 0u; i < 6u; i++) {
        let facing = select(n[i / 2u], -n[i / 2u], i % 2u == 1u);
        shape.sides[i] = vec4(radiance * saturate(facing), 1.0);
    }
    shapes[id.x] = shape;
}
