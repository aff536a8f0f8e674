// The surface that a camera sees in a pixel, from Bevy's G-buffer.
#define_import_path bevy_gi::surface

#import bevy_gi::surface::reflectance::{Material, deferred_material}
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
    material: Material,
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
    s.material = deferred_material(packed);
    s.occlusion = unpack_unorm4x8_(packed.b).b;
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
