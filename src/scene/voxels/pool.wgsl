// The surfaces of voxels. Binding 2 of group 0 of passes that read them.
#define_import_path bevy_gi::scene::voxels::pool

#import bevy_gi::scene::voxels::types::{Voxel, WORDS, unpack_voxel}

@group(0) @binding(2) var<storage, read> pool: array<u32>;

// The surface of a voxel of the pool.
fn load_voxel(index: u32) -> Voxel {
    let at = index * WORDS;
    return unpack_voxel(vec3(pool[at], pool[at + 1u], pool[at + 2u]));
}
