//! [`RadianceHintsDebugSettings`]: what is shown of the hints.

use bevy::{ecs::prelude::*, reflect::prelude::*, render::extract_resource::ExtractResource};
use serde::{Deserialize, Serialize};

use crate::settings::Parameters;

/// What is shown of [radiance hints](crate::technique::hints), inside the picture.
#[derive(
    Resource, Reflect, ExtractResource, Serialize, Deserialize, Clone, Debug, Default, PartialEq,
)]
#[reflect(Resource, Default, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RadianceHintsDebugSettings {
    /// Draws the hints at their positions, as spheres that show the light from all sides. With a
    /// [`slice`](crate::GiDebugSettings::slice), only the hints of one layer. Default `false`.
    pub show: bool,
    /// What the spheres show. Default [`HintView::Light`], all light.
    pub view: HintView,
    /// Restricts the indirect light in the picture to the component that [`view`](Self::view) selects: a single
    /// bounce, emission or, with [`GiSettings::replace_ambient`](crate::GiSettings::replace_ambient), the sky. Has
    /// no effect if that is not a component of the light. Default `false`.
    pub only_view: bool,
}

// There is no number with a range.
impl Parameters for RadianceHintsDebugSettings {
    fn legend(&self) -> Option<&'static str> {
        (self.show || self.only_view).then(|| self.view.legend())
    }
}

/// What the spheres of hints show, see [`RadianceHintsDebugSettings::show`].
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum HintView {
    /// All light, exposed.
    #[default]
    Light,
    /// Light of lamps after one bounce, exposed.
    FirstBounce,
    /// Light of emissive surfaces, exposed.
    Emission,
    /// Light of the sky, exposed.
    Sky,
    /// Light one bounce after the first bounce, emission and the sky, exposed.
    SecondBounce,
    /// Light of all later bounces, exposed.
    LaterBounces,
    /// Distance of the nearest surface that lights the hint, relative to the reach: black 0, white 1 or more.
    Nearest,
    /// Distance of the farthest surface that lights the hint, relative to the reach: black 0, white 1 or more.
    Farthest,
    /// Visibility between the hint and the picked hint as estimated by equation 11: black 0, white 1.
    Visibility,
    /// Probability that light comes from around the hint, `1 - nearest` (equation 9 before normalisation):
    /// black 0, white 1.
    Confidence,
    /// Mean albedo of the surfaces around the hint, used for coloured bounces between hints.
    Albedo,
    /// Ringing of the spherical harmonics: negative irradiance, relative to the irradiance of the same light
    /// from all directions. Black 0, red 1.
    Negative,
    /// Where light would leak without [`ProbeSet::visibility`](crate::ProbeSet::visibility): share of the six
    /// neighbours that the hint does not see. Black 0, red 1.
    Leak,
}

impl HintView {
    /// Meaning of the colours, with their range.
    pub const fn legend(self) -> &'static str {
        match self {
            Self::Light => "all light that arrives from each side, exposed",
            Self::FirstBounce => "light of lamps that has bounced once, exposed",
            Self::Emission => "light of emissive surfaces, exposed",
            Self::Sky => "light of the sky, exposed",
            Self::SecondBounce => "light that has bounced once more, exposed",
            Self::LaterBounces => "light that has bounced more often, exposed",
            Self::Nearest => {
                "the nearest of what lights the hint: black at hand, white at the reach"
            }
            Self::Farthest => {
                "the farthest of what lights the hint: black at hand, white at the reach"
            }
            Self::Visibility => "guessed visibility of the picked hint: black 0, white 1",
            Self::Confidence => "1 - nearest: black 0, white 1",
            Self::Albedo => "mean albedo around, 0 to 1",
            Self::Negative => "irradiance below zero, over that of the mean light: black 0, red 1",
            Self::Leak => "part of the six neighbours that the hint does not see: black 0, red 1",
        }
    }
}
