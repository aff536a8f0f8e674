//! Everything that a random scene is made of, as plain data.

use std::f32::consts::TAU;

use bevy::prelude::*;

use super::{
    Kind, RandomScene, Variant, corridor, court,
    daylight::{self, Daylight},
    draft::{Draft, Finishes},
    exposure, furniture,
    generator::Generator,
    hall,
    lamps::{self, Lamp, Source},
    rooms,
    solid::Piece,
    view::{self, Stand},
};
use crate::scenes::SceneView;

/// Radiance of a furnace, nits.
pub const FURNACE_NITS: f32 = 100.0;

/// A scene that has been drawn. Pieces, lamps and [`stand`](Self::stand) are in the building's own space, where y is
/// up; [`place`](Self::place) puts the building into the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub scene: RandomScene,
    /// What it shows, in a few words.
    pub about: String,
    /// Every mesh.
    pub pieces: Vec<Piece>,
    /// Every light of Bevy's.
    pub lamps: Vec<Lamp>,
    /// Luminance of the sky, nits.
    pub sky: Option<[f32; 3]>,
    pub stand: Stand,
    /// The camera's exposure value at ISO 100.
    pub ev100: f32,
    pub place: Transform,
    /// Whether all of it has a roof, and can be sealed.
    pub has_roof: bool,
    /// Luminance of a horizontal surface outside that has the albedo of the building, in the light of the sun and of
    /// the sky, nits.
    pub outside_nits: f32,
}

/// What all variants of a scene have in common.
struct Drawn {
    draft: Draft,
    finishes: Finishes,
    daylight: Daylight,
    /// Whether daylight comes in.
    is_day: bool,
    reserved: Vec2,
}

fn draw(kind: Kind, g: &mut Generator) -> Drawn {
    let mut structure = g.split();
    let mut light = g.split();
    let mut things = g.split();
    let mut draft = Draft::new(&mut structure);
    match kind {
        Kind::Rooms => rooms::draw(&mut structure, &mut draft),
        Kind::Corridor => corridor::draw(&mut structure, &mut draft),
        Kind::Court => court::draw(&mut structure, &mut draft),
        Kind::Gallery => hall::draw_two_storeys(&mut structure, &mut draft),
        Kind::Pillars => hall::draw_pillars(&mut structure, &mut draft),
    }
    let finishes = Finishes::draw(&mut things);
    let is_day = kind == Kind::Court || light.chance(0.55);
    if is_day && kind != Kind::Court {
        daylight::windows(&mut light, &mut draft);
    }
    let mut outer = draft.openings.iter().filter(|o| o.beyond.is_none());
    let into = outer.next().map_or(Vec3::NEG_Y, |opening| -opening.outward);
    let daylight = Daylight::draw(&mut light, into);
    let reserved = view::reserve(&mut things, &mut draft);
    furniture::furnish(&mut things, &mut draft);
    let count = 1 + light.below(4) - usize::from(is_day);
    lamps::add(&mut light, &mut draft, count);
    // A lamp may find no place.
    for _ in 0..20 {
        if is_day || !draft.lamps.is_empty() || !draft.shining.is_empty() {
            break;
        }
        lamps::add(&mut light, &mut draft, 1);
    }
    Drawn {
        draft,
        finishes,
        daylight,
        is_day,
        reserved,
    }
}

