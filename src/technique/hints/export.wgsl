// Indirect light for the ambient cubes of a volume's export.

#import bevy_gi::apply::export::{exported_side, store}
#import bevy_gi::technique::hints::lookup::diffuse_light

@compute @workgroup_size(4, 4, 4)
fn export_hints(@builtin(global_invocation_id) id: vec3<u32>) {
    let s = exported_side(id);
    if s.exists {
        store(s, diffuse_light(s.position, s.normal));
    }
}
