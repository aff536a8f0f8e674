// Fragment shader of the voxelizer for materials that nothing is known of: grey, and not see-through.

#import bevy_pbr::prepass_io::VertexOutput
#import bevy_gi::scene::voxels::splat::{VoxelSurface, splat, triangle_normal}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) {
    splat(in, is_front, triangle_normal(in), VoxelSurface(vec3(0.5), vec3(0.0), false));
}
