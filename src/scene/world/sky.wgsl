// The light from outside of the scene.
#define_import_path bevy_gi::scene::world::sky

#import bevy_gi::scene::bindings::{sky, sky_map, sky_sampler}

// Luminance that comes from direction `dir`, nits, averaged over a cone whose half angle has the
// tangent `tan_half`.
fn sky_radiance(dir: vec3<f32>, tan_half: f32) -> vec3<f32> {
    // A cone covers about 2 tan / (pi/2) of a cube face's width: choose the level whose texels do.
    let level = clamp(sky.levels - 1.0 + log2(max(tan_half, 1e-3)), 0.0, sky.levels - 1.0);
    let d = rotate(sky.rotation, dir);
    let map = textureSampleLevel(sky_map, sky_sampler, vec3(d.xy, -d.z), level).rgb;
    return sky.constant + max(map, vec3(0.0)) * sky.brightness;
}

// `v` rotated by the unit quaternion `q`.
fn rotate(q: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}
