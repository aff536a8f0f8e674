// Indirect light at full resolution, times albedo, exposed; or a debug view of it.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import bevy_gi::surface::{
    Surface, gathered_place, gathered_point, kept_surface, load_surface, previous_uv, view, view_height,
}
#import bevy_gi::surface::reflectance::{diffuse_albedo, diffuse_color, specular_albedo}
#import bevy_pbr::ssao_utils::ssao_multibounce

struct Composite {
    size: vec2<u32>,
    divisor: u32,
    mode: u32,
    strength: f32,
    ssao: u32,
    history_frames: u32,
    unit: f32,
    fog: Fog,
}

struct Fog {
    falloff: vec3<f32>,
    opacity: f32,
    kind: u32,
}

@group(1) @binding(0) var<uniform> composite: Composite;
@group(1) @binding(1) var diffuse_texture: texture_2d<f32>;
@group(1) @binding(2) var specular_texture: texture_2d<f32>;
@group(1) @binding(3) var surface_texture: texture_2d<f32>;
// Of the viewport's size, if there is one.
@group(1) @binding(4) var ssao_texture: texture_2d<f32>;

struct Indirect {
    // Nits.
    diffuse: vec3<f32>,
    specular: vec3<f32>,
    // Part of the pixel that some volume lights.
    coverage: f32,
    // Frames that the light is made of.
    frames: f32,
    // How much the gathered pixels around show this pixel's surface: 0..1.
    similar: f32,
}

// Joint bilateral upsampling (Kopf et al. 2007): the four gathered pixels around, by how much
// their surface is this one: the same plane, not the same depth, or slanted walls would show bands.
fn upsample(pixel: vec2<u32>, s: Surface) -> Indirect {
    let at = gathered_place(vec2<f32>(pixel) + 0.5, composite.divisor);
    let base = vec2<i32>(floor(at));
    let f = at - vec2<f32>(base);
    var diffuse = vec4(0.0);
    var specular = vec4(0.0);
    var total = 0.0;
    var similar = 0.0;
    let height = view_height(s.depth);
    let full_size = vec2<u32>(view.viewport.zw);
    for (var i = 0; i < 4; i++) {
        let o = vec2(i & 1, i >> 1u);
        let tap = clamp(base + o, vec2(0), vec2<i32>(composite.size) - 1);
        let other = kept_surface(textureLoad(surface_texture, tap, 0));
        if !other.exists {
            continue;
        }
        let b = mix(1.0 - f, f, vec2<f32>(o));
        let facing = saturate(dot(other.normal, s.normal));
        let point = gathered_point(tap, other.depth, composite.divisor, full_size);
        let off = dot(s.normal, point - s.position);
        let apart = abs(off) / height;
        // Never quite 0: a pixel that no neighbour resembles takes the most similar.
        let w = (b.x * b.y + 1e-3) * (pow(facing, 8.0) + 1e-3) / (1e-3 + apart * apart * 70.0 + 1e-4 * apart);
        diffuse += w * textureLoad(diffuse_texture, tap, 0);
        specular += w * textureLoad(specular_texture, tap, 0);
        total += w;
        similar += b.x * b.y * pow(facing, 8.0) * saturate(1.0 - 16.0 * apart);
    }
    let scale = select(0.0, 1.0 / total, total > 0.0);
    return Indirect(
        diffuse.rgb * scale * composite.unit,
        specular.rgb * scale * composite.unit,
        diffuse.a * scale,
        specular.a * scale,
        similar,
    );
}

// What Bevy's distance fog lets through over `d` metres (`bevy_pbr::fog`).
fn fog_transmittance(d: f32) -> vec3<f32> {
    let fog = composite.fog;
    var hidden = vec3(0.0);
    switch fog.kind {
        case #{FOG_LINEAR}u: {
            let start = fog.falloff.x;
            let end = fog.falloff.y;
            hidden = vec3(1.0 - saturate((end - d) / (end - start)));
        }
        case #{FOG_EXPONENTIAL}u: { hidden = 1.0 - exp(-d * fog.falloff); }
        case #{FOG_EXPONENTIAL_SQUARED}u: { hidden = 1.0 - exp(-d * fog.falloff * d * fog.falloff); }
        case #{FOG_ATMOSPHERIC}u: { hidden = 1.0 - exp(-d * fog.falloff); }
        default: {}
    }
    return 1.0 - fog.opacity * hidden;
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(in.position.xy - view.viewport.xy);
    let surface = load_surface(pixel);
    if !surface.exists {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }
    let light = upsample(pixel, surface);
    let material = surface.material;
    let n_dot_v = max(dot(surface.normal, surface.to_eye), 1e-4);
    // Small gaps that the cache does not resolve, as Bevy's deferred lighting applies them.
    var diffuse_occlusion = vec3(surface.occlusion);
    var specular_occlusion = surface.occlusion;
    if composite.ssao != 0u {
        let ssao = textureLoad(ssao_texture, pixel, 0).r;
        let alpha = material.roughness * material.roughness;
        diffuse_occlusion = min(diffuse_occlusion, ssao_multibounce(ssao, material.base_color));
        // Lagarde and de Rousiers 2014, "Moving Frostbite to PBR", section 4.10.2.
        specular_occlusion = min(
            specular_occlusion,
            saturate(pow(n_dot_v + ssao, exp2(-16.0 * alpha - 1.0)) - 1.0 + ssao),
        );
    }
    let clear = fog_transmittance(distance(surface.position, view.world_position));
    let scale = composite.strength * view.exposure * clear;
    let diffuse = light.diffuse * diffuse_albedo(material, n_dot_v) * diffuse_occlusion * scale;
    let specular = light.specular * specular_albedo(material, n_dot_v) * specular_occlusion * scale;
    var color = diffuse + specular;
    switch composite.mode {
        case #{VIEW_DIFFUSE}u: { color = diffuse; }
        case #{VIEW_SPECULAR}u: { color = specular; }
        case #{VIEW_IRRADIANCE}u: { color = light.diffuse * view.exposure; }
        case #{VIEW_GATHERED}u: { color = light.diffuse; }
        case #{VIEW_ALBEDO}u: { color = diffuse_color(material); }
        case #{VIEW_NORMAL}u: { color = surface.normal * 0.5 + 0.5; }
        case #{VIEW_ROUGHNESS}u: { color = vec3(material.roughness); }
        case #{VIEW_OCCLUSION}u: { color = diffuse_occlusion; }
        case #{VIEW_MOTION}u: {
            let uv = (vec2<f32>(pixel) + 0.5) / view.viewport.zw;
            let moved = (uv - previous_uv(pixel)) * view.viewport.zw;
            color = saturate(vec3(moved, 0.0) / 32.0 + 0.5);
        }
        case #{VIEW_HISTORY}u: {
            color = vec3((light.frames - 1.0) / f32(max(composite.history_frames, 2u) - 1u));
        }
        case #{VIEW_GATHER}u: {
            color = mix(vec3(0.6, 0.03, 0.03), vec3(0.03, 0.3, 0.05), light.similar);
            if all(pixel % composite.divisor == vec2(composite.divisor / 2u)) {
                color = vec3(1.0);
            }
        }
        case #{VIEW_COVERAGE}u: { color = vec3(light.coverage); }
        default: {}
    }
    // The target's half floats end there.
    return vec4(min(color, vec3(65504.0)), 1.0);
}
