// Nothing is seen, as far as a tile reaches. Reverse-Z: 0 is infinitely far away.

@vertex
fn far_away(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}
