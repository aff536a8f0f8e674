// Virtual point lights of each volume: each finds a texel with a probability in proportion to its luminous flux, among those
// of all lights or of its own, the more the nearer the light is to the volume.

#import bevy_gi::gpu::color::luminance
#import bevy_gi::gpu::row::{LANES, row_groups}
#import bevy_gi::scene::types::LightMaps
#import bevy_gi::scene::light_maps::types::{
    Vpl, luminous_flux, pack_vpl_normal, texel_area, unpack_lit_surface,
}
#import bevy_render::maths::PI

struct Vpls {
    count: u32,
    share: u32,
}

@group(0) @binding(0) var<uniform> vpls_: Vpls;
@group(0) @binding(1) var<storage, read> maps: LightMaps;
@group(0) @binding(2) var texels: texture_2d_array<u32>;
@group(0) @binding(3) var flux: texture_2d_array<f32>;
// By volume.
@group(0) @binding(4) var<storage, read_write> vpls: array<Vpl>;
// By volume, then by map: what all maps up to this one are worth.
@group(0) @binding(5) var<storage, read_write> sums: array<f32>;
// By volume, then by map: how much a map's light matters to a volume.
@group(0) @binding(6) var<storage, read> weights: array<f32>;

fn map_flux(layer: u32) -> f32 {
    return luminous_flux(maps.array[layer], flux);
}

// How many times its flux a map is worth to a volume.
fn worth(volume: u32, layer: u32) -> f32 {
    let weight = weights[volume * maps.count + layer];
    if vpls_.share != #{SHARE_EVEN}u {
        return weight;
    }
    // All maps of a light together are worth as much as those of any other.
    let light = maps.array[layer].light;
    var first = layer;
    while first > 0u && maps.array[first - 1u].light == light {
        first--;
    }
    var sum = 0.0;
    for (var i = first; i < maps.count && maps.array[i].light == light; i++) {
        sum += map_flux(i);
    }
    return select(0.0, weight / sum, sum > 0.0);
}

var<workgroup> totals: array<f32, LANES>;

// One workgroup a volume: sums up what maps are worth to it.
@compute @workgroup_size(LANES)
fn weigh(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let volume = group.x;
    let each = row_groups(maps.count);
    let first = lane * each;
    let end = min(first + each, maps.count);
    var sum = 0.0;
    for (var i = first; i < end; i++) {
        sum += map_flux(i) * worth(volume, i);
    }
    totals[lane] = sum;
    workgroupBarrier();
    sum = 0.0;
    for (var i = 0u; i < lane; i++) {
        sum += totals[i];
    }
    for (var i = first; i < end; i++) {
        sum += map_flux(i) * worth(volume, i);
        sums[volume * maps.count + i] = sum;
    }
}

// The first map up to which all are worth more than `share`.
fn find_map(volume: u32, share: f32) -> u32 {
    var low = 0u;
    var high = maps.count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if sums[volume * maps.count + middle] > share {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

@compute @workgroup_size(LANES)
fn choose(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= vpls_.count || maps.count == 0u {
        return;
    }
    let volume = id.y;
    let index = volume * vpls_.count + id.x;
    var none: Vpl;
    let total = sums[(volume + 1u) * maps.count - 1u];
    if !(total > 0.0) {
        vpls[index] = none;
        return;
    }
    // The total, cut into equal shares; each light stands for one, and starts in the middle of it. Which
    // share is which is mixed, so that any run of them comes from everywhere.
    let share = (reverseBits(id.x) >> (countLeadingZeros(vpls_.count) + 1u)) % vpls_.count;
    let at_share = (f32(share) + 0.5) / f32(vpls_.count) * total;
    let layer = find_map(volume, at_share);
    let map = maps.array[layer];
    let all_flux = map_flux(layer);
    let worth_ = worth(volume, layer);
    if !(all_flux * worth_ > 0.0) {
        vpls[index] = none;
        return;
    }
    var before = 0.0;
    if layer > 0u {
        before = sums[volume * maps.count + layer - 1u];
    }
    // Where in the map, of its whole flux in the texture's unit.
    let level = i32(firstTrailingBit(map.size));
    let top = textureLoad(flux, map.origin >> vec2(u32(level)), map.page, level).x;
    var rest = saturate((at_share - before) / (all_flux * worth_)) * top;
    // Down the levels: into the quarter where the rest lies.
    var at = vec2(0u);
    for (var l = level - 1; l >= 0; l--) {
        at *= 2u;
        var best = vec2(0u);
        for (var q = 0u; q < 4u; q++) {
            let quarter = vec2(q & 1u, q >> 1u);
            let here = textureLoad(flux, (map.origin >> vec2(u32(l))) + at + quarter, map.page, l).x;
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
    let words = textureLoad(texels, map.origin + at, map.page, 0);
    let texel = unpack_lit_surface(map, at, words);
    let luminous = luminance(texel.flux);
    if !texel.exists || !(luminous > 0.0) {
        vpls[index] = none;
        return;
    }
    // What the texel's probability took away, its weight gives back: all that are worth the same carry the same.
    let carried = total / (worth_ * f32(vpls_.count));
    var vpl: Vpl;
    vpl.position = texel.position;
    vpl.flux = texel.flux * (carried / luminous);
    vpl.normal = pack_vpl_normal(texel.normal, layer);
    // The patch that reflects as much: texels next to it are about as bright.
    vpl.radius_squared = texel_area(map, texel.position, texel.normal) * (carried / luminous) / PI;
    vpls[index] = vpl;
}
