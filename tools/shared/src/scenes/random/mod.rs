//! Scenes that are drawn at random, so that nothing can be tuned to them.
//!
//! A [`RandomScene`] is a name: a seed, a kind of building, a variant. [`Plan::new`] draws it, the same one each time
//! and everywhere; [`spawn`] builds it.
//!
//! | file | contents |
//! |---|---|
//! | `generator.rs` | random numbers |
//! | `rooms.rs`, `corridor.rs`, `court.rs`, `hall.rs` | kinds of buildings: spaces, and openings between them |
//! | `draft.rs`, `carve.rs` | a building while it is drawn; its walls, floors and ceilings |
//! | `furniture.rs`, `lamps.rs`, `daylight.rs` | what stands in it, what lights it |
//! | `finish.rs`, `solid.rs` | materials and shapes |
//! | `exposure.rs`, `view.rs` | the camera's exposure, and where it stands |
//! | `plan.rs` | all of this, and the variants |
//! | `build.rs` | from a plan to a world |

mod build;
mod carve;
mod corridor;
mod court;
mod daylight;
mod draft;
mod exposure;
mod finish;
mod furniture;
mod generator;
mod hall;
mod lamps;
mod plan;
mod rooms;
mod solid;
#[cfg(test)]
mod tests;
mod view;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use build::spawn;
pub use finish::{Finish, Surface};
pub use generator::Generator;
pub use lamps::{Lamp, Source};
pub use plan::{FURNACE_NITS, Plan};
pub use solid::{Piece, Shape};
pub use view::Stand;

/// A kind of building.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Two to four rooms with doorways.
    Rooms,
    /// A corridor with one to three bends.
    Corridor,
    /// A court that is open to the sky, with arcades or colonnades.
    Court,
    /// A hall of two storeys, with stairs to a gallery.
    Gallery,
    /// A hall with two rows of pillars.
    Pillars,
}

impl Kind {
    pub const ALL: [Self; 5] = [
        Self::Rooms,
        Self::Corridor,
        Self::Court,
        Self::Gallery,
        Self::Pillars,
    ];

    /// As in names of scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rooms => "rooms",
            Self::Corridor => "corridor",
            Self::Court => "court",
            Self::Gallery => "gallery",
            Self::Pillars => "pillars",
        }
    }
}

/// What is made of the same geometry.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Variant {
    /// As it was drawn.
    #[default]
    Lit,
    /// Every surface emits half of [`FURNACE_NITS`] and reflects half, and the sky has all of it: the radiance is
    /// [`FURNACE_NITS`] everywhere, whatever the geometry.
    Furnace,
    /// All openings to the outside are closed, all lamps are off, sun and sky shine outside: it is dark inside. For
    /// buildings with a roof.
    Sealed,
}

impl Variant {
    pub const ALL: [Self; 3] = [Self::Lit, Self::Furnace, Self::Sealed];

    /// As in names of scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lit => "lit",
            Self::Furnace => "furnace",
            Self::Sealed => "sealed",
        }
    }
}

/// A scene that is drawn at random.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomScene {
    pub seed: u64,
    pub kind: Kind,
    pub variant: Variant,
}

/// What names of random scenes begin with.
const PREFIX: &str = "random:";

impl RandomScene {
    /// The scene of a seed, as it was drawn; of a kind that the seed chooses.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            kind: Generator::new(seed).pick(&Kind::ALL),
            variant: Variant::Lit,
        }
    }

    /// The same geometry in another variant.
    pub fn variant(self, variant: Variant) -> Self {
        Self { variant, ..self }
    }

    /// The first `count` scenes of a series; other series have others.
    pub fn series(series: u64, count: usize) -> Vec<Self> {
        let mut seeds = Generator::new(series);
        // Short enough to be typed.
        let scenes = (0..count).map(|_| Self::new(seeds.bits() >> 40));
        scenes.collect()
    }

    /// `None` if the name is that of no random scene; an error if it is meant to be one and is none. Names are
    /// `random:SEED`, with `:KIND` and `:VARIANT` where they are not the seed's own kind and the lit variant.
    pub fn find(name: &str) -> Option<Result<Self, String>> {
        let mut parts = name.strip_prefix(PREFIX)?.split(':');
        let fail = || {
            let kinds = Kind::ALL.map(Kind::name).join(", ");
            let variants = Variant::ALL.map(Variant::name).join(", ");
            format!(
                "{name}: random:SEED is wanted, with :KIND ({kinds}) and :VARIANT ({variants}) if need be"
            )
        };
        let Some(seed) = parts.next().and_then(|seed| seed.parse().ok()) else {
            return Some(Err(fail()));
        };
        let mut scene = Self::new(seed);
        for part in parts {
            let kind = Kind::ALL.into_iter().find(|kind| kind.name() == part);
            let variant = Variant::ALL.into_iter().find(|v| v.name() == part);
            match (kind, variant) {
                (Some(kind), _) => scene.kind = kind,
                (_, Some(variant)) => scene.variant = variant,
                _ => return Some(Err(fail())),
            }
        }
        Some(Ok(scene))
    }
}

impl fmt::Display for RandomScene {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{PREFIX}{}", self.seed)?;
        if self.kind != Self::new(self.seed).kind {
            write!(f, ":{}", self.kind.name())?;
        }
        if self.variant != Variant::Lit {
            write!(f, ":{}", self.variant.name())?;
        }
        Ok(())
    }
}
