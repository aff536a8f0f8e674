// What covers what in cells of 2x2x2, each seen from six sides.
#define_import_path bevy_gi::scene::opacity::cells

// Cosine between a surface's normal and the way back of what travels along `direction`
// (0..6: +x -x +y -y +z -z).
fn facing(normal: vec3<f32>, direction: u32) -> f32 {
    let axis = direction / 2u;
    return select(normal[axis], -normal[axis], (direction & 1u) == 0u);
}

// Part of a voxel that its surface covers. One that is met edge-on covers nothing; one that is seen from behind is
// not there, as with back-face culling, unless both its sides are. (A normal is stored with 12 bits, and a tenth of a
// percent of a hot spot is a lot of light: hence the 0.05.)
fn coverage(facing: f32, two_sided: bool) -> f32 {
    if facing < 0.0 && !two_sided {
        return 0.0;
    }
    return saturate(2.0 * abs(facing) - 0.05);
}

// Of the 2x2x2 cells of a coarser one, numbered x + 2 y + 4 z, the two in row `i` of four along `direction`: the
// one that is met first, and the other.
fn row(direction: u32, i: u32) -> vec2<u32> {
    let axis = direction / 2u;
    let step = 1u << axis;
    let u = 1u << ((axis + 1u) % 3u);
    let v = 1u << ((axis + 2u) % 3u);
    let base = (i & 1u) * u + (i >> 1u) * v;
    // What goes the positive way meets the lower cell first.
    let forward = (direction & 1u) == 0u;
    return select(vec2(base + step, base), vec2(base, base + step), forward);
}

// Which of 2x2x2 the `i`-th is, x first; bits above the third do not count.
fn octant(i: u32) -> vec3<u32> {
    return vec3(i & 1u, (i >> 1u) & 1u, (i >> 2u) & 1u);
}
