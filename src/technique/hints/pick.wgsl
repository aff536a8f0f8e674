// The surface that a line of sight meets, and the hint that lights it most.

#import bevy_gi::scene::bindings::volume
#import bevy_gi::scene::probes::bindings::probes
#import bevy_gi::scene::probes::lookup::{probe_corner, probes_around}
#import bevy_gi::scene::probes::types::probe_index
#import bevy_gi::scene::voxels::pool::load_voxel
#import bevy_gi::scene::voxels::trace::trace_voxels
#import bevy_gi::technique::hints::types::{HintsView, Picked}

@group(0) @binding(3) var<storage, read_write> picked: Picked;
@group(0) @binding(4) var<uniform> shown: HintsView;

@compute @workgroup_size(1)
fn pick() {
    var found = Picked(shown.pick_from, 1u, vec3(0.0, 1.0, 0.0), 0u);
    let way = shown.pick_to - shown.pick_from;
    if any(way != vec3(0.0)) {
        let dir = normalize(way);
        let hit = trace_voxels(shown.pick_from, dir, 1e9, volume);
        found.exists = u32(hit.exists);
        if hit.exists {
            let n = load_voxel(hit.index).normal;
            found.position = shown.pick_from + dir * hit.distance;
            found.normal = select(n, -n, dot(n, dir) > 0.0);
        }
    }
    let around = probes_around(found.position, found.normal);
    var most = -1.0;
    for (var i = 0u; i < 8u; i++) {
        let corner = probe_corner(around, i);
        if corner.weight > most {
            most = corner.weight;
            found.probe = probe_index(corner.probe, probes.dims);
        }
    }
    picked = found;
}
