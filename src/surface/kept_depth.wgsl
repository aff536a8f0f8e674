// Depth that a camera saw in the last frame.
#define_import_path bevy_gi::surface::kept_depth

struct CameraDepth {
    clip_from_world: mat4x4<f32>,
    // 0 until there was a frame.
    seen: u32,
}
