//! What has been traced so far.

use bevy::math::{DVec3, UVec2, Vec3};

use super::integrator::Sample;

/// A component of the result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ReferenceView {
    /// All light, nits.
    #[default]
    Full,
    /// What a camera shows without global illumination, nits.
    Direct,
    /// All light but the direct light, nits.
    Indirect,
    /// Indirect light that the first surface reflects diffusely, nits.
    Diffuse,
    /// Indirect light that the first surface reflects specularly, nits.
    Specular,
    /// Diffuse albedo of the first surface.
    Albedo,
    /// Shading normal of the first surface in world space.
    Normal,
}

/// Sums over the paths of a pixel.
#[derive(Clone, Copy, Default)]
pub(super) struct Pixel {
    pub count: u32,
    hits: u32,
    direct: DVec3,
    diffuse: DVec3,
    specular: DVec3,
    albedo: DVec3,
    normal: DVec3,
}

impl Pixel {
    pub fn add(&mut self, sample: &Sample) {
        self.count += 1;
        // A path that ran into the limits of numbers counts as dark.
        let add = |sum: &mut DVec3, value: Vec3| {
            if value.is_finite() {
                *sum += value.as_dvec3();
            }
        };
        add(&mut self.direct, sample.direct);
        add(&mut self.diffuse, sample.diffuse);
        add(&mut self.specular, sample.specular);
        if sample.exists {
            self.hits += 1;
            add(&mut self.albedo, sample.albedo);
            add(&mut self.normal, sample.normal);
        }
    }

    fn value(&self, view: ReferenceView) -> Vec3 {
        let light = |sum: DVec3| (sum / f64::from(self.count.max(1))).as_vec3();
        let surface = |sum: DVec3| (sum / f64::from(self.hits.max(1))).as_vec3();
        match view {
            ReferenceView::Full => light(self.direct + self.diffuse + self.specular),
            ReferenceView::Direct => light(self.direct),
            ReferenceView::Indirect => light(self.diffuse + self.specular),
            ReferenceView::Diffuse => light(self.diffuse),
            ReferenceView::Specular => light(self.specular),
            ReferenceView::Albedo => surface(self.albedo),
            ReferenceView::Normal => surface(self.normal).normalize_or_zero(),
        }
    }
}

/// The paths of all pixels.
pub(super) struct Film {
    pub size: UVec2,
    pub pixels: Vec<Pixel>,
}

impl Film {
    pub fn new(size: UVec2) -> Self {
        Self {
            size,
            pixels: vec![Pixel::default(); (size.x * size.y) as usize],
        }
    }

    pub fn picture(&self, view: ReferenceView) -> Vec<Vec3> {
        self.pixels.iter().map(|pixel| pixel.value(view)).collect()
    }
}
