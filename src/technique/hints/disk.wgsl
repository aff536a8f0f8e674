// Texels of each map in a disk around a hint (Papaioannou 2011, section 4): which ones, and how many.
#define_import_path bevy_gi::technique::hints::disk

#import bevy_gi::gpu::random::random3
#import bevy_gi::scene::light_maps::lookup::{map_flux, maps}
#import bevy_gi::technique::hints::bindings::hints
#import bevy_render::maths::PI_2
#import bevy_render::view::ndc_to_uv

// Samples of a map that has any light.
const LEAST_SAMPLES: u32 = 4u;

// Flux of all maps.
fn flux_to_share() -> f32 {
    var total = 0.0;
    for (var m = 0u; m < maps.count; m++) {
        total += map_flux(m);
    }
    return total;
}

// Samples of map `m`.
fn map_samples(m: u32, total: f32) -> u32 {
    let part = map_flux(m) / max(total, 1e-20);
    // A map without light is not worth a sample, any other one some.
    let by_power = select(max(u32(f32(hints.samples) * part), LEAST_SAMPLES), 0u, part == 0.0);
    return select(by_power, max(hints.samples / maps.count, 1u), hints.share == #{SHARE_EVEN}u);
}

// Where the hint is, as the map sees it.
fn disk_center(m: u32, p: vec3<f32>) -> vec2<f32> {
    let clip = maps.array[m].clip_from_world * vec4(p, 1.0);
    if clip.w <= 0.0 {
        return vec2(0.5);
    }
    return clamp(ndc_to_uv(clip.xy / clip.w), vec2(0.0), vec2(1.0));
}

// Sample `i` of map `m`: always the same one of a hint, or it would flicker.
fn disk_sample(m: u32, i: u32, probe: u32, center: vec2<f32>) -> vec2<f32> {
    let u = random3(probe, m * hints.samples + i, 0u);
    let radius = hints.spread * select(sqrt(u.x), u.x, hints.sampling == #{SAMPLE_DISK_LITERAL}u);
    return center + radius * vec2(cos(PI_2 * u.y), sin(PI_2 * u.y));
}
