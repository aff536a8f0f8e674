// Temporal accumulation of gathered light on reprojected surfaces.

#import bevy_gi::gpu::pack::half_at_random
#import bevy_gi::gpu::random::hash3
#import bevy_gi::surface::{
    Surface, gathered_pixel, gathered_place, keep_surface, kept_surface, load_surface, previous_uv, view_height,
}

struct Temporal {
    size: vec2<u32>,
    full_size: vec2<u32>,
    divisor: u32,
    history_frames: u32,
    rescale: f32,
    light_changes: u32,
    frame: u32,
}

@group(1) @binding(0) var<uniform> temporal: Temporal;
@group(1) @binding(1) var new_diffuse: texture_2d<f32>;
@group(1) @binding(2) var new_specular: texture_2d<f32>;
@group(1) @binding(3) var old_diffuse: texture_2d<f32>;
@group(1) @binding(4) var old_specular: texture_2d<f32>;
@group(1) @binding(5) var old_surface: texture_2d<f32>;
@group(1) @binding(6) var diffuse_target: texture_storage_2d<rgba16float, write>;
@group(1) @binding(7) var specular_target: texture_storage_2d<rgba16float, write>;
@group(1) @binding(8) var surface_target: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= temporal.size) {
        return;
    }
    let at = vec2<i32>(id.xy);
    let pixel = gathered_pixel(id.xy, temporal.divisor, temporal.full_size);
    let surface = load_surface(pixel);
    if !surface.exists {
        textureStore(diffuse_target, at, vec4(0.0));
        textureStore(specular_target, at, vec4(0.0));
        textureStore(surface_target, at, vec4(0.0));
        return;
    }
    textureStore(surface_target, at, keep_surface(surface));
    let diffuse = textureLoad(new_diffuse, at, 0);
    let specular = textureLoad(new_specular, at, 0);

    // The four gathered pixels around the same surface a frame ago, where they still show it.
    let before = previous_uv(pixel) * vec2<f32>(temporal.full_size);
    let where_ = gathered_place(before, temporal.divisor);
    let base = vec2<i32>(floor(where_));
    let f = where_ - vec2<f32>(base);
    var before_diffuse = vec4(0.0);
    var before_specular = vec4(0.0);
    var total = 0.0;
    if temporal.history_frames > 1u {
        for (var i = 0; i < 4; i++) {
            let o = vec2(i & 1, i >> 1u);
            let tap = base + o;
            if !showed(tap, surface) {
                continue;
            }
            let b = mix(1.0 - f, f, vec2<f32>(o));
            let w = b.x * b.y;
            before_diffuse += w * textureLoad(old_diffuse, tap, 0);
            before_specular += w * textureLoad(old_specular, tap, 0);
            total += w;
        }
    }
    if total < 0.01 {
        textureStore(diffuse_target, at, diffuse);
        textureStore(specular_target, at, vec4(specular.rgb, 1.0));
        return;
    }
    before_diffuse /= total;
    before_specular /= total;
    let sharp = sharp_history(base, f, surface);
    if sharp.exists {
        before_diffuse = vec4(sharp.diffuse, before_diffuse.a);
        before_specular = vec4(sharp.specular, before_specular.a);
    }
    before_diffuse = vec4(before_diffuse.rgb * temporal.rescale, before_diffuse.a);
    before_specular = vec4(before_specular.rgb * temporal.rescale, before_specular.a);

    // At edges, what is left of the four gathered pixels lies to one side, and would drag light along with every frame
    // of a camera that moves: such a history counts for less.
    let frames = min(before_specular.a * total + 1.0, f32(temporal.history_frames));
    var old_d = before_diffuse.rgb;
    var old_s = before_specular.rgb;
    // While light changes, what the neighbourhood shows now bounds what the past may say: a light that went out must not
    // linger. Wide bounds, since each neighbour turned its cones differently. Only then: where few gathers meet a
    // small lamp, the nine of a neighbourhood may all have missed it, and bounds by them would forget it.
    if temporal.light_changes != 0u {
        old_d = bounded(old_d, new_diffuse, at, diffuse.rgb);
    }
    // What a surface mirrors changes where the eye moves, too.
    let moved = distance(before, vec2<f32>(pixel) + 0.5) > 0.01;
    if temporal.light_changes != 0u || moved {
        old_s = bounded(old_s, new_specular, at, specular.rgb);
    }
    let blend = 1.0 / frames;
    // Half floats would cut off what a new frame adds to a long history, always to the same side.
    let random = hash3(vec3(id.xy, temporal.frame));
    let d = half_at_random(mix(old_d, diffuse.rgb, blend), random);
    let s = half_at_random(mix(old_s, specular.rgb, blend), random);
    textureStore(diffuse_target, at, vec4(d, mix(before_diffuse.a, diffuse.a, blend)));
    textureStore(specular_target, at, vec4(s, frames));
}

// Whether a gathered pixel showed this surface a frame ago.
fn showed(tap: vec2<i32>, surface: Surface) -> bool {
    if any(tap < vec2(0)) || any(tap >= vec2<i32>(temporal.size)) {
        return false;
    }
    let old = kept_surface(textureLoad(old_surface, tap, 0));
    return old.exists
        && abs(old.depth - surface.depth) < 0.12 * view_height(surface.depth)
        && dot(old.normal, surface.normal) > 0.8;
}

struct SharpHistory {
    exists: bool,
    diffuse: vec3<f32>,
    specular: vec3<f32>,
}

// The history between sixteen gathered pixels by Catmull-Rom interpolation, where all of them showed the surface.
// Linear interpolation, repeated in every frame in which the camera moves, would blur light over several of them.
fn sharp_history(base: vec2<i32>, f: vec2<f32>, surface: Surface) -> SharpHistory {
    let columns = catmull_rom(f.x);
    let rows = catmull_rom(f.y);
    var sharp: SharpHistory;
    for (var i = 0; i < 16; i++) {
        let o = vec2(i & 3, i >> 2u);
        let tap = base + o - 1;
        if !showed(tap, surface) {
            return SharpHistory(false, vec3(0.0), vec3(0.0));
        }
        let w = columns[o.x] * rows[o.y];
        sharp.diffuse += w * textureLoad(old_diffuse, tap, 0).rgb;
        sharp.specular += w * textureLoad(old_specular, tap, 0).rgb;
    }
    sharp.exists = true;
    return sharp;
}

// Weights of four neighbours for a place between the two in the middle.
fn catmull_rom(f: f32) -> vec4<f32> {
    return vec4(
        f * (-0.5 + f * (1.0 - 0.5 * f)),
        1.0 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2.0 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f),
    );
}

// `history` within the mean of the 3x3 neighbourhood, give or take three standard deviations and a tenth.
fn bounded(history: vec3<f32>, texture: texture_2d<f32>, at: vec2<i32>, own: vec3<f32>) -> vec3<f32> {
    var sum = own;
    var squares = own * own;
    var count = 1.0;
    for (var i = 0; i < 9; i++) {
        let tap = at + vec2(i % 3, i / 3) - 1;
        if i == 4 || any(tap < vec2(0)) || any(tap >= vec2<i32>(temporal.size)) {
            continue;
        }
        let c = textureLoad(texture, tap, 0).rgb;
        sum += c;
        squares += c * c;
        count += 1.0;
    }
    let mean = sum / count;
    let deviation = sqrt(max(squares / count - mean * mean, vec3(0.0)));
    let reach = 3.0 * deviation + 0.1 * mean;
    return clamp(history, max(mean - reach, vec3(0.0)), mean + reach);
}
