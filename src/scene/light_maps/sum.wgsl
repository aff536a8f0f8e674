// A level of the flux: each texel is the sum of four.

@group(0) @binding(0) var finer: texture_2d_array<f32>;
@group(0) @binding(1) var coarser: texture_storage_2d_array<r32float, write>;

@compute @workgroup_size(8, 8)
fn sum(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(coarser);
    if any(id.xy >= size) {
        return;
    }
    let at = vec2<i32>(id.xy) * 2;
    var total = 0.0;
    for (var i = 0; i < 4; i++) {
        total += textureLoad(finer, at + vec2(i & 1, i >> 1), i32(id.z), 0).x;
    }
    textureStore(coarser, id.xy, i32(id.z), vec4(total));
}
