//! In which units light is stored in half floats.
//!
//! A half float has 11 bits of precision from 2^-14 to 65504, 30 stops, and ever fewer below that, down to
//! 2^-24. Light has 50 stops, from the night sky to a filament. So the nits of a unit follow the light:
//!
//! - A camera shows what is not far from its *white*, the luminance that its exposure makes 1: a thousandth of that
//!   is nearly black, and a million times that still has to light other things.
//! - Where all is darker than white, the scene's own light is what counts, or a picture that is all but black
//!   would have no indirect light left to measure, nor to be brightened afterwards.
//!
//! With the smaller of the two, `R`, [`light`](LightUnits::light) is `16 R`: a thousandth of `R` is
//! 6.2e-5 units, and has all bits (2^-14 = 6.1e-5); a million times `R` is 62500 units, and fits. All that a surface
//! sends is in this unit.
//!
//! What shines by itself may be brighter still. A cache that keeps radiance of small places, filaments among
//! them, has units of [`emitters`](LightUnits::emitters): enough for the brightest, but no more than `512 R`, so
//! that rounding is never off by more than `512 R / 2^25` = 1.5e-5 `R`, a tenth of the darkest step of 8 bits.
//!
//! Units are powers of two: while nothing overflows or vanishes, light is the same bits in each of them. They change
//! only when light has changed by more than three stops. Whoever stores light remembers its unit, and either
//! makes it anew in the same frame or scales what it has, so that nothing is seen of a change.

use std::{
    f32::consts::PI,
    sync::{
        Arc,
        atomic::{AtomicI32, Ordering},
    },
};

use bevy::{
    app::{App, Plugin},
    ecs::prelude::*,
    math::Vec3,
    render::{Render, RenderApp, camera::ExtractedCamera},
};

use super::{
    volume::{ExtractedVolume, Grid},
    voxels::SceneVoxels,
    world::{
        lights::{LightKind, SceneLight, SceneLights},
        sky::SceneSky,
    },
};
use crate::{camera::PrimaryGiCamera, schedule::GiPrepare};

/// Stops by which light changes before its unit does.
const SLACK: f32 = 3.0;
/// A unit over `R`, see the [module](self).
const PER_REFERENCE: f32 = 16.0;
/// Most of that for what shines by itself.
const PER_REFERENCE_MOST: f32 = 512.0;
/// Largest half float.
const HALF_MOST: f32 = 65504.0;
/// Surfaces are lit by what shines with at least that part of its luminance, if it lights anything: a thousandth
/// is that of a sphere seen from thirty times its radius.
const LIT_BY_EMITTERS: f32 = 1e-3;
/// Light of lamps on surfaces is never taken for less than that part of what it is, however dark a camera's white:
/// what such a camera shows is white all over, but it can be measured.
const OVEREXPOSED: f32 = 1e-4;

/// Nits of a unit of stored light, in both worlds. See the [module](self).
#[derive(Resource, Clone, Default)]
pub struct LightUnits(Arc<[Exponent; 2]>);

/// The exponent of a power of two, once it is known.
struct Exponent(AtomicI32);

impl Default for Exponent {
    fn default() -> Self {
        Self(AtomicI32::new(i32::MAX))
    }
}

impl Exponent {
    fn get(&self) -> f32 {
        match self.0.load(Ordering::Relaxed) {
            i32::MAX => 1.0,
            exponent => f32::exp2(exponent as f32),
        }
    }

    /// Stays as it is if `wanted` is near.
    fn follow(&self, wanted: f32) {
        // Shaders multiply and divide by it.
        let wanted = wanted.log2().clamp(-96.0, 96.0);
        let now = self.0.load(Ordering::Relaxed);
        if now == i32::MAX || (wanted - now as f32).abs() > SLACK {
            self.0.store(wanted.round() as i32, Ordering::Relaxed);
        }
    }
}

impl LightUnits {
    /// For light that arrives at a place or leaves a surface.
    pub fn light(&self) -> f32 {
        self.0[0].get()
    }

    /// For radiance of small places, which may shine by themselves.
    pub fn emitters(&self) -> f32 {
        self.0[1].get()
    }

    fn follow(&self, seen: &Seen) {
        let [light, emitters] = seen.units();
        self.0[0].follow(light);
        self.0[1].follow(emitters);
    }
}

/// What units depend on, all nits.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    /// What the camera's exposure makes 1.
    white: f32,
    /// Of surfaces that lamps or the sky light.
    lit: f32,
    /// Of the brightest emission.
    brightest: f32,
}

