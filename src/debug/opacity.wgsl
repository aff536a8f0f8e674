// Ambient occlusion: the part of the hemisphere above each surface that nothing in the volume blocks, weighted by the
// cosine (Freed 2018, figure 4.9).

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_gi::gpu::basis::{hemisphere_spiral, orthonormal}
#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::opacity::lookup::{Cone, March, transmittance}
#import bevy_gi::surface::{load_surface, view}

// Enough for smooth gradients without noise.
const CONES: u32 = 24u;
// Tangent of half the angle of cones that cover the hemisphere together.
const TAN_HALF: f32 = 0.25;
// As many as cross the largest volume.
const STEPS: u32 = 256u;

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    let s = load_surface(vec2<u32>(in.position.xy - view.viewport.xy));
    let extent = vec3<f32>(volume.dims) * volume.voxel;
    let uvw = (s.position - volume.origin) / extent;
    if !s.exists || any(uvw < vec3(0.0)) || any(uvw > vec3(1.0)) {
        discard;
    }
    // As in the preset `ultra` of voxel cone tracing.
    let march = March(0.6, 1.0, 0.18, 1.0, 0.97);
    let origin = s.position + march.bias * volume.voxel * s.normal;
    let basis = orthonormal(s.normal);
    var open = 0.0;
    for (var i = 0u; i < CONES; i++) {
        let dir = basis * hemisphere_spiral(i, CONES, 0.0);
        open += transmittance(Cone(origin, dir, TAN_HALF, s.normal, STEPS, 0.5), march);
    }
    return vec4(vec3(open / f32(CONES)), 1.0);
}
