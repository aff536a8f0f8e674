// Uniforms of radiance hints. Twin of types.rs.
#define_import_path bevy_gi::technique::hints::types

struct Hints {
    coefficients: u32,
    samples: u32,
    first_sample: u32,
    vpls: u32,
    first_vpl: u32,
    frame: u32,
    blend_lights: f32,
    blend_sources: f32,
    blend_bounces: f32,
    specular: u32,
    sampling: u32,
    occlusion: u32,
    bounce: u32,
    spread: f32,
    bounce_samples: u32,
    reach: f32,
    average_albedo: f32,
    reconstruction: u32,
    tap_distance: f32,
    sleep_beyond: f32,
    share: u32,
    coloured: u32,
    occlusion_points: u32,
    occlusion_left: f32,
    min_distance: f32,
    guess_visibility: u32,
    taps: u32,
    ring_cos: f32,
    quiet: f32,
    unit: f32,
}

// The source of a slot's light, and the slots whose light is summed up, a bit each.
struct Stage {
    slot: u32,
    mask: u32,
    slots: u32,
    coefficients: u32,
    dims: vec3<u32>,
    // Factors on the light of the slots of lamps and of bounces.
    first_gain: f32,
    later_gain: f32,
    unit: f32,
}

// What debug views show.
struct HintsView {
    pick_from: vec3<f32>,
    // A HintView.
    content: u32,
    pick_to: vec3<f32>,
    slots: u32,
    // A GiSlice, and where.
    slice: u32,
    slice_at: f32,
    // Room for marks in maps.
    marks: u32,
    taps: u32,
    mask: u32,
    is_light: u32,
}

// A surface that is picked, and the hint that lights it most.
struct Picked {
    position: vec3<f32>,
    exists: u32,
    normal: vec3<f32>,
    probe: u32,
}

const SLOT_LIGHTS: u32 = #{SLOT_LIGHTS}u;
const SLOT_EMISSION: u32 = #{SLOT_EMISSION}u;
const SLOT_SKY: u32 = #{SLOT_SKY}u;
const SLOT_BOUNCES: u32 = #{SLOT_BOUNCES}u;
