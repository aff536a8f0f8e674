// Indirect light for the ambient cubes of a volume's export.

#import bevy_gi::apply::export::{exported_side, store}
#import bevy_gi::gpu::random::hash3
#import bevy_gi::technique::vct::bindings::cones
#import bevy_gi::technique::vct::lookup::diffuse_cones

@compute @workgroup_size(4, 4, 4)
fn export_vct(@builtin(global_invocation_id) id: vec3<u32>) {
    let s = exported_side(id);
    if !s.exists {
        return;
    }
    // Always the same directions for the same side, or it would flicker.
    let turn = hash3(vec3(s.cube.xy, s.cube.z * 6u + s.side));
    let light = diffuse_cones(s.position, s.normal, cones.bounce_cones, turn, 0.5, true);
    store(s, light.radiance);
}
