//! How surfaces reflect: Bevy's own model (`bevy_pbr::lighting`), as a BRDF that can be sampled.
//!
//! Burley's diffuse lobe (2012) plus one GGX lobe with height-correlated Smith masking, Schlick's
//! Fresnel term with Bevy's `f90`, and its compensation for multiple scattering. The two lobes are
//! added, as Bevy adds them: no energy is taken from the diffuse lobe for what the specular one
//! reflects.

use std::f32::consts::PI;

use bevy::math::{Mat3, Vec2, Vec3};

use super::settings::{DiffuseModel, ReferenceSettings, SpecularModel};

/// The BRDF of a point of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bsdf {
    /// From tangent space, z along the normal.
    world_from_tangent: Mat3,
    /// Unit vector to where the light goes, in tangent space.
    wo: Vec3,
    diffuse: Vec3,
    f0: Vec3,
    f90: f32,
    /// Roughness of the microfacets: perceptual roughness squared.
    alpha: f32,
    /// Factor that brings back what a single bounce between microfacets loses.
    multiscatter: Vec3,
    model: DiffuseModel,
    /// Probability of sampling the specular lobe.
    specular_chance: f32,
}

/// The two lobes of a BRDF times the cosine of the incoming light, and the density of sampling.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Response {
    pub diffuse: Vec3,
    pub specular: Vec3,
    /// Per steradian.
    pub pdf: f32,
}

impl Response {
    pub fn total(&self) -> Vec3 {
        self.diffuse + self.specular
    }
}

/// What a material is at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Linear.
    pub base_color: Vec3,
    pub perceptual_roughness: f32,
    pub metallic: f32,
    /// As `StandardMaterial::reflectance`, tinted.
    pub reflectance: Vec3,
}

impl Surface {
    pub fn diffuse_albedo(&self) -> Vec3 {
        self.base_color * (1.0 - self.metallic)
    }

    fn f0(&self) -> Vec3 {
        let dielectric = 0.16 * self.reflectance * self.reflectance;
        dielectric.lerp(self.base_color, self.metallic)
    }
}

/// Bevy's fit of the reflectance of the GGX lobe (`F_AB`, Karis 2014): scale and offset of F0.
fn f_ab(perceptual_roughness: f32, n_dot_v: f32) -> Vec2 {
    let r = |c0: f32, c1: f32| perceptual_roughness * c0 + c1;
    let (x, y, z, w) = (
        r(-1.0, 1.0),
        r(-0.0275, 0.0425),
        r(-0.572, 1.04),
        r(0.022, -0.04),
    );
    let a004 = (x * x).min((-9.28 * n_dot_v).exp2()) * x + y;
    Vec2::new(-1.04 * a004 + z, 1.04 * a004 + w).max(Vec2::splat(0.00005))
}

