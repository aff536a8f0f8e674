// Indirect light of each gathered pixel.

#import bevy_gi::apply::gather::{begin, gather, store}
#import bevy_gi::gpu::random::{advance, gradient_noise}
#import bevy_gi::surface::reflectance::specular_matters
#import bevy_gi::technique::vct::bindings::cones
#import bevy_gi::technique::vct::lookup::{diffuse_cones, specular_cone}

@compute @workgroup_size(8, 8)
fn gather_vct(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = begin(id.xy);
    if !pixel.exists {
        return;
    }
    let surface = pixel.surface;
    let noise = gradient_noise(vec2<f32>(id.xy));
    let random = advance(vec2(noise, fract(noise * 7.31)), gather.frame);
    let turn = random.x;
    let jitter = random.y;
    let with_sky = gather.with_sky != 0u;
    let diffuse = diffuse_cones(surface.position, surface.normal, cones.cones, turn, jitter, with_sky);
    var specular = vec3(0.0);
    if cones.specular != 0u && specular_matters(surface.material) {
        let mirror = reflect(-surface.to_eye, surface.normal);
        specular = specular_cone(surface.position, surface.normal, mirror, surface.material.roughness, jitter, with_sky);
    }
    store(id.xy, pixel.weight, diffuse.radiance, specular);
}
