// Pictures in place of what a camera sees: one, or two compared.

struct Settings {
    // Factors from the pictures' values to those of the camera's target.
    scale: vec2<f32>,
    // Where a wipe stands, 0..1 from the left.
    split: f32,
    mode: u32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> settings: Settings;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var left: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var right: texture_2d<f32>;

struct Fragment {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

// The mesh is a square from -1 to 1: all of the picture, before everything else.
@vertex
fn vertex(@location(0) position: vec3<f32>) -> Fragment {
    return Fragment(
        vec4(position.xy, 1.0, 1.0),
        vec2(0.5, -0.5) * position.xy + 0.5,
    );
}

fn texel(picture: texture_2d<f32>, uv: vec2<f32>) -> vec2<i32> {
    let size = vec2<f32>(textureDimensions(picture));
    return vec2<i32>(clamp(uv * size, vec2(0.0), size - 1.0));
}

fn seen_left(uv: vec2<f32>) -> vec3<f32> {
    return textureLoad(left, texel(left, uv), 0).rgb * settings.scale.x;
}

fn seen_right(uv: vec2<f32>) -> vec3<f32> {
    return textureLoad(right, texel(right, uv), 0).rgb * settings.scale.y;
}

// Mean of the 8x8 pixels around, on a grid that does not move.
fn mean(picture: texture_2d<f32>, uv: vec2<f32>) -> vec3<f32> {
    let corner = texel(picture, uv) / 8 * 8;
    let last = vec2<i32>(textureDimensions(picture)) - 1;
    var sum = vec3(0.0);
    for (var i = 0; i < 64; i++) {
        sum += textureLoad(picture, min(corner + vec2(i % 8, i / 8), last), 0).rgb;
    }
    return sum / 64.0;
}

// Colour of a signed error: blue is too dark, red is too bright, white is right.
fn heat(error: f32) -> vec3<f32> {
    let e = clamp(error, -1.0, 1.0);
    let cold = mix(vec3(1.0), vec3(0.02, 0.10, 0.55), sqrt(max(-e, 0.0)));
    let hot = mix(vec3(1.0), vec3(0.55, 0.02, 0.03), sqrt(max(e, 0.0)));
    return cold * hot;
}

@fragment
fn fragment(in: Fragment) -> @location(0) vec4<f32> {
    let uv = in.uv;
    var color = seen_left(uv);
    switch settings.mode {
        // Left and right of a line.
        case 1u: {
            color = select(color, seen_right(uv), uv.x > settings.split);
            let pixel = 1.0 / f32(textureDimensions(left).x);
            color = select(color, vec3(1.0), abs(uv.x - settings.split) < pixel);
        }
        // The middle of both, side by side.
        case 2u: {
            let half = vec2(fract(2.0 * uv.x) * 0.5 + 0.25, uv.y);
            color = select(seen_left(half), seen_right(half), uv.x > 0.5);
            let pixel = 1.0 / f32(textureDimensions(left).x);
            color = select(color, vec3(1.0), abs(uv.x - 0.5) < pixel);
        }
        // How far the left is off the right, relative to the right.
        case 3u: {
            let weights = vec3(0.2126, 0.7152, 0.0722);
            let a = dot(mean(left, uv), weights) * settings.scale.x;
            let b = dot(mean(right, uv), weights) * settings.scale.y;
            color = heat((a - b) / max(b, 0.002));
        }
        case 4u: {
            color = seen_right(uv);
        }
        default: {}
    }
    return vec4(color, 1.0);
}
