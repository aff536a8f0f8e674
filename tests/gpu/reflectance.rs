//! What bounces and the composite reflect is what Bevy's lobes reflect: functions of the shaders against sums over
//! directions.

use std::f32::consts::PI;

use super::support::{app, evaluate};

const ROUGHNESS: [f32; 6] = [0.1, 0.3, 0.5, 0.7, 0.85, 1.0];
const COSINES: [f32; 4] = [0.15, 0.4, 0.7, 0.95];

/// Part of light from everywhere that is reflected at a cosine: by Burley's lobe over a diffuse colour, and by a GGX lobe
/// of that F0 with Bevy's compensation for several bounces.
fn lobes(roughness: f32, cosine: f32, f0: f32) -> [f32; 2] {
    const SIDE: u32 = 512;
    let alpha = roughness.max(0.089).powi(2);
    let a2 = alpha * alpha;
    let f90 = (50.0 * f0).min(1.0);
    let lambda = |c: f32| (c * c * (1.0 - a2) + a2).sqrt();
    let wo = [(1.0 - cosine * cosine).sqrt(), 0.0, cosine];
    let mut sums = [0.0f64; 2];
    // Half vectors by the density of GGX for the specular lobe, directions by their cosine for the diffuse one.
    for i in 0..SIDE * SIDE {
        let u = ((i % SIDE) as f32 + 0.5) / SIDE as f32;
        let phi = 2.0 * PI * ((i / SIDE) as f32 + 0.5) / SIDE as f32;
        let around = |z: f32| {
            let r = (1.0 - z * z).max(0.0).sqrt();
            [r * phi.cos(), r * phi.sin(), z]
        };
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

        let wi = around(u.sqrt());
        let k = 0.5 + roughness.powi(2) * (1.0 + dot(wi, wo)) - 1.0;
        let schlick = |c: f32| 1.0 + k * (1.0 - c).powi(5);
        sums[0] += f64::from(schlick(wi[2]) * schlick(cosine));

        let h = around(((1.0 - u) / (1.0 + (a2 - 1.0) * u)).sqrt());
        let l_dot_h = dot(wo, h);
        let z = 2.0 * l_dot_h * h[2] - cosine;
        if l_dot_h > 0.0 && z > 0.0 {
            let visibility = 0.5 / (z * lambda(cosine) + cosine * lambda(z));
            let fresnel = f0 + (f90 - f0) * (1.0 - l_dot_h).powi(5);
            // Over the density of the reflected direction, D n.h / (4 l.h).
            sums[1] += f64::from(fresnel * visibility * z * 4.0 * l_dot_h / h[2]);
        }
    }
    let mean = sums.map(|sum| (sum / f64::from(SIDE * SIDE)) as f32);
    // Bevy's `F_AB`.
    let (x, y) = (1.0 - roughness, 0.0425 - 0.0275 * roughness);
    let a004 = (x * x).min((-9.28 * cosine).exp2()) * x + y;
    let sum = (-1.04 * a004 + 1.04 - 0.572 * roughness) + (1.04 * a004 - 0.04 + 0.022 * roughness);
    [mean[0], mean[1] * (1.0 + f0 * (1.0 / sum - 1.0))]
}

/// The same, seen from everywhere: over the cosine with Gauss' eight points.
fn mean_lobes(roughness: f32, f0: f32) -> [f32; 2] {
    const POINTS: [(f32, f32); 4] = [
        (0.18343464, 0.36268378),
        (0.5255324, 0.31370665),
        (0.7966665, 0.22238103),
        (0.96028986, 0.10122854),
    ];
    let mut sums = [0.0; 2];
    for (x, weight) in POINTS {
        for x in [x, -x] {
            let c = 0.5 + 0.5 * x;
            let at = lobes(roughness, c, f0);
            sums = [0, 1].map(|i| sums[i] + weight * c * at[i]);
        }
    }
    sums
}

/// F0 of a dielectric with glTF's reflectance, and of a metal.
const F0: [f32; 2] = [0.04, 0.7];

#[test]
fn reflectance_is_that_of_bevys_lobes() {
    let mut headless = app();
    let list = |values: &[f32]| {
        values
            .iter()
            .map(|v| format!("{v:?}, "))
            .collect::<String>()
    };
    let code = format!(
        "#import bevy_gi::surface::reflectance::{{
            Material, burley, burley_mean, specular_albedo, specular_albedo_mean,
        }}
        fn value(i: u32) -> f32 {{
            var roughness = array<f32, 6>({});
            var cosines = array<f32, 4>({});
            let r = roughness[i / 4u % 6u];
            let c = cosines[i % 4u];
            var m = Material(vec3(0.7), r, 0.0, vec3(0.5));
            if i / 24u % 2u == 1u {{ m.metallic = 1.0; }}
            switch i / 48u {{
                case 0u: {{ return burley(r, c); }}
                case 1u: {{ return specular_albedo(m, c).r; }}
                case 2u: {{ return burley_mean(r); }}
                default: {{ return specular_albedo_mean(m).r; }}
            }}
        }}",
        list(&ROUGHNESS),
        list(&COSINES)
    );
    let found = evaluate(&mut headless, &code, 4 * 48);
    let found = |what: usize, metal: usize, r: usize, c: usize| {
        found[((what * 2 + metal) * ROUGHNESS.len() + r) * COSINES.len() + c]
    };
    for (metal, f0) in F0.into_iter().enumerate() {
        for (r, roughness) in ROUGHNESS.into_iter().enumerate() {
            let expected = mean_lobes(roughness, f0);
            let got = [found(2, metal, r, 0), found(3, metal, r, 0)];
            // Burley's lobe is exact, but for eight points; that of GGX a fit.
            assert!(
                (got[0] - expected[0]).abs() < 2e-3
                    && (got[1] - expected[1]).abs() < 0.01 * f0.max(0.3),
                "F0 {f0}, roughness {roughness}: {got:?}, {expected:?} expected"
            );
            for (c, cosine) in COSINES.into_iter().enumerate() {
                let expected = lobes(roughness, cosine, f0);
                let got = [found(0, metal, r, c), found(1, metal, r, c)];
                assert!(
                    (got[0] - expected[0]).abs() < 1e-3 && (got[1] - expected[1]).abs() < 0.035,
                    "F0 {f0}, roughness {roughness}, cosine {cosine}: {got:?}, {expected:?} expected"
                );
            }
        }
    }
}

/// A number is stored as one of its two neighbours among half floats, and as itself in the mean; half floats stay.
#[test]
fn halves_are_rounded_at_random_without_bias() {
    const TURNS: u32 = 256;
    let mut headless = app();
    let code = format!(
        "#import bevy_gi::gpu::pack::half_at_random
        fn value(i: u32) -> f32 {{
            let x = select(1.00033, 0.75, i >= {TURNS}u);
            return half_at_random(vec3(x), (f32(i % {TURNS}u) + 0.5) / {TURNS}.0).x;
        }}"
    );
    let found = evaluate(&mut headless, &code, 2 * TURNS);
    let (turns, exact) = found.split_at(TURNS as usize);
    let ulp = 1.0 / 1024.0;
    assert!(turns.iter().all(|x| *x == 1.0 || *x == 1.0 + ulp));
    let mean = turns.iter().sum::<f32>() / TURNS as f32;
    assert!((mean - 1.00033).abs() < ulp / TURNS as f32, "{mean}");
    assert!(exact.iter().all(|x| *x == 0.75), "{exact:?}");
}
