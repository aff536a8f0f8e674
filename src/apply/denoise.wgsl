// Spatial filter of accumulated light: a mean over neighbours on the same surface.

#import bevy_gi::surface::{gathered_point, kept_surface, view_height}

struct Denoise {
    size: vec2<u32>,
    full_size: vec2<u32>,
    divisor: u32,
    radius: u32,
}

@group(1) @binding(0) var<uniform> settings: Denoise;
@group(1) @binding(1) var diffuse_texture: texture_2d<f32>;
@group(1) @binding(2) var specular_texture: texture_2d<f32>;
// What `keep_surface` stored.
@group(1) @binding(3) var surface_texture: texture_2d<f32>;
@group(1) @binding(4) var diffuse_target: texture_storage_2d<rgba16float, write>;
@group(1) @binding(5) var specular_target: texture_storage_2d<rgba16float, write>;

fn point(at: vec2<i32>, depth: f32) -> vec3<f32> {
    return gathered_point(at, depth, settings.divisor, settings.full_size);
}

@compute @workgroup_size(8, 8)
fn denoise(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= settings.size) {
        return;
    }
    let at = vec2<i32>(id.xy);
    let own = kept_surface(textureLoad(surface_texture, at, 0));
    if !own.exists {
        textureStore(diffuse_target, at, vec4(0.0));
        textureStore(specular_target, at, vec4(0.0));
        return;
    }
    let p = point(at, own.depth);
    // The same plane, within a fortieth of what the view shows there.
    let reach = 0.025 * view_height(own.depth);
    var diffuse = vec4(0.0);
    var specular = vec4(0.0);
    var total = 0.0;
    let r = i32(settings.radius);
    for (var y = -r; y <= r; y++) {
        for (var x = -r; x <= r; x++) {
            let tap = at + vec2(x, y);
            if any(tap < vec2(0)) || any(tap >= vec2<i32>(settings.size)) {
                continue;
            }
            let other = kept_surface(textureLoad(surface_texture, tap, 0));
            if !other.exists {
                continue;
            }
            let apart = abs(dot(own.normal, point(tap, other.depth) - p)) / reach;
            let facing = saturate(dot(other.normal, own.normal));
            let w = pow(facing, 16.0) * saturate(1.0 - apart);
            if x == 0 && y == 0 || w > 0.0 {
                let weight = select(w, 1.0, x == 0 && y == 0);
                diffuse += weight * textureLoad(diffuse_texture, tap, 0);
                specular += weight * textureLoad(specular_texture, tap, 0);
                total += weight;
            }
        }
    }
    textureStore(diffuse_target, at, diffuse / total);
    textureStore(specular_target, at, specular / total);
}
