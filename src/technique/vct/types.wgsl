// Uniforms of voxel cone tracing. Twin of types.rs.
#define_import_path bevy_gi::technique::vct::types

struct Cones {
    cones: u32,
    bounce_cones: u32,
    arrangement: u32,
    diffuse_steps: u32,
    specular_steps: u32,
    tan_half: f32,
    step: f32,
    bias: f32,
    clearance: f32,
    opacity_cutoff: f32,
    density: f32,
    specular: u32,
    specular_scale: f32,
    unit: f32,
}