impl Seen {
    /// The units that fit best.
    fn units(&self) -> [f32; 2] {
        let scene = self.lit.max(LIT_BY_EMITTERS * self.brightest);
        let reference = match scene > 0.0 {
            true => self.white.min(scene).max(OVEREXPOSED * self.lit),
            false => self.white,
        };
        let light = PER_REFERENCE * reference;
        let emitters = (self.brightest / HALF_MOST).clamp(light, PER_REFERENCE_MOST * reference);
        [light, emitters]
    }
}

/// Radiance of a white surface in a volume that a light shines at: of one in the middle of it, or at its border
/// if the light is there. Nits.
fn lit_by(light: &SceneLight, grid: &Grid) -> f32 {
    let gpu = &light.gpu;
    let strength = gpu.color.max_element();
    if gpu.is_directional() {
        return strength / PI;
    }
    let half = 0.5 * grid.size();
    let outside = (gpu.position - grid.center()).abs() - half;
    let distance = outside.max(Vec3::ZERO).length().max(half.max_element());
    let area = match gpu.kind == LightKind::Rect as u32 {
        true => gpu.area(),
        false => 1.0,
    };
    strength * area / (PI * distance * distance)
}

pub(crate) struct UnitsPlugin;

impl Plugin for UnitsPlugin {
    fn build(&self, app: &mut App) {
        let units = LightUnits::default();
        app.insert_resource(units.clone());
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
            return;
        };
        render_app
            .insert_resource(units)
            .add_systems(Render, follow_light.in_set(GiPrepare::Units));
    }
}

fn follow_light(
    units: Res<LightUnits>,
    primary: Res<PrimaryGiCamera>,
    cameras: Query<&ExtractedCamera>,
    volumes: Query<(&ExtractedVolume, Option<&SceneVoxels>)>,
    lights: Res<SceneLights>,
    sky: Res<SceneSky>,
) {
    // As with the sky, and with emission as seen: caches are shared, and the primary camera's exposure counts.
    let Some(camera) = primary.0.and_then(|camera| cameras.get(camera).ok()) else {
        return;
    };
    let lamps = volumes.iter().flat_map(|(volume, _)| {
        let lights = lights.lights.iter();
        lights.map(|light| lit_by(light, &volume.grid))
    });
    let brightest = volumes
        .iter()
        .filter_map(|(_, voxels)| Some(voxels?.brightest));
    let sky = sky.gpu.constant.max_element().max(sky.gpu.brightness);
    units.follow(&Seen {
        white: 1.0 / camera.exposure.clamp(1e-12, 1e12),
        lit: lamps.fold(sky, f32::max),
        brightest: brightest.fold(0.0, f32::max),
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOM: Seen = Seen {
        white: 100.0,
        lit: 30.0,
        brightest: 1000.0,
    };

    fn scaled(seen: Seen, factor: f32) -> Seen {
        Seen {
            white: seen.white,
            lit: seen.lit * factor,
            brightest: seen.brightest * factor,
        }
    }

    #[test]
    fn what_is_seen_fits() {
        for factor in [1e-8, 1e-4, 1.0, 1e4, 1e8] {
            let seen = scaled(ROOM, factor);
            let [light, emitters] = seen.units();
            let shown = seen.white.min(seen.lit);
            // A thousandth of what is seen has all bits, or white is far below what there is.
            let darkest = (1e-3 * shown).max(1e-7 * seen.lit);
            assert!(
                darkest / light >= 0.99 * f32::exp2(-14.0),
                "{factor}: {light}"
            );
            // What lies near to lamps fits, and so does what shines.
            assert!(100.0 * seen.lit / light < HALF_MOST, "{factor}: {light}");
            assert!(seen.brightest / emitters < HALF_MOST, "{factor}");
        }
    }

    #[test]
    fn a_filament_takes_little_from_what_is_seen() {
        let filament = Seen {
            brightest: 1e9,
            ..ROOM
        };
        let [light, emitters] = filament.units();
        assert!(light <= PER_REFERENCE * ROOM.white);
        assert!(emitters >= 1e9 / HALF_MOST);
        assert!(emitters / f32::exp2(25.0) < 1e-4 * ROOM.white);
    }

    #[test]
    fn units_change_seldom() {
        let units = LightUnits::default();
        units.follow(&ROOM);
        let before = (units.light(), units.emitters());
        for factor in [0.2, 1.0, 2.0, 5.0] {
            units.follow(&scaled(ROOM, factor));
            assert_eq!((units.light(), units.emitters()), before, "{factor}");
        }
        units.follow(&scaled(ROOM, 1e-3));
        assert!(units.light() < 0.01 * before.0);
        // Nothing is known, and nothing breaks.
        for lit in [0.0, f32::MAX] {
            let seen = Seen {
                white: 1e12,
                lit,
                brightest: lit,
            };
            units.follow(&seen);
            assert!(units.light().is_normal() && units.emitters().is_normal());
        }
    }
}
