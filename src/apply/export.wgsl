// Group 0 of an export: which ambient cubes of a volume, and where their light goes.
#define_import_path bevy_gi::apply::export

struct Export {
    // Corner of the grid of cubes, metres.
    origin: vec3<f32>,
    // Layers of cubes along z that are this modulo `parts` are brought up to date.
    part: u32,
    // Distance of cubes along each axis, metres.
    spacing: vec3<f32>,
    parts: u32,
    // Cubes along each axis.
    dims: vec3<u32>,
    // Nits of a unit of the light that is written.
    unit: f32,
}

@group(0) @binding(0) var<uniform> exported: Export;
@group(0) @binding(1) var ambient_cubes: texture_storage_3d<rgba16float, write>;

// One side of one ambient cube.
struct Side {
    // False if there is nothing to do.
    exists: bool,
    cube: vec3<u32>,
    // 0..6: +x +y +z -x -y -z.
    side: u32,
    // Of the cube, metres.
    position: vec3<f32>,
    // Light that falls on a surface which faces this way is wanted.
    normal: vec3<f32>,
}

// The side for a thread; z runs over the part's layers, for one side after the other.
fn exported_side(id: vec3<u32>) -> Side {
    let layers = (exported.dims.z + exported.parts - 1u) / exported.parts;
    var s: Side;
    s.cube = vec3(id.xy, (id.z % layers) * exported.parts + exported.part);
    s.side = id.z / layers;
    s.exists = all(s.cube < exported.dims) && s.side < 6u;
    s.position = exported.origin + (vec3<f32>(s.cube) + 0.5) * exported.spacing;
    s.normal[s.side % 3u] = select(1.0, -1.0, s.side >= 3u);
    return s;
}

// `E / pi`, given in nits, where Bevy's irradiance volumes have it: axes above each other along z, the
// negative directions behind the positive ones along y.
fn store(s: Side, nits: vec3<f32>) {
    let block = vec3(0u, s.side / 3u, s.side % 3u);
    let value = min(nits / exported.unit, vec3(65504.0));
    textureStore(ambient_cubes, s.cube + block * exported.dims, vec4(value, 1.0));
}
