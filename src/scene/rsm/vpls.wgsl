// Virtual point lights: each finds a texel with a probability in proportion to its luminous flux, among those of
// all lights or of its own.

#import bevy_gi::scene::rsm::types::{
    LUMINANCE, RsmMap, RsmMaps, Vpl, luminous_flux, texel_area, unpack_rsm,
}

struct Vpls {
    count: u32,
    share: u32,
}

const PI: f32 = 3.14159265359;

@group(0) @binding(0) var<uniform> vpls_: Vpls;
@group(0) @binding(1) var<storage, read> maps: RsmMaps;
@group(0) @binding(2) var texels: texture_2d_array<u32>;
@group(0) @binding(3) var flux: texture_2d_array<f32>;
@group(0) @binding(4) var<storage, read_write> vpls: array<Vpl>;

fn map_flux(layer: u32) -> f32 {
    return luminous_flux(maps.array[layer], layer, flux);
}

// Flux of all maps of a light, if `layer` is the first of them; of the others `before`.
fn light_flux(layer: u32, before: f32) -> f32 {
    let light = maps.array[layer].light;
    if layer > 0u && maps.array[layer - 1u].light == light {
        return before;
    }
    var sum = 0.0;
    for (var i = layer; i < maps.count && maps.array[i].light == light; i++) {
        sum += map_flux(i);
    }
    return max(sum, 1e-20);
}

@compute @workgroup_size(64)
fn choose(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= vpls_.count {
        return;
    }
    var none: Vpl;
    let even = vpls_.share == #{SHARE_EVEN}u;
    // Lights weigh the same, or what they weigh is their flux.
    var unit = 1.0;
    var total = 0.0;
    for (var i = 0u; i < maps.count; i++) {
        if even {
            unit = light_flux(i, unit);
        }
        total += map_flux(i) / unit;
    }
    if !(total > 0.0) {
        vpls[id.x] = none;
        return;
    }
    // The total, cut into equal shares; each light stands for one, and starts in the middle of it. Which
    // share is which is mixed, so that any run of them comes from everywhere.
    let share = (reverseBits(id.x) >> (countLeadingZeros(vpls_.count) + 1u)) % vpls_.count;
    var rest = (f32(share) + 0.5) / f32(vpls_.count) * total;
    var layer = 0u;
    for (; layer < maps.count; layer++) {
        if even {
            unit = light_flux(layer, unit);
        }
        let here = map_flux(layer) / unit;
        if rest < here || layer + 1u == maps.count {
            break;
        }
        rest -= here;
    }
    rest *= unit;
    let map = maps.array[layer];
    // Down the levels: into the quarter where the rest lies.
    rest /= max(dot(map.color, LUMINANCE), 1e-20);
    var at = vec2(0);
    for (var level = i32(firstTrailingBit(map.size)) - 1; level >= 0; level--) {
        at *= 2;
        var best = vec2(0);
        for (var q = 0; q < 4; q++) {
            let quarter = vec2(q & 1, q >> 1);
            let here = textureLoad(flux, at + quarter, i32(layer), level).x;
            if here > 0.0 {
                best = quarter;
                if rest < here {
                    break;
                }
            }
            rest -= here;
        }
        rest = max(rest, 0.0);
        at += best;
    }
    let words = textureLoad(texels, at, i32(layer), 0);
    let texel = unpack_rsm(map, vec2<u32>(at), words);
    let luminous = dot(texel.flux, LUMINANCE);
    if !texel.exists || !(luminous > 0.0) {
        vpls[id.x] = none;
        return;
    }
    // All, or all of a light, carry the same: what the texel's probability took away, its weight gives back.
    let carried = total * unit / f32(vpls_.count);
    var vpl: Vpl;
    vpl.position = texel.position;
    vpl.flux = texel.flux * (carried / luminous);
    vpl.normal = (words.y & 0xffffffu) | (layer + 1u) << 24u;
    // The patch that reflects as much: texels next to it are about as bright.
    vpl.radius_squared = texel_area(map, texel.position, texel.normal) * (carried / luminous) / PI;
    vpls[id.x] = vpl;
}
