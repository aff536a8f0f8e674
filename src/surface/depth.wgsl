// What a camera sees is kept, smaller, for the frame after.

#import bevy_gi::surface::{depth_texture, view}
#import bevy_gi::surface::kept_depth::CameraDepth

@group(1) @binding(0) var target_: texture_storage_2d<r32float, write>;
@group(1) @binding(1) var<storage, read_write> camera: CameraDepth;

@compute @workgroup_size(8, 8)
fn keep_depth(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(target_);
    if any(id.xy >= size) {
        return;
    }
    if all(id.xy == vec2(0u)) {
        camera.clip_from_world = view.clip_from_world;
        camera.seen = 1u;
    }
    let uv = (vec2<f32>(id.xy) + 0.5) / vec2<f32>(size);
    let pixel = vec2<i32>(uv * view.viewport.zw + view.viewport.xy);
    textureStore(target_, id.xy, vec4(textureLoad(depth_texture, pixel, 0)));
}
