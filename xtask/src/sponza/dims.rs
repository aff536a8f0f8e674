//! The building's plan and section, in metres.
//!
//! Everything hangs on a 1.6 m module: ground-floor bays are two modules wide,
//! upper-floor bays one, so columns of the two storeys stand above each other.
//! X is the long axis, Y is up, the ground floor is y = 0 and the court is
//! centred on the origin.

/// Ground-floor bay, column axis to column axis.
pub const BAY: f32 = 3.2;
/// Ground-floor bays along one long side.
pub const BAYS: usize = 8;
/// Upper-floor bay.
pub const UPPER_BAY: f32 = 1.6;

/// Axis of the end arcades (x) and of the long arcades (z).
pub const AXIS_X: f32 = 12.8;
/// See [`AXIS_X`].
pub const AXIS_Z: f32 = 3.2;
/// Half thickness of the ground-floor arcade walls.
pub const GROUND_HALF: f32 = 0.3;
/// Half thickness of the upper arcade walls, set back a little.
pub const UPPER_HALF: f32 = 0.25;

/// Court face of the ground-floor arcade walls.
pub const COURT_X: f32 = AXIS_X - GROUND_HALF;
/// See [`COURT_X`].
pub const COURT_Z: f32 = AXIS_Z - GROUND_HALF;

/// Inner face of the enclosing walls.
pub const INNER_X: f32 = 15.5;
/// See [`INNER_X`].
pub const INNER_Z: f32 = 6.7;
/// Depth of the blind arches in the enclosing walls.
pub const NICHE: f32 = 0.26;
/// Outer face of the enclosing walls (0.7 m of masonry in all).
pub const OUTER_X: f32 = INNER_X + 0.7;
/// See [`OUTER_X`].
pub const OUTER_Z: f32 = INNER_Z + 0.7;

/// Top of the step the ground-floor columns stand on.
pub const STEP: f32 = 0.08;
/// Springing line of the ground-floor arches, ribs and vaults.
pub const SPRING: f32 = 4.2;
/// Radius of the ground-floor arches.
pub const ARCH_R: f32 = 1.24;
/// Rise of the aisle vaults.
pub const VAULT_RISE: f32 = 1.48;
/// Half width of the transverse ribs.
pub const RIB_HALF: f32 = 0.18;

/// Walking level of the gallery.
pub const FLOOR2: f32 = 6.6;
/// Top of the balustrade.
pub const RAIL: f32 = 7.58;
/// Springing line of the upper arches.
pub const SPRING2: f32 = 9.9;
/// Radius of the upper arches.
pub const ARCH2_R: f32 = 0.61;
/// Underside of the gallery's boarded ceiling.
pub const CEILING: f32 = 10.95;
/// Underside of the roof at the eave, which overhangs the court.
pub const EAVE_Y: f32 = 11.45;
/// Rectangle of the eave.
pub const EAVE_X: f32 = COURT_X - 0.5;
/// See [`EAVE_X`].
pub const EAVE_Z: f32 = COURT_Z - 0.5;
/// Where the roof dies into the enclosing walls.
pub const ROOF_TOP_X: f32 = INNER_X + 0.35;
/// See [`ROOF_TOP_X`].
pub const ROOF_TOP_Z: f32 = INNER_Z + 0.35;
/// Rise of the roof between the eave and the enclosing walls.
pub const ROOF_RISE: f32 = 2.0;
/// Top of the enclosing walls.
pub const PARAPET: f32 = 14.4;