impl Plan {
    /// Draws a scene: the same one each time.
    pub fn new(scene: RandomScene) -> Self {
        let mut g = Generator::new(scene.seed);
        // Used up by the kind, which may also be chosen: see `RandomScene::new`.
        let _ = g.bits();
        let drawn = draw(scene.kind, &mut g);
        let Drawn {
            draft,
            finishes,
            daylight,
            ..
        } = &drawn;
        let mut pieces = draft.shell(finishes, false);
        pieces.extend(&draft.pieces);
        // Nor in a doorway that is closed in another variant.
        let closed = draft.shell(finishes, true);
        let stand = view::choose(&mut g, draft, drawn.reserved, &pieces, &closed);
        let turn = Quat::from_rotation_y(g.range(0.0, TAU));
        // Any phase on the grid of voxels, which are smaller than this.
        let shift = Vec3::new(g.unit(), g.unit(), g.unit()) * 0.5 - 0.25;
        let albedo = finishes.albedo();
        let outside = daylight.illuminance(Vec3::Y);
        let day = drawn.is_day.then_some(daylight);
        let nits = exposure::luminance(draft, albedo, day);
        let mut lamps = draft.lamps.clone();
        lamps.extend(day.and_then(|day| day.sun));
        let mut plan = Self {
            scene,
            about: about(&drawn),
            pieces,
            lamps,
            sky: day.map(|day| day.sky),
            stand,
            ev100: exposure::ev100(nits),
            place: Transform::from_translation(shift).with_rotation(turn),
            has_roof: draft.has_roof,
            outside_nits: albedo * outside / std::f32::consts::PI,
        };
        match scene.variant {
            Variant::Lit => {}
            Variant::Furnace => plan.heat(),
            Variant::Sealed => plan.seal(&drawn),
        }
        plan
    }

    /// Everywhere the same light: the sky's, what shines and what is reflected.
    fn heat(&mut self) {
        for piece in &mut self.pieces {
            piece.finish = piece.finish.furnace(FURNACE_NITS);
        }
        self.lamps.clear();
        self.sky = Some([FURNACE_NITS; 3]);
        self.ev100 = exposure::ev100(FURNACE_NITS);
    }

    /// No opening, no lamp, and day outside.
    fn seal(&mut self, drawn: &Drawn) {
        self.pieces = drawn.draft.shell(&drawn.finishes, true);
        self.pieces.extend(&drawn.draft.pieces);
        for piece in &mut self.pieces {
            piece.finish = piece.finish.dark();
        }
        self.lamps = drawn.daylight.sun.into_iter().collect();
        self.sky = Some(drawn.daylight.sky);
    }

    /// Where a piece is in the world.
    pub fn transform(&self, piece: &Piece) -> Transform {
        self.place * Transform::from_translation(piece.at).with_rotation(piece.turn)
    }

    /// The box around everything, in the world.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let corners = self.pieces.iter().flat_map(Piece::corners);
        let corners = corners.map(|corner| self.place.transform_point(corner));
        corners.fold((Vec3::MAX, Vec3::MIN), |(min, max), corner| {
            (min.min(corner), max.max(corner))
        })
    }

    /// Where it is looked at from, in the world.
    pub fn view(&self) -> SceneView {
        SceneView {
            eye: self.place.transform_point(self.stand.eye),
            look: self.place.transform_point(self.stand.look),
            fov: self.stand.fov,
            ev100: self.ev100,
            speed: 2.0,
        }
    }

    /// Whether there is a light whose direct light Bevy draws otherwise than the path tracer does: a `RectLight` casts
    /// no shadow there, and is not drawn at all without the tables of Bevy's feature `area_light_luts`.
    pub fn has_rect_light(&self) -> bool {
        let is_rect = |lamp: &Lamp| matches!(lamp.source, Source::Rect { .. });
        self.lamps.iter().any(is_rect)
    }
}

/// What was drawn, in a few words.
fn about(drawn: &Drawn) -> String {
    let draft = &drawn.draft;
    let mut light = Vec::new();
    if drawn.is_day {
        light.push(match drawn.daylight.sun {
            Some(_) => "sun and sky",
            None => "overcast sky",
        });
    }
    light.extend(draft.lamps.iter().map(|lamp| match lamp.source {
        Source::Bulb { .. } => "bulb",
        Source::Spot { .. } => "spot",
        Source::Rect { .. } => "rectangular light",
        Source::Sun { .. } => "sun",
    }));
    light.extend(draft.shining.iter().map(|_| "emissive lamp"));
    let spaces = match draft.spaces.len() {
        1 => "1 space".into(),
        some => format!("{some} spaces"),
    };
    format!(
        "{spaces}, walls of {:.2} m, {} pieces of furniture; light: {}",
        draft.wall,
        draft.pieces.len(),
        light.join(" + ")
    )
}
