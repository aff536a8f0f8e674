// How light decreases on its way, as Bevy has it.
#define_import_path bevy_gi::scene::world::falloff

// The window that ends the light of a lamp at its range (`getDistanceAttenuation`), 0..1.
fn range_window(distance_squared: f32, range: f32) -> f32 {
    let factor = distance_squared / max(range * range, 1e-4);
    let window = saturate(1.0 - factor * factor);
    return window * window;
}

// The windowed inverse square, 1/m^2.
fn distance_attenuation(distance_squared: f32, range: f32) -> f32 {
    return range_window(distance_squared, range) / max(distance_squared, 1e-4);
}

// The cone of a spot light, 0..1, where a direction has that cosine to its axis.
fn spot_attenuation(cosine: f32, cos_inner: f32, cos_outer: f32) -> f32 {
    let cone = saturate((cosine - cos_outer) / max(cos_inner - cos_outer, 1e-4));
    return cone * cone;
}
