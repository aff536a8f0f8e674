//! Light paths from the camera.

use bevy::math::{Mat4, UVec2, Vec2, Vec3};

use super::{
    bsdf::Bsdf,
    geometry::{Segment, off_surface},
    lights::Arrival,
    material::Vertex,
    sampler::Sampler,
    scene::ReferenceScene,
    settings::ReferenceSettings,
};

/// What is seen through a camera, and from where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceCamera {
    /// The camera's transform.
    pub world_from_view: Mat4,
    /// Its projection, of any kind.
    pub clip_from_view: Mat4,
}

impl ReferenceCamera {
    /// The ray through a point of the picture, 0..1 from its upper left corner.
    fn ray(&self, uv: Vec2) -> Option<Segment> {
        let ndc = uv * Vec2::new(2.0, -2.0) + Vec2::new(-1.0, 1.0);
        let view_from_clip = self.clip_from_view.inverse();
        // Reverse-Z: 1 is near.
        let near = self
            .world_from_view
            .project_point3(view_from_clip.project_point3(ndc.extend(1.0)));
        let beyond = self
            .world_from_view
            .project_point3(view_from_clip.project_point3(ndc.extend(0.5)));
        let direction = (beyond - near).try_normalize()?;
        near.is_finite().then_some(Segment {
            origin: near,
            direction,
            length: f32::INFINITY,
            from_camera: true,
            passes: 0,
        })
    }
}

/// What one path brings back. Luminances in nits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    /// Emission as it is seen, and the light of Bevy's lights after one reflection.
    pub direct: Vec3,
    /// All other light, by the lobe that reflects it towards the camera.
    pub diffuse: Vec3,
    pub specular: Vec3,
    pub albedo: Vec3,
    pub normal: Vec3,
    /// Whether there is a surface.
    pub exists: bool,
}

/// How much of the light at the end of a path arrives in the two lobes of its first surface.
#[derive(Clone, Copy)]
struct Throughput {
    diffuse: Vec3,
    specular: Vec3,
}

impl Throughput {
    fn max(&self) -> f32 {
        (self.diffuse + self.specular).max_element()
    }
}

/// Traces one path through a pixel.
///
/// Long, as it is one loop: the path from the camera to its end, in the order in which the estimator is written.
pub(super) fn trace(
    scene: &ReferenceScene,
    settings: &ReferenceSettings,
    camera: &ReferenceCamera,
    size: UVec2,
    pixel: UVec2,
    sampler: &mut Sampler,
) -> Sample {
    let mut out = Sample::default();
    let [x, y, ..] = sampler.next();
    let uv = (pixel.as_vec2() + Vec2::new(x, y)) / size.as_vec2();
    let Some(mut segment) = camera.ray(uv) else {
        return out;
    };
    let opaque = |hit: &_| scene.is_opaque(hit);
    // Before the first reflection, both lobes are still to come.
    let mut throughput: Option<Throughput> = None;
    // Density with which the direction at hand was sampled; what it meets may also be found by
    // next-event estimation.
    let mut pdf = 0.0;
    for depth in 0.. {
        let hit = scene.geometry.trace(&segment, opaque);
        let Some(hit) = hit else {
            let sky = scene.sky.radiance(segment.direction);
            match throughput {
                None => out.direct = if settings.show_sky { sky } else { Vec3::ZERO },
                Some(t) => {
                    let other = scene.light_choice_of_sky() * scene.sky.pdf(segment.direction);
                    let w = balance(pdf, other);
                    out.diffuse += t.diffuse * sky * w;
                    out.specular += t.specular * sky * w;
                }
            }
            break;
        };
        let vertex = scene.vertex(&hit, segment.direction);
        match throughput {
            None => {
                out.direct += vertex.emission_seen;
                out.albedo = vertex.surface.diffuse_albedo();
                out.normal = vertex.shading_normal;
                out.exists = true;
            }
            Some(t) if vertex.emission != Vec3::ZERO => {
                let cos = vertex
                    .geometric_normal
                    .dot(segment.direction)
                    .abs()
                    .max(1e-6);
                let per_area = scene.light_choice_of_emitters()
                    * scene.emitters.density(&scene.geometry, hit.face);
                let other = per_area * hit.distance * hit.distance / cos;
                let w = balance(pdf, other);
                out.diffuse += t.diffuse * vertex.emission * w;
                out.specular += t.specular * vertex.emission * w;
            }
            Some(_) => {}
        }
        if depth > settings.max_bounces {
            break;
        }
        let bsdf = Bsdf::new(
            &vertex.surface,
            vertex.shading_normal,
            -segment.direction,
            settings,
        );
        if bsdf.is_black() {
            break;
        }

        // Next-event estimation: one light, of whatever kind.
        let u = if scene.light_is_drawn {
            sampler.next()
        } else {
            [0.0; 4]
        };
        if let Some((arrival, light)) = scene.arrive(&vertex, u)
            && arrival.direction.dot(vertex.geometric_normal) > 0.0
        {
            let response = bsdf.evaluate(arrival.direction);
            if response.total() != Vec3::ZERO && is_free(scene, &vertex, &arrival, light) {
                let w = arrival.pdf.map_or(1.0, |p| balance(p, response.pdf));
                let is_direct = light.is_some();
                let light = arrival.light * w;
                match throughput {
                    None if is_direct => out.direct += response.total() * light,
                    None => {
                        out.diffuse += response.diffuse * light;
                        out.specular += response.specular * light;
                    }
                    Some(t) => {
                        let light = response.total() * light;
                        out.diffuse += t.diffuse * light;
                        out.specular += t.specular * light;
                    }
                }
            }
        }

        // On in a direction that the surface reflects to.
        let [u1, u2, u3, roulette] = sampler.next();
        let Some((direction, response)) = bsdf.sample([u1, u2, u3]) else {
            break;
        };
        if direction.dot(vertex.geometric_normal) <= 0.0 {
            break;
        }
        pdf = response.pdf;
        let mut next = match throughput {
            None => Throughput {
                diffuse: response.diffuse / pdf,
                specular: response.specular / pdf,
            },
            Some(t) => {
                let f = response.total() / pdf;
                Throughput {
                    diffuse: t.diffuse * f,
                    specular: t.specular * f,
                }
            }
        };
        // Russian roulette: what goes on counts for what does not.
        if depth >= 1 {
            let survive = next.max().min(0.95);
            if roulette >= survive {
                break;
            }
            next.diffuse /= survive;
            next.specular /= survive;
        }
        throughput = Some(next);
        segment = Segment {
            origin: off_surface(vertex.position, vertex.geometric_normal),
            direction,
            length: f32::INFINITY,
            from_camera: false,
            passes: 0,
        };
    }
    out
}

