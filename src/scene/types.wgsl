// GPU structs of the scene; each is the twin of a Rust `Gpu*` struct, which documents its fields.
#define_import_path bevy_gi::scene::types

// scene/volume/mod.rs
struct Volume {
    origin: vec3<f32>,
    voxel: f32,
    dims: vec3<u32>,
    levels: u32,
    fade: f32,
    light_map: u32,
}

// scene/light_maps/types.rs
struct LightMap {
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    color: vec3<f32>,
    kind: u32,
    position: vec3<f32>,
    size: u32,
    direction: vec3<f32>,
    flux_scale: f32,
    range: f32,
    cos_inner: f32,
    cos_outer: f32,
    drawn: u32,
    light: u32,
    page: u32,
    bounce_min: vec3<f32>,
    bounce_max: vec3<f32>,
    origin: vec2<u32>,
    depth_origin: vec2<f32>,
    depth_size: f32,
    depth_inset: f32,
    depth_drawn: u32,
    reduction: u32,
    center: f32,
}

struct LightMaps {
    count: u32,
    array: array<LightMap>,
}

// scene/world/lights.rs
struct Light {
    position: vec3<f32>,
    kind: u32,
    color: vec3<f32>,
    range: f32,
    direction: vec3<f32>,
    cos_inner: f32,
    half_width: vec3<f32>,
    cos_outer: f32,
    half_height: vec3<f32>,
    shadow: i32,
    near: f32,
}

struct Lights {
    count: u32,
    array: array<Light>,
}

// scene/world/sky.rs
struct Sky {
    rotation: vec4<f32>,
    constant: vec3<f32>,
    brightness: f32,
    levels: f32,
}
