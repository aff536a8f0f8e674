// Indirect light of each gathered pixel.

#import bevy_gi::apply::gather::{begin, store}
#import bevy_gi::surface::reflectance::specular_matters
#import bevy_gi::technique::hints::bindings::hints
#import bevy_gi::technique::hints::lookup::{HintLight, all_light, diffuse_light}

@compute @workgroup_size(8, 8)
fn gather_hints(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = begin(id.xy);
    if !pixel.exists {
        return;
    }
    let surface = pixel.surface;
    var light: HintLight;
    if hints.specular != 0u && specular_matters(surface.material) {
        let mirror = reflect(-surface.to_eye, surface.normal);
        light = all_light(surface.position, surface.normal, mirror, surface.material.roughness);
    } else {
        light.diffuse = diffuse_light(surface.position, surface.normal);
    }
    store(id.xy, pixel.weight, light.diffuse, light.specular);
}