/// Weight of a sample of density `own` where another way finds it with `other` (Veach 1997, balance
/// heuristic).
fn balance(own: f32, other: f32) -> f32 {
    if own <= 0.0 { 1.0 } else { own / (own + other) }
}

/// Whether light arrives unblocked; `light` is the one of Bevy's that it comes from.
fn is_free(
    scene: &ReferenceScene,
    vertex: &Vertex,
    arrival: &Arrival,
    light: Option<usize>,
) -> bool {
    let segment = Segment {
        origin: off_surface(vertex.position, vertex.geometric_normal),
        direction: arrival.direction,
        // Ends before the surface that shines.
        length: arrival.distance * (1.0 - 1e-4),
        from_camera: false,
        passes: light.map_or(0, |light| scene.passes[light]),
    };
    scene.geometry.is_free(&segment, |hit| scene.is_opaque(hit))
}

impl ReferenceScene {
    /// Probability of choosing faces that shine, in next-event estimation.
    fn light_choice_of_emitters(&self) -> f32 {
        self.choice(self.lights.len())
    }

    /// Probability of choosing the sky.
    fn light_choice_of_sky(&self) -> f32 {
        self.choice(self.lights.len() + 1)
    }

    fn choice(&self, i: usize) -> f32 {
        if self.light_choice.is_empty() {
            0.0
        } else {
            self.light_choice.probability(i)
        }
    }

    /// Light that arrives at a vertex from one source, with densities over all choices; and which of Bevy's
    /// lights that is, whose first reflection is direct light.
    fn arrive(&self, vertex: &Vertex, u: [f32; 4]) -> Option<(Arrival, Option<usize>)> {
        if self.light_choice.is_empty() {
            return None;
        }
        let (i, chance, _) = self.light_choice.sample(u[0]);
        let light = self.lights.get(i);
        let mut arrival = if let Some(light) = light {
            light.arrive(vertex.position, Vec2::new(u[1], u[2]))?
        } else if i == self.lights.len() {
            self.arrive_from_emitter(vertex.position, [u[1], u[2]])?
        } else {
            self.sky.arrive([u[1], u[2]])?
        };
        arrival.light /= chance;
        arrival.pdf = arrival.pdf.map(|pdf| pdf * chance);
        Some((arrival, light.map(|_| i)))
    }

    fn arrive_from_emitter(&self, p: Vec3, u: [f32; 2]) -> Option<Arrival> {
        let (hit, q, per_area) = self.emitters.sample(&self.geometry, u);
        let to = q - p;
        let distance = to.length();
        let direction = to.try_normalize()?;
        if !self.geometry.faces[hit.face as usize].is_met(direction) || !self.is_opaque(&hit) {
            return None;
        }
        let there = self.vertex(&hit, direction);
        let cos = -direction.dot(there.geometric_normal);
        if cos <= 1e-6 || there.emission == Vec3::ZERO {
            return None;
        }
        let pdf = per_area * distance * distance / cos;
        Some(Arrival {
            direction,
            distance,
            light: there.emission / pdf,
            pdf: Some(pdf),
        })
    }
}
