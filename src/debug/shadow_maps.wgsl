// All shadow maps side by side, brightest where the light's eye is nearest.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_gi::scene::bindings::{shadow_maps, shadow_views}
#import bevy_gi::surface::view

struct Tiles {
    // Maps; 0 if no light has any.
    count: u32,
    // Texels along a side of a map.
    size: u32,
}

@group(2) @binding(0) var<uniform> tiles: Tiles;

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    let pixel = in.position.xy - view.viewport.xy;
    let size = view.viewport.zw;
    // As few columns as let all rows fit.
    var columns = ceil(sqrt(f32(tiles.count) * size.x / size.y));
    while columns > 0.0 && ceil(f32(tiles.count) / columns) * size.x / columns > size.y {
        columns += 1.0;
    }
    let tile = size.x / max(columns, 1.0);
    let at = vec2<u32>(pixel / tile);
    let index = at.y * u32(columns) + at.x;
    let uv = fract(pixel / tile);
    let border = min(min(uv.x, uv.y), min(1.0 - uv.x, 1.0 - uv.y)) * tile;
    if index >= tiles.count || border < 1.0 {
        return vec4(0.02, 0.02, 0.05, 1.0);
    }
    let texel = min(vec2<u32>(uv * f32(tiles.size)), vec2(tiles.size - 1u));
    let z = textureLoad(shadow_maps, vec2<i32>(texel), i32(index), 0);
    // A perspective map (whose matrix has a last row of its own) has `near / distance`; an
    // orthographic one has 1 at its near plane and 0 at its far one.
    let m = shadow_views[index];
    let perspective = any(vec3(m[0].w, m[1].w, m[2].w) != vec3(0.0));
    let shown = select(z, sqrt(z), perspective);
    return vec4(vec3(shown), 1.0);
}
