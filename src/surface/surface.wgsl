// The surface that a camera sees in a pixel, from Bevy's G-buffer.
#define_import_path bevy_gi::surface

#import bevy_pbr::{
    pbr_deferred_types::{
        DEFERRED_FLAGS_UNLIT_BIT, unpack_24bit_normal, unpack_flags, unpack_unorm4x8_,
    },
    utils::{octahedral_decode, octahedral_encode},
}
#import bevy_render::view::{View, uv_to_ndc}

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

fn orthographic() -> bool {
    return view.clip_from_view[3].w == 1.0;
}

// Metres per unit of view space along the view axis: 1, unless the camera's transform is scaled.
fn metres_per_unit() -> f32 {
    return length(view.world_from_view[2].xyz);
}

// Height of what the whole viewport shows at distance `depth` along the view axis, metres: the measure for how far
// apart two surfaces look, whatever the size of the scene and the lens.
fn view_height(depth: f32) -> f32 {
    let at = select(abs(depth), metres_per_unit(), orthographic());
    return 2.0 * at / abs(view.clip_from_view[1].y);
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
    let ndc = vec3(uv_to_ndc(uv), z);
    let world = view.world_from_clip * vec4(ndc, 1.0);
    s.position = world.xyz / world.w;
    s.depth = -(view.view_from_world * vec4(s.position, 1.0)).z * metres_per_unit();
    // Orthographic cameras look along one axis everywhere.
    s.to_eye = normalize(select(
        view.world_position - s.position,
        view.world_from_view[2].xyz,
        orthographic(),
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

// Where a point of the viewport, in pixels, lies among gathered pixels: the inverse of `gathered_pixel`, whose pixels'
// middles are whole numbers here.
fn gathered_place(at: vec2<f32>, divisor: u32) -> vec2<f32> {
    return (at - (f32(divisor / 2u) + 0.5)) / f32(divisor);
}

// The point at distance `depth` along the view axis that `pixel` shows.
fn position_at(pixel: vec2<u32>, depth: f32) -> vec3<f32> {
    let uv = (vec2<f32>(pixel) + 0.5) / view.viewport.zw;
    let near = view.view_from_clip * vec4(uv_to_ndc(uv), 1.0, 1.0);
    let on_near = near.xyz / near.w;
    let units = depth / metres_per_unit();
    let scale = select(units / -on_near.z, 1.0, orthographic());
    return (view.world_from_view * vec4(on_near.xy * scale, -units, 1.0)).xyz;
}

// The point that gathered pixel `at` shows at that distance along the view axis.
fn gathered_point(at: vec2<i32>, depth: f32, divisor: u32, full_size: vec2<u32>) -> vec3<f32> {
    return position_at(gathered_pixel(vec2<u32>(at), divisor, full_size), depth);
}

// What is kept of a surface in four half floats: the normal, and the depth as `m * 2^e`, so that its relative
// precision is the same at every distance; half floats alone end at 65 km and lose it below 0.1 mm.
struct KeptSurface {
    // False where there is none: then all four are 0.
    exists: bool,
    normal: vec3<f32>,
    // Distance along the view axis, metres.
    depth: f32,
}

// Keeps exponents above 0.
const EXPONENT_BIAS: f32 = 256.0;

fn keep_surface(s: Surface) -> vec4<f32> {
    let exponent = clamp(floor(log2(max(abs(s.depth), 1e-30))), -100.0, 100.0);
    return vec4(octahedral_encode(s.normal), s.depth * exp2(-exponent), exponent + EXPONENT_BIAS);
}

fn kept_surface(texel: vec4<f32>) -> KeptSurface {
    let depth = texel.z * exp2(texel.w - EXPONENT_BIAS);
    return KeptSurface(texel.w > 0.0, octahedral_decode(texel.xy), depth);
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

// Scale and offset of F0 in the reflectance of a GGX lobe, as Bevy fits them (`F_AB`, Karis 2014).
fn fitted_scale_and_offset(roughness: f32, n_dot_v: f32) -> vec2<f32> {
    let c0 = vec4(-1.0, -0.0275, -0.572, 0.022);
    let c1 = vec4(1.0, 0.0425, 1.04, -0.04);
    let r = roughness * c0 + c1;
    let a = min(r.x * r.x, exp2(-9.28 * n_dot_v)) * r.x + r.y;
    return max(vec2(-1.04, 1.04) * a + r.zw, vec2(5e-5));
}

// The same for the lobe that Bevy shades lamps with: GGX with height-correlated Smith masking, integrated over the
// hemisphere. Least-squares fits in roughness 0..1 and cosine 0.05..1, whose error is 0.01 (RMS). Bevy's own fit is
// of another lobe: at roughness 0.9 seen head-on, it has 0.46 where this one has 0.36.
fn scale_and_offset(roughness: f32, n_dot_v: f32) -> vec2<f32> {
    let r2 = roughness * roughness;
    let r = vec4(1.0, r2, r2 * roughness, r2 * r2);
    let c = n_dot_v;
    let t = 1.0 - n_dot_v;
    let whole = mat4x4(
        0.950, -0.987, 2.593, -1.670,
        0.390, -5.233, 2.900, 0.422,
        -0.731, 19.051, -30.528, 13.885,
        0.386, -11.957, 21.601, -10.779,
    );
    let grazing = mat4x4(
        0.345, -1.692, 1.348, 0.034,
        -2.084, 9.076, -3.830, -3.377,
        3.840, -3.670, -23.985, 24.378,
        -1.162, -13.261, 43.509, -29.476,
    );
    let sum = dot(r, whole * vec4(1.0, c, c * c, c * c * c));
    let offset = dot(r, grazing * (t * t * vec4(1.0, t, t * t, t * t * t)));
    return saturate(vec2(sum - offset, offset));
}

// Part of light that is the same all over the specular lobe that is reflected, as Bevy's lamps have it
// (`specular_multiscatter`): with the compensation for several bounces between microfacets, and grazing reflectance
// that vanishes with F0.
fn specular_albedo(s: Surface) -> vec3<f32> {
    let n_dot_v = max(dot(s.normal, s.to_eye), 1e-4);
    let f = f0(s);
    let f90 = saturate(16.5 * (f.r + f.g + f.b));
    let ab = scale_and_offset(s.roughness, n_dot_v);
    let fitted = fitted_scale_and_offset(s.roughness, n_dot_v);
    return (f * ab.x + f90 * ab.y) * (1.0 + f * (1.0 / (fitted.x + fitted.y) - 1.0));
}
