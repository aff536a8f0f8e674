//! What surfaces are made of: real materials, each with the range of its measured albedo.

use super::generator::Generator;

/// A kind of material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    Plaster,
    Brick,
    Wood,
    Concrete,
    Cloth,
    Painted,
    Tiles,
    Stone,
    Metal,
    /// Cards of leaves: the colour is a factor of their texture.
    Leaves,
}

/// From what a material is drawn.
pub struct Ranges {
    /// Linear base colour of the darkest and of the lightest one, each channel.
    pub color: [[f32; 3]; 2],
    /// How independently the channels are drawn: 0 is one shade between the two colours, 1 is any hue.
    pub hue: f32,
    /// Perceptual roughness.
    pub roughness: [f32; 2],
    pub metallic: f32,
}

impl Surface {
    /// Linear base colours of the darkest and of the lightest one. Albedos as tables of building materials have them
    /// (CIBSE Lighting Guide 11, for example): white plaster 0.7 to 0.85, brick 0.1 to 0.4, concrete 0.25 to 0.5, oak
    /// 0.25, walnut 0.1; metals by their reflectance at normal incidence.
    fn color(self) -> [[f32; 3]; 2] {
        match self {
            Self::Plaster => [[0.5, 0.47, 0.41], [0.84, 0.83, 0.81]],
            Self::Brick => [[0.17, 0.08, 0.05], [0.46, 0.24, 0.16]],
            Self::Wood => [[0.09, 0.045, 0.02], [0.5, 0.34, 0.2]],
            Self::Concrete => [[0.22, 0.21, 0.2], [0.5, 0.49, 0.47]],
            Self::Cloth => [[0.04, 0.03, 0.03], [0.62, 0.58, 0.56]],
            Self::Painted => [[0.05, 0.05, 0.05], [0.75, 0.74, 0.7]],
            Self::Tiles => [[0.16, 0.15, 0.14], [0.72, 0.71, 0.69]],
            Self::Stone => [[0.06, 0.055, 0.05], [0.58, 0.55, 0.5]],
            Self::Metal => [[0.52, 0.46, 0.38], [0.91, 0.9, 0.88]],
            Self::Leaves => [[0.7, 0.7, 0.7], [1.0, 1.0, 1.0]],
        }
    }

    pub fn ranges(self) -> Ranges {
        let (hue, roughness) = match self {
            Self::Plaster => (0.1, [0.8, 1.0]),
            Self::Brick => (0.15, [0.8, 0.95]),
            Self::Wood => (0.1, [0.4, 0.8]),
            Self::Concrete => (0.05, [0.75, 0.95]),
            Self::Cloth => (0.8, [0.85, 1.0]),
            Self::Painted => (0.8, [0.3, 0.65]),
            Self::Tiles => (0.3, [0.15, 0.4]),
            Self::Stone => (0.1, [0.12, 0.35]),
            Self::Metal => (0.3, [0.3, 0.5]),
            Self::Leaves => (0.2, [0.5, 0.7]),
        };
        Ranges {
            color: self.color(),
            hue,
            roughness,
            metallic: if self == Self::Metal { 1.0 } else { 0.0 },
        }
    }
}

/// A material that has been drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finish {
    pub surface: Surface,
    /// Linear base colour.
    pub color: [f32; 3],
    pub roughness: f32,
    pub metallic: f32,
    /// As glTF has it: 0.5 is an index of refraction of 1.5.
    pub reflectance: f32,
    /// Luminance of what shines by itself, nits.
    pub nits: [f32; 3],
}

impl Finish {
    pub fn draw(g: &mut Generator, surface: Surface) -> Self {
        let ranges = surface.ranges();
        let [dark, light] = ranges.color;
        let shade = g.unit();
        let color = std::array::from_fn(|i| {
            let part = shade + (g.unit() - shade) * ranges.hue;
            dark[i] + (light[i] - dark[i]) * part
        });
        // Most things in files have the default; some are oiled or dusty.
        let reflectance = if g.chance(0.7) {
            0.5
        } else {
            g.range(0.4, 0.6)
        };
        Self {
            surface,
            color,
            roughness: g.range(ranges.roughness[0], ranges.roughness[1]),
            metallic: ranges.metallic,
            reflectance,
            nits: [0.0; 3],
        }
    }

    /// One of several kinds, each as likely.
    pub fn draw_of(g: &mut Generator, surfaces: &[Surface]) -> Self {
        let surface = g.pick(surfaces);
        Self::draw(g, surface)
    }

    /// A lamp's surface: nearly black, so that what is seen of it is what it emits.
    pub fn lamp(nits: [f32; 3]) -> Self {
        Self {
            surface: Surface::Painted,
            color: [0.05; 3],
            roughness: 0.65,
            metallic: 0.0,
            reflectance: 0.5,
            nits,
        }
    }

    /// The same, emitting nothing.
    pub fn dark(self) -> Self {
        Self {
            nits: [0.0; 3],
            ..self
        }
    }

    /// What every surface of a furnace is: half of the light of `radiance` nits is its own, half is reflected, by a
    /// lobe that reflects as much as Lambert's (see [`diffuse`](crate::scenes::stage::diffuse)).
    pub fn furnace(self, radiance: f32) -> Self {
        Self {
            surface: self.surface,
            color: [0.5; 3],
            roughness: 0.65,
            metallic: 0.0,
            reflectance: 0.0,
            nits: [0.5 * radiance; 3],
        }
    }

    /// Luminance of the base colour.
    pub fn albedo(&self) -> f32 {
        crate::figures::luminance(&self.color)
    }
}
