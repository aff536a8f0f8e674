// Fragment shader of the voxelizer, for StandardMaterial and what extends it.

#import bevy_pbr::{
    pbr_fragment::pbr_input_from_standard_material,
    pbr_functions::alpha_discard,
    pbr_types::{STANDARD_MATERIAL_FLAGS_DOUBLE_SIDED_BIT, STANDARD_MATERIAL_FLAGS_UNLIT_BIT},
    prepass_io::VertexOutput,
}
#import bevy_gi::surface::reflectance::{Material, albedo_mean}
#import bevy_gi::scene::voxels::splat::{
    VoxelSurface, emission_nits, splat, triangle_normal, unlit_nits,
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) {
    // Derivatives and textures first, while control flow is uniform.
    let geometric = triangle_normal(in);
    let pbr = pbr_input_from_standard_material(in, is_front);
    let base_color = alpha_discard(pbr.material, pbr.material.base_color);

    var surface: VoxelSurface;
    let material = pbr.material;
    surface.albedo = albedo_mean(Material(
        saturate(base_color.rgb),
        saturate(material.perceptual_roughness),
        saturate(material.metallic),
        material.reflectance,
    ));
    surface.emission = emission_nits(pbr.material.emissive);
    surface.double_sided = (pbr.material.flags & STANDARD_MATERIAL_FLAGS_DOUBLE_SIDED_BIT) != 0u;
    if (pbr.material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) != 0u {
        surface.albedo = vec3(0.0);
        surface.emission = unlit_nits(base_color.rgb);
    }
    splat(in, is_front, geometric, surface);
}