impl Bsdf {
    /// The BRDF of `surface` with `normal`, for light that leaves along `wo` (unit vectors), with the lobes
    /// that `settings` name.
    pub fn new(surface: &Surface, normal: Vec3, wo: Vec3, settings: &ReferenceSettings) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let world_from_tangent = Mat3::from_cols(tangent, bitangent, normal);
        let mut wo = world_from_tangent.transpose() * wo;
        // Interpolated and mapped normals may face away; Bevy clamps the cosine likewise.
        wo.z = wo.z.max(1e-4);
        let wo = wo.normalize();
        let f0 = surface.f0();
        let f90 = (f0.element_sum() * 50.0 * 0.33).min(1.0);
        let diffuse = surface.diffuse_albedo();
        // Without F0 there is no specular lobe.
        let (specular, multiscatter) = if f0 == Vec3::ZERO {
            (Vec3::ZERO, Vec3::ONE)
        } else {
            let ab = f_ab(surface.perceptual_roughness, wo.z);
            let multiscatter = match settings.specular {
                SpecularModel::Bevy => Vec3::ONE + f0 * (1.0 / (ab.x + ab.y) - 1.0),
                SpecularModel::SingleScattering => Vec3::ONE,
            };
            (f0 * ab.x + Vec3::splat(f90 * ab.y), multiscatter)
        };
        let (d, s) = (diffuse.element_sum(), specular.element_sum());
        let specular_chance = match (d > 0.0, s > 1e-4) {
            (true, true) => (s / (s + d)).clamp(0.1, 0.9),
            (false, true) => 1.0,
            _ => 0.0,
        };
        Self {
            world_from_tangent,
            wo,
            diffuse,
            f0,
            f90,
            alpha: surface.perceptual_roughness.clamp(0.089, 1.0).powi(2),
            multiscatter,
            model: settings.diffuse,
            specular_chance,
        }
    }

    /// Whether any light is reflected.
    pub fn is_black(&self) -> bool {
        self.diffuse == Vec3::ZERO && self.specular_chance == 0.0
    }

    /// Response to light that comes from `wi`, a unit vector in the world.
    pub fn evaluate(&self, wi: Vec3) -> Response {
        self.respond(self.world_from_tangent.transpose() * wi)
    }

    fn respond(&self, wi: Vec3) -> Response {
        let wo = self.wo;
        if wi.z <= 0.0 {
            return Response::default();
        }
        // Squared cosine between either direction and the half vector.
        let l_dot_h2 = (0.5 + 0.5 * wi.dot(wo)).clamp(0.0, 1.0);
        let mut response = Response::default();
        if self.specular_chance < 1.0 {
            let lobe = match self.model {
                DiffuseModel::Bevy => {
                    let f90 = 0.5 + 2.0 * self.alpha * l_dot_h2;
                    let schlick = |cos: f32| 1.0 + (f90 - 1.0) * (1.0 - cos).powi(5);
                    schlick(wi.z) * schlick(wo.z)
                }
                DiffuseModel::Lambert => 1.0,
            };
            response.diffuse = self.diffuse * (lobe / PI * wi.z);
            response.pdf += (1.0 - self.specular_chance) * wi.z / PI;
        }
        if self.specular_chance > 0.0 {
            let half = (wi + wo).normalize();
            let a2 = self.alpha * self.alpha;
            let d = {
                let k = 1.0 + half.z * half.z * (a2 - 1.0);
                a2 / (PI * k * k)
            };
            let lambda = |cos: f32| (cos * cos * (1.0 - a2) + a2).sqrt();
            let v = 0.5 / (wi.z * lambda(wo.z) + wo.z * lambda(wi.z));
            let f = self.f0 + (Vec3::splat(self.f90) - self.f0) * (1.0 - l_dot_h2.sqrt()).powi(5);
            response.specular = f * self.multiscatter * (d * v * wi.z);
            // Density of visible normals over the Jacobian of the reflection (Heitz 2018, eq. 3, 17).
            let g1 = 2.0 * wo.z / (wo.z + lambda(wo.z));
            response.pdf += self.specular_chance * g1 * d / (4.0 * wo.z);
        }
        response
    }

    /// A direction in the world from which light may come, and the response to it.
    pub fn sample(&self, u: [f32; 3]) -> Option<(Vec3, Response)> {
        let wi = if u[2] < self.specular_chance {
            let h = self.visible_normal(u[0], u[1]);
            2.0 * self.wo.dot(h) * h - self.wo
        } else {
            let r = u[0].sqrt();
            let (sin, cos) = (2.0 * PI * u[1]).sin_cos();
            Vec3::new(r * cos, r * sin, (1.0 - u[0]).max(0.0).sqrt())
        };
        let response = self.respond(wi);
        (response.pdf > 0.0).then(|| (self.world_from_tangent * wi, response))
    }

    /// A normal of the microfacets that `wo` sees (Heitz 2018, "Sampling the GGX distribution of visible
    /// normals", listing 1).
    fn visible_normal(&self, u1: f32, u2: f32) -> Vec3 {
        let a = self.alpha;
        let v = Vec3::new(a * self.wo.x, a * self.wo.y, self.wo.z).normalize();
        let length2 = v.x * v.x + v.y * v.y;
        let t1 = if length2 > 0.0 {
            Vec3::new(-v.y, v.x, 0.0) / length2.sqrt()
        } else {
            Vec3::X
        };
        let t2 = v.cross(t1);
        let r = u1.sqrt();
        let (sin, cos) = (2.0 * PI * u2).sin_cos();
        let p1 = r * cos;
        let s = 0.5 * (1.0 + v.z);
        let p2 = (1.0 - s) * (1.0 - p1 * p1).max(0.0).sqrt() + s * r * sin;
        let h = p1 * t1 + p2 * t2 + (1.0 - p1 * p1 - p2 * p2).max(0.0).sqrt() * v;
        Vec3::new(a * h.x, a * h.y, h.z.max(0.0)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SINGLE: ReferenceSettings = ReferenceSettings {
        max_bounces: 64,
        seed: 0,
        diffuse: DiffuseModel::Bevy,
        specular: SpecularModel::SingleScattering,
        show_sky: true,
    };

    const WHITE_METAL: Surface = Surface {
        base_color: Vec3::ONE,
        perceptual_roughness: 0.5,
        metallic: 1.0,
        reflectance: Vec3::splat(0.5),
    };

    /// Mean of `f` over a regular grid of the sampler's square.
    fn mean(n: u32, f: impl Fn(f32, f32) -> f32) -> f32 {
        let at = |i: u32| (i as f32 + 0.5) / n as f32;
        let sum: f64 = (0..n * n).map(|i| f64::from(f(at(i % n), at(i / n)))).sum();
        (sum / f64::from(n * n)) as f32
    }

    /// A white metal without the factor for multiple scattering reflects what its fit says it does, and
    /// with it everything: a lobe that loses or makes energy would show here.
    #[test]
    fn the_ggx_lobe_conserves_energy() {
        for roughness in [0.1, 0.3, 0.5, 0.8, 1.0] {
            for cos in [0.2f32, 0.5, 0.9] {
                let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                let surface = Surface {
                    perceptual_roughness: roughness,
                    ..WHITE_METAL
                };
                let bsdf = Bsdf::new(&surface, Vec3::Z, wo, &SINGLE);
                // By sampling: the mean of response over density.
                let sampled = mean(256, |u, v| match bsdf.sample([u, v, 0.5]) {
                    Some((_, response)) => response.specular.x / response.pdf,
                    None => 0.0,
                });
                // By quadrature over the hemisphere, without the sampling's own formulas.
                let n = if roughness < 0.2 { 4096 } else { 512 };
                let quadrature = mean(n, |u, v| {
                    let z = u;
                    let r = (1.0 - z * z).sqrt();
                    let (sin, cos) = (2.0 * PI * v).sin_cos();
                    let wi = Vec3::new(r * cos, r * sin, z);
                    bsdf.evaluate(wi).specular.x * 2.0 * PI
                });
                assert!(
                    (sampled - quadrature).abs() < 0.01,
                    "roughness {roughness}, cosine {cos}: {sampled} sampled, {quadrature} integrated"
                );
                assert!(sampled < 1.001, "{sampled} of the light is reflected");
            }
        }
    }

    /// The density of the directions is what `sample` says it is: it integrates to 1, less what falls
    /// below the horizon, and both lobes agree with their closed forms.
    #[test]
    fn lambert_reflects_its_albedo() {
        let surface = Surface {
            base_color: Vec3::splat(0.5),
            perceptual_roughness: 1.0,
            metallic: 0.0,
            reflectance: Vec3::ZERO,
        };
        let settings = ReferenceSettings {
            diffuse: DiffuseModel::Lambert,
            ..SINGLE
        };
        let bsdf = Bsdf::new(&surface, Vec3::Y, Vec3::Y, &settings);
        let albedo = mean(32, |u, v| {
            let (wi, response) = bsdf.sample([u, v, 0.5]).unwrap();
            assert!(wi.y > 0.0);
            response.total().x / response.pdf
        });
        assert!((albedo - 0.5).abs() < 1e-5, "{albedo}");
    }

    /// Burley's lobe over Lambert's, for light from everywhere: about 1 at roughness 0.65.
    #[test]
    fn burley_is_lambert_at_two_thirds_of_roughness() {
        for (roughness, expected) in [(0.0, 0.95), (0.5, 0.98), (0.65, 0.9995), (1.0, 1.065)] {
            let surface = Surface {
                base_color: Vec3::ONE,
                perceptual_roughness: roughness,
                metallic: 0.0,
                reflectance: Vec3::ZERO,
            };
            let albedo = mean(48, |a, b| {
                // Directions of the outgoing light by the cosine too.
                let (sin, cos) = (2.0 * PI * b).sin_cos();
                let wo = Vec3::new(a.sqrt() * cos, a.sqrt() * sin, (1.0 - a).sqrt());
                let bsdf = Bsdf::new(&surface, Vec3::Z, wo, &SINGLE);
                mean(24, |u, v| {
                    bsdf.sample([u, v, 0.5])
                        .map_or(0.0, |(_, r)| r.total().x / r.pdf)
                })
            });
            assert!(
                (albedo - expected).abs() < 0.01,
                "roughness {roughness}: {albedo}, {expected} expected"
            );
        }
    }
}
