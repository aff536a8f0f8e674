// Colours, linear with Rec. 709 primaries.
#define_import_path bevy_gi::gpu::color

fn luminance(color: vec3<f32>) -> f32 {
    return dot(color, vec3(0.2126, 0.7152, 0.0722));
}
