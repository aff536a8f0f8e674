// Where the picked hint takes its samples of each reflective shadow map.

#import bevy_gi::debug::types::Mark
#import bevy_gi::scene::probes::bindings::{offsets, probes}
#import bevy_gi::scene::probes::types::{cell_center, probe_coords}
#import bevy_gi::scene::light_maps::lookup::{maps, vpls}
#import bevy_gi::scene::light_maps::types::vpl_map
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::disk::{disk_center, disk_sample, flux_to_share, map_samples}
#import bevy_gi::technique::hints::types::{HintsView, Picked}
#import bevy_render::view::ndc_to_uv

@group(0) @binding(0) var<storage, read_write> marks: array<Mark>;
@group(0) @binding(1) var<uniform> shown: HintsView;
@group(0) @binding(2) var<storage, read> picked: Picked;

// The texel that a virtual point light stands for.
fn vpl_mark(i: u32) -> Mark {
    let vpl = vpls[hints.first_vpl + (hints.first_sample + i) % max(hints.vpls, 1u)];
    let m = vpl_map(vpl);
    if m >= maps.count {
        return Mark(vec2(0.0), -1.0, 0u);
    }
    let clip = maps.array[m].clip_from_world * vec4(vpl.position, 1.0);
    return Mark(ndc_to_uv(clip.xy / clip.w), 0.0, m);
}

// A disk, or a sample in it; disks come first.
fn disk_mark(i: u32, p: vec3<f32>) -> Mark {
    if i < maps.count {
        return Mark(disk_center(i, p), hints.spread, i);
    }
    let total = flux_to_share();
    var rest = i - maps.count;
    for (var m = 0u; m < maps.count; m++) {
        let each = map_samples(m, total);
        if rest < each {
            return Mark(disk_sample(m, rest, picked.probe, disk_center(m, p)), 0.0, m);
        }
        rest -= each;
    }
    return Mark(vec2(0.0), -1.0, 0u);
}

// One thread a mark.
@compute @workgroup_size(64)
fn mark_samples(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= shown.marks {
        return;
    }
    let at = probe_coords(picked.probe, probes.dims);
    let p = cell_center(at, probes) + offsets[picked.probe].xyz;
    var mark = Mark(vec2(0.0), -1.0, 0u);
    if picked.exists != 0u && hints.sampling != #{SAMPLE_VPLS}u {
        mark = disk_mark(id.x, p);
    } else if picked.exists != 0u && id.x < hints.samples {
        mark = vpl_mark(id.x);
    }
    marks[id.x] = mark;
}
