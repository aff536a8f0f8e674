// What the lights see, all maps side by side.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#ifdef RSM
#import bevy_gi::debug::types::Mark
#import bevy_gi::scene::light_maps::lookup::{load_lit_surface, maps}
#import bevy_gi::scene::light_maps::types::texel_area
#else
#import bevy_gi::scene::bindings::{light_depth, light_maps}
#endif
#import bevy_gi::surface::view
#import bevy_render::maths::PI

struct Tiles {
    // Maps; 0 if no light has any.
    count: u32,
    // Which of the views.
    content: u32,
    // Marks in reflective shadow maps.
    marks: u32,
}

@group(2) @binding(0) var<uniform> tiles: Tiles;
#ifdef RSM
@group(2) @binding(1) var<storage, read> marks: array<Mark>;
#endif

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
#ifdef RSM
    for (var i = 0u; i < tiles.marks; i++) {
        let mark = marks[i];
        let d = distance(uv, mark.uv) * tile;
        if mark.map == index && mark.radius == 0.0 && d < 2.0 {
            return vec4(1.0, 0.1, 0.6, 1.0);
        }
        if mark.map == index && mark.radius > 0.0 && abs(d - mark.radius * tile) < 1.0 {
            return vec4(1.0, 0.8, 0.1, 1.0);
        }
    }
#endif
    return vec4(map_color(index, uv), 1.0);
}

// Depth as grey: a perspective map (whose matrix has a last row of its own) has `near / distance`; an
// orthographic one has 1 at its near plane and 0 at its far one.
fn depth_color(z: f32, m: mat4x4<f32>) -> vec3<f32> {
    let perspective = any(vec3(m[0].w, m[1].w, m[2].w) != vec3(0.0));
    return vec3(select(z, sqrt(z), perspective));
}

#ifdef RSM
fn map_color(index: u32, uv: vec2<f32>) -> vec3<f32> {
    let map = maps.array[index];
    let at = min(vec2<u32>(uv * f32(map.size)), vec2(map.size - 1u));
    let texel = load_lit_surface(index, at);
    if !texel.exists {
        return vec3(0.0);
    }
    if tiles.content == #{VIEW_RSM_NORMAL}u {
        return 0.5 * texel.normal + 0.5;
    }
    if tiles.content == #{VIEW_RSM_ALBEDO}u {
        return texel.albedo;
    }
    if tiles.content == #{VIEW_RSM_DEPTH}u {
        let clip = map.clip_from_world * vec4(texel.position, 1.0);
        return depth_color(clip.z / clip.w, map.clip_from_world);
    }
    // What the surface radiates: flux over area and pi.
    let area = texel_area(map, texel.position, texel.normal);
    return texel.flux / (PI * area) * view.exposure;
}
#else
fn map_color(index: u32, uv: vec2<f32>) -> vec3<f32> {
    let map = light_maps.array[index];
    if map.depth_drawn == 0u {
        return vec3(0.0);
    }
    let page = vec2<f32>(textureDimensions(light_depth));
    let inset = vec2(map.depth_inset);
    let texel = vec2<i32>((map.depth_origin + map.depth_size * clamp(uv, inset, 1.0 - inset)) * page);
    return depth_color(textureLoad(light_depth, texel, map.page, 0), map.clip_from_world);
}
#endif
