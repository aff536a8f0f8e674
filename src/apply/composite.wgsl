// Indirect light at full resolution, times albedo, exposed; or a debug view of it.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_gi::gpu::pack::RADIANCE_SCALE
#import bevy_gi::surface::{Surface, diffuse_albedo, load_surface, specular_albedo, view}
#import bevy_pbr::utils::octahedral_decode

struct Composite {
    size: vec2<u32>,
    divisor: u32,
    mode: u32,
    strength: f32,
}

@group(1) @binding(0) var<uniform> composite: Composite;
@group(1) @binding(1) var diffuse_texture: texture_2d<f32>;
@group(1) @binding(2) var specular_texture: texture_2d<f32>;
@group(1) @binding(3) var surface_texture: texture_2d<f32>;

struct Indirect {
    // Nits.
    diffuse: vec3<f32>,
    specular: vec3<f32>,
    // Part of the pixel that some volume lights.
    coverage: f32,
}

// Joint bilateral upsampling (Kopf et al. 2007): the four gathered pixels around, by how much
// their surface is this one.
fn upsample(pixel: vec2<u32>, s: Surface) -> Indirect {
    let divisor = f32(composite.divisor);
    let at = (vec2<f32>(pixel) - f32(composite.divisor / 2u)) / divisor;
    let base = vec2<i32>(floor(at));
    let f = at - vec2<f32>(base);
    var diffuse = vec4(0.0);
    var specular = vec3(0.0);
    var total = 0.0;
    for (var i = 0; i < 4; i++) {
        let o = vec2(i & 1, i >> 1u);
        let tap = clamp(base + o, vec2(0), vec2<i32>(composite.size) - 1);
        let other = textureLoad(surface_texture, tap, 0);
        if other.w == 0.0 {
            continue;
        }
        let b = mix(1.0 - f, f, vec2<f32>(o));
        let facing = saturate(dot(octahedral_decode(other.xy), s.normal));
        let apart = abs(other.z - s.depth) / max(s.depth, 1e-3);
        // Never quite 0: a pixel that no neighbour resembles takes the most similar.
        let w = (b.x * b.y + 1e-3) * (pow(facing, 8.0) + 1e-3) / (1e-3 + apart * apart * 100.0 + 1e-4 * apart);
        diffuse += w * textureLoad(diffuse_texture, tap, 0);
        specular += w * textureLoad(specular_texture, tap, 0).rgb;
        total += w;
    }
    let scale = select(0.0, 1.0 / total, total > 0.0);
    return Indirect(
        diffuse.rgb * scale * RADIANCE_SCALE,
        specular * scale * RADIANCE_SCALE,
        diffuse.a * scale,
    );
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(in.position.xy - view.viewport.xy);
    let surface = load_surface(pixel);
    if !surface.exists {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    let light = upsample(pixel, surface);
    let occlusion = surface.occlusion * composite.strength * view.exposure;
    let diffuse = light.diffuse * diffuse_albedo(surface) * occlusion;
    let specular = light.specular * specular_albedo(surface) * occlusion;
    var color = diffuse + specular;
    switch composite.mode {
        case #{VIEW_DIFFUSE}u: { color = diffuse; }
        case #{VIEW_SPECULAR}u: { color = specular; }
        case #{VIEW_IRRADIANCE}u: { color = light.diffuse * view.exposure; }
        case #{VIEW_ALBEDO}u: { color = diffuse_albedo(surface); }
        case #{VIEW_NORMAL}u: { color = surface.normal * 0.5 + 0.5; }
        case #{VIEW_ROUGHNESS}u: { color = vec3(surface.roughness); }
        case #{VIEW_COVERAGE}u: { color = vec3(light.coverage); }
        default: {}
    }
    return vec4(color, 1.0);
}
