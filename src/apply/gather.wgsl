// Group 3 of the gather: which pixels, which volume, and where the result goes.
#define_import_path bevy_gi::apply::gather

#import bevy_gi::surface::{Surface, gathered_pixel, load_surface}

struct Box {
    min: vec3<f32>,
    fade: f32,
    max: vec3<f32>,
    pad: f32,
}

struct Gather {
    size: vec2<u32>,
    full_size: vec2<u32>,
    divisor: u32,
    frame: u32,
    with_sky: u32,
    first: u32,
    volume_box: Box,
    unit: f32,
}

@group(3) @binding(0) var<uniform> gather: Gather;
@group(3) @binding(1) var diffuse_before: texture_2d<f32>;
@group(3) @binding(2) var specular_before: texture_2d<f32>;
@group(3) @binding(3) var diffuse_target: texture_storage_2d<rgba16float, write>;
@group(3) @binding(4) var specular_target: texture_storage_2d<rgba16float, write>;

// Share of a volume at `p`: 1 inside, 0 outside, smooth over its border.
fn inside(b: Box, p: vec3<f32>) -> f32 {
    let d = min(p - b.min, b.max - p);
    return smoothstep(0.0, max(b.fade, 1e-6 * (b.max.x - b.min.x)), min(d.x, min(d.y, d.z)));
}

// Part of a gathered pixel that finer volumes have lit already.
fn lit_before(id: vec2<u32>) -> f32 {
    if gather.first != 0u {
        return 0.0;
    }
    return textureLoad(diffuse_before, vec2<i32>(id), 0).a;
}

// What a thread gathers light for.
struct Gathered {
    // False where there is nothing to gather, which is stored already.
    exists: bool,
    surface: Surface,
    // Share of this pass' volume.
    weight: f32,
}

// How every gather begins: the surface of gathered pixel `id`.
fn begin(id: vec2<u32>) -> Gathered {
    var g: Gathered;
    if any(id >= gather.size) {
        return g;
    }
    g.surface = load_surface(gathered_pixel(id, gather.divisor, gather.full_size));
    if g.surface.exists {
        // Finer volumes come first, coarser ones take what is left.
        g.weight = inside(gather.volume_box, g.surface.position) * (1.0 - lit_before(id));
    }
    g.exists = g.weight > 0.0;
    if !g.exists {
        store(id, 0.0, vec3(0.0), vec3(0.0));
    }
    return g;
}

// Adds this volume's share of radiances, nits.
fn store(id: vec2<u32>, weight: f32, diffuse: vec3<f32>, specular: vec3<f32>) {
    var d = vec4(diffuse / gather.unit, 1.0) * weight;
    var s = vec4(specular / gather.unit, 1.0) * weight;
    if gather.first == 0u {
        d += textureLoad(diffuse_before, vec2<i32>(id), 0);
        s += textureLoad(specular_before, vec2<i32>(id), 0);
    }
    textureStore(diffuse_target, vec2<i32>(id), min(d, vec4(65504.0)));
    textureStore(specular_target, vec2<i32>(id), min(s, vec4(65504.0)));
}
