// The surface that a camera sees in a pixel, from Bevy's G-buffer.
#define_import_path bevy_gi::surface

#import bevy_pbr::{
    pbr_deferred_types::{
        DEFERRED_FLAGS_UNLIT_BIT, unpack_24bit_normal, unpack_flags, unpack_unorm4x8_,
    },
    utils::octahedral_decode,
}
#import bevy_render::view::View

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth_texture: texture_depth_2d;
@group(0) @binding(2) var deferred_texture: texture_2d<u32>;
@group(0) @binding(3) var motion_texture: texture_2d<f32>;

struct Surface {
    // False for sky, forward-rendered and unlit pixels: they get no indirect light.
    exists: bool,
    // Metres.
    position: vec3<f32>,
    normal: vec3<f32>,
    // Unit vector.
    to_eye: vec3<f32>,
    // Distance along the view axis, metres.
    depth: f32,
    base_color: vec3<f32>,
    // Perceptual.
    roughness: f32,
    metallic: f32,
    reflectance: f32,
    // The material's own ambient occlusion map.
    occlusion: f32,
}

// The surface in `pixel`, counted from the viewport's corner.
fn load_surface(pixel: vec2<u32>) -> Surface {
    var s: Surface;
    let texel = vec2<i32>(vec2<f32>(pixel) + view.viewport.xy);
    let z = textureLoad(depth_texture, texel, 0);
    let packed = textureLoad(deferred_texture, texel, 0);
    // Reverse-Z: 0 is the sky. A forward material leaves the G-buffer empty.
    if z == 0.0 || all(packed == vec4(0u)) {
        return s;
    }
    let uv = (vec2<f32>(pixel) + 0.5) / view.viewport.zw;
    let ndc = vec3(uv * vec2(2.0, -2.0) + vec2(-1.0, 1.0), z);
    let world = view.world_from_clip * vec4(ndc, 1.0);
    s.position = world.xyz / world.w;
    s.depth = -(view.view_from_world * vec4(s.position, 1.0)).z;
    // Orthographic cameras look along one axis everywhere.
    let orthographic = view.clip_from_view[3].w == 1.0;
    s.to_eye = normalize(select(
        view.world_position - s.position,
        view.world_from_view[2].xyz,
        orthographic,
    ));
    let unlit = (unpack_flags(packed.a) & DEFERRED_FLAGS_UNLIT_BIT) != 0u;
    s.normal = octahedral_decode(unpack_24bit_normal(packed.a));
    let color = unpack_unorm4x8_(packed.r);
    s.base_color = pow(color.rgb, vec3(2.2));
    s.roughness = color.a;
    let properties = unpack_unorm4x8_(packed.b);
    s.reflectance = properties.r;
    s.metallic = properties.g;
    s.occlusion = properties.b;
    s.exists = !unlit && all(abs(s.position) < vec3(1e9));
    return s;
}

// The pixel that gathered pixel `at` stands for, one of `divisor` x `divisor`.
fn gathered_pixel(at: vec2<u32>, divisor: u32, full_size: vec2<u32>) -> vec2<u32> {
    return min(at * divisor + divisor / 2u, full_size - 1u);
}

// The point at distance `depth` along the view axis that `pixel` shows.
fn position_at(pixel: vec2<u32>, depth: f32) -> vec3<f32> {
    let uv = (vec2<f32>(pixel) + 0.5) / view.viewport.zw;
    let near = view.view_from_clip * vec4(uv * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 1.0, 1.0);
    let on_near = near.xyz / near.w;
    let orthographic = view.clip_from_view[3].w == 1.0;
    let scale = select(depth / -on_near.z, 1.0, orthographic);
    return (view.world_from_view * vec4(on_near.xy * scale, -depth, 1.0)).xyz;
}

// Where the surface in `pixel` was in the last frame, as uv in the viewport.
fn previous_uv(pixel: vec2<u32>) -> vec2<f32> {
    let texel = vec2<i32>(vec2<f32>(pixel) + view.viewport.xy);
    let motion = textureLoad(motion_texture, texel, 0).xy;
    return (vec2<f32>(pixel) + 0.5) / view.viewport.zw - motion;
}

fn diffuse_albedo(s: Surface) -> vec3<f32> {
    return s.base_color * (1.0 - s.metallic);
}

// Specular reflectance at normal incidence, as Bevy has it (`calculate_F0`).
fn f0(s: Surface) -> vec3<f32> {
    return mix(vec3(0.16 * s.reflectance * s.reflectance), s.base_color, s.metallic);
}

// Whether a specular cone would be seen at all.
fn specular_matters(s: Surface) -> bool {
    return max(s.reflectance, s.metallic) > 0.01;
}

// Reflectance of the whole GGX lobe for light that is the same all over it (Karis 2014, as in
// Bevy's `EnvBRDFApprox`).
fn specular_albedo(s: Surface) -> vec3<f32> {
    let n_dot_v = max(dot(s.normal, s.to_eye), 1e-4);
    let c0 = vec4(-1.0, -0.0275, -0.572, 0.022);
    let c1 = vec4(1.0, 0.0425, 1.04, -0.04);
    let r = s.roughness * c0 + c1;
    let a = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    let ab = vec2(-1.04, 1.04) * a + r.zw;
    let f = f0(s);
    // Grazing reflectance vanishes with F0, as Bevy's f90 does.
    return f * ab.x + saturate(50.0 / 3.0 * (f.r + f.g + f.b)) * ab.y;
}
