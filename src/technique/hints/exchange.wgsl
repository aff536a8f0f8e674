// Light that bounces from hint to hint (Papaioannou 2011, section 6): from random places around each, guessed
// to be surfaces that face it.

#import bevy_gi::gpu::random::random3
#import bevy_gi::gpu::sh::{sh_basis, sh_cosine}
#import bevy_gi::scene::probes::bindings::{offsets, probes}
#import bevy_gi::scene::probes::types::{cell_center, probe_coords, probe_count}
#import bevy_gi::technique::hints::accumulate::blend_slot
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::guess::guessed_visibility
#import bevy_gi::technique::hints::lookup::{hint_point, sample_albedo, sample_distances, sample_hint, weigh}
#import bevy_gi::technique::hints::types::Stage
#import bevy_render::maths::{PI, PI_2}

@group(0) @binding(0) var<uniform> stage: Stage;

// A place in the ball around a hint.
fn place_around(p: vec3<f32>, probe: u32, j: u32) -> vec3<f32> {
    let u = random3(probe, j, stage.slot);
    let radius = hints.reach * pow(u.x, 1.0 / 3.0);
    let z = 2.0 * u.y - 1.0;
    let phi = PI_2 * u.z;
    return p + radius * vec3(sqrt(1.0 - z * z) * vec2(cos(phi), sin(phi)), z);
}

// One thread a hint.
@compute @workgroup_size(64)
fn collect_hints_around(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= probe_count(probes.dims) {
        return;
    }
    let p = cell_center(probe_coords(id.x, probes.dims), probes) + offsets[id.x].xyz;
    let own = sample_distances(hint_point(p)) * hints.reach;
    var light: array<vec3<f32>, 9>;
    var visible = 0.0;
    var confident = 0.0;
    var weights = 0.0;
    for (var j = 0u; j < hints.bounce_samples; j++) {
        let q = place_around(p, id.x, j);
        let at = hint_point(q);
        let distance = length(q - p);
        if any(at < vec3(0.0)) || any(at > vec3(1.0)) || distance < 0.5 * probes.cell {
            continue;
        }
        let dir = (q - p) / distance;
        let theirs = sample_distances(at);
        let guessed = guessed_visibility(distance, own, theirs * hints.reach);
        let v = select(1.0, guessed, hints.guess_visibility != 0u);
        // Near a lit surface, light is more likely to come from there (equation 9).
        let confidence = 1.0 - theirs.x;
        visible += v;
        confident += confidence;
        weights += v * confidence;
        // Equation 10: what a surface there that faces this way reflects.
        var albedo = vec3(hints.average_albedo);
        if hints.coloured != 0u {
            albedo = sample_albedo(at);
        }
        let radiance = albedo * weigh(sample_hint(at), sh_cosine(-dir));
        var y_lm = sh_basis(dir);
        for (var c = 0u; c < hints.coefficients; c++) {
            light[c] += v * confidence * radiance * y_lm[c];
        }
    }
    // Equation 8, as printed or so that a uniform field stays one.
    var total = weights;
    if hints.bounce == #{BOUNCE_LITERAL}u {
        total = visible * confident;
    }
    let scale = select(0.0, 4.0 * PI / total, total > 1e-4 && offsets[id.x].w > 0.0);
    for (var c = 0u; c < hints.coefficients; c++) {
        light[c] *= scale;
    }
    blend_slot(stage.slot, id.x, &light, 1.0);
}
