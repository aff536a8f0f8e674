//! GPU structs of radiance hints; `types.wgsl` is their twin.

use bevy::{
    math::{IVec3, UVec3, Vec3},
    render::render_resource::ShaderType,
    shader::ShaderDefVal,
};

use super::settings::{
    HintAlbedo, HintBounce, HintDepthTest, HintDisk, HintExchange, HintOcclusion,
    HintReconstruction, HintSampling, HintTaps, RadianceHintsSettings, ShOrder,
};
use super::view::HintView;

/// Light of lamps that bounced once, from the virtual point lights.
pub const SLOT_LIGHTS: u32 = 0;
/// Light straight from emissive surfaces.
pub const SLOT_EMISSION: u32 = 1;
/// Light straight from the sky.
pub const SLOT_SKY: u32 = 2;
/// Here and in the slots that follow: light that bounced once more than that of the slot before; in this one,
/// than that of all three above.
pub const SLOT_BOUNCES: u32 = 3;

/// Texels along z of the texture that is looked up, for each hint: coefficients, four in a texel, distances, and the
/// albedo.
pub const fn blocks(order: ShOrder) -> u32 {
    (3 * order.coefficients()).div_ceil(4) + 2
}

/// The slots whose light a view shows, a bit each, of `slots`; `None` if it shows no light.
pub fn slots_of(view: HintView, slots: u32) -> Option<u32> {
    let all = (1 << slots) - 1;
    let second = 1 << SLOT_BOUNCES;
    let shown = match view {
        HintView::Light => all,
        HintView::FirstBounce => 1 << SLOT_LIGHTS,
        HintView::Emission => 1 << SLOT_EMISSION,
        HintView::Sky => 1 << SLOT_SKY,
        HintView::SecondBounce => second,
        HintView::LaterBounces => !(2 * second - 1),
        _ => return None,
    };
    Some(shown & all)
}

// Variants of the settings, as the shaders compare them.
const SAMPLE_VPLS: u32 = 0;
const SAMPLE_DISK: u32 = 1;
const SAMPLE_DISK_LITERAL: u32 = 2;
const OCCLUSION_NONE: u32 = 0;
const OCCLUSION_LIGHT_DEPTH: u32 = 1;
const OCCLUSION_CAMERA_DEPTH: u32 = 2;
const OCCLUSION_VOXELS: u32 = 3;
const BOUNCE_SURFACES: u32 = 0;
const BOUNCE_HINTS: u32 = 1;
const BOUNCE_LITERAL: u32 = 2;
const RECONSTRUCT_CORNERS: u32 = 0;
const RECONSTRUCT_TAPS: u32 = 1;

/// Albedo of points between hints around which there is no surface.
const ALBEDO_OF_NONE: f32 = 0.5;

/// What all passes of a frame know.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuHints {
    /// Coefficients of a colour: 4 or 9.
    pub coefficients: u32,
    /// Virtual point lights that each hint looks at this frame,
    pub samples: u32,
    /// and the first of them.
    pub first_sample: u32,
    /// Virtual point lights of the volume,
    pub vpls: u32,
    /// and the first of them among those of all volumes.
    pub first_vpl: u32,
    /// Counts updates.
    pub frame: u32,
    /// Share of this frame in what is accumulated of virtual point lights.
    pub blend_lights: f32,
    /// The same of emission and sky,
    pub blend_sources: f32,
    /// and of what surfaces reflect.
    pub blend_bounces: f32,
    /// 0 or 1.
    pub specular: u32,
    /// A `SAMPLE_` constant.
    pub sampling: u32,
    /// An `OCCLUSION_` constant.
    pub occlusion: u32,
    /// A `BOUNCE_` constant.
    pub bounce: u32,
    /// Radius of a disk, as a fraction of the map's side.
    pub spread: f32,
    pub bounce_samples: u32,
    /// Metres.
    pub reach: f32,
    pub average_albedo: f32,
    /// A `RECONSTRUCT_` constant.
    pub reconstruction: u32,
    /// Metres.
    pub tap_distance: f32,
    /// Hints that are farther than that from everything, metres, are left out in some frames.
    pub sleep_beyond: f32,
    /// A [`LightShare`](crate::LightShare).
    pub share: u32,
    /// 0 or 1: surfaces between hints have the colour of those around, not the average albedo.
    pub coloured: u32,
    /// Points of a way that are compared with a depth,
    pub occlusion_points: u32,
    /// and what is left of the light by each that is hidden.
    pub occlusion_left: f32,
    /// Metres, within which a texel is no point.
    pub min_distance: f32,
    /// 0 or 1: places between hints count as far as they may be visible.
    pub guess_visibility: u32,
    pub taps: u32,
    /// Cosine of the angle between the normal and the ring of taps.
    pub ring_cos: f32,
    /// Hints whose light has changed by less than that part of it are left out in some frames.
    pub quiet: f32,
    /// Nits of a unit of what is looked up.
    pub unit: f32,
}

impl GpuHints {
    /// What the settings say, for a volume with that diagonal and that side of a cell, metres. The rest is 0. What
    /// belongs to a variant that is not chosen has its default.
    pub fn new(settings: &RadianceHintsSettings, diagonal: f32, cell: f32) -> Self {
        let (sampling, disk) = match settings.sampling {
            HintSampling::VirtualPointLights => (SAMPLE_VPLS, HintDisk::default()),
            HintSampling::Disk(disk) => (SAMPLE_DISK, disk),
            HintSampling::DiskLiteral(disk) => (SAMPLE_DISK_LITERAL, disk),
        };
        let (occlusion, depth) = match settings.occlusion {
            HintOcclusion::None => (OCCLUSION_NONE, HintDepthTest::default()),
            HintOcclusion::LightDepth(test) => (OCCLUSION_LIGHT_DEPTH, test),
            HintOcclusion::CameraDepth(test) => (OCCLUSION_CAMERA_DEPTH, test),
            HintOcclusion::Voxels => (OCCLUSION_VOXELS, HintDepthTest::default()),
        };
        let (bounce, exchange) = match settings.bounce {
            HintBounce::Surfaces => (BOUNCE_SURFACES, HintExchange::default()),
            HintBounce::Hints(exchange) => (BOUNCE_HINTS, exchange),
            HintBounce::HintsLiteral(exchange) => (BOUNCE_LITERAL, exchange),
        };
        let (coloured, average_albedo) = match exchange.albedo {
            HintAlbedo::Surfaces => (1, ALBEDO_OF_NONE),
            HintAlbedo::Average(albedo) => (0, albedo),
        };
        let (reconstruction, taps) = match settings.reconstruction {
            HintReconstruction::Corners => (RECONSTRUCT_CORNERS, HintTaps::default()),
            HintReconstruction::Taps(taps) => (RECONSTRUCT_TAPS, taps),
        };
        Self {
            coefficients: settings.order.coefficients(),
            specular: settings.specular.into(),
            sampling,
            occlusion,
            bounce,
            spread: disk.spread,
            bounce_samples: exchange.samples,
            reach: exchange.reach * diagonal,
            average_albedo,
            reconstruction,
            tap_distance: taps.distance * cell,
            coloured,
            occlusion_points: depth.points,
            occlusion_left: 1.0 - depth.factor,
            min_distance: disk.min_distance * cell,
            guess_visibility: exchange.guess_visibility.into(),
            taps: taps.count,
            ring_cos: taps.angle.to_radians().cos(),
            ..Default::default()
        }
    }
}

/// Uniform of `carry.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuCarry {
    /// Cells by which the lattice has moved.
    pub shift: IVec3,
    /// Coefficients of all slots.
    pub blocks: u32,
    /// Hints along each axis.
    pub dims: UVec3,
}

/// What one pass of a frame works on.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuStage {
    /// The slot that is written.
    pub slot: u32,
    /// The slots that are summed up, a bit each.
    pub mask: u32,
    /// All slots.
    pub slots: u32,
    /// Coefficients of a colour: 4 or 9.
    pub coefficients: u32,
    /// Hints along each axis.
    pub dims: UVec3,
    /// Factor on the light of [`SLOT_LIGHTS`],
    pub first_gain: f32,
    /// and on that from [`SLOT_BOUNCES`] on.
    pub later_gain: f32,
    /// Nits of a unit of the sum.
    pub unit: f32,
}

/// What debug views show.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuHintsView {
    /// As in [`GiDebugSettings`](crate::GiDebugSettings).
    pub pick_from: Vec3,
    /// A [`HintView`].
    pub content: u32,
    /// As in the settings.
    pub pick_to: Vec3,
    /// All slots.
    pub slots: u32,
    /// A [`GiSlice`](crate::GiSlice), and where.
    pub slice: u32,
    pub slice_at: f32,
    /// Room for marks in maps.
    pub marks: u32,
    /// Taps over a surface.
    pub taps: u32,
    /// Slots whose light is shown, a bit each,
    pub mask: u32,
    /// if it is light.
    pub is_light: u32,
}

/// A surface that is picked.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub struct GpuPicked {
    /// Metres.
    pub position: Vec3,
    /// 0 or 1.
    pub exists: u32,
    pub normal: Vec3,
    /// The hint that lights it most.
    pub probe: u32,
}

/// The constants above, for `types.wgsl`.
pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
    [
        ("SAMPLE_VPLS", SAMPLE_VPLS),
        ("SAMPLE_DISK_LITERAL", SAMPLE_DISK_LITERAL),
        ("OCCLUSION_LIGHT_DEPTH", OCCLUSION_LIGHT_DEPTH),
        ("OCCLUSION_CAMERA_DEPTH", OCCLUSION_CAMERA_DEPTH),
        ("OCCLUSION_VOXELS", OCCLUSION_VOXELS),
        ("BOUNCE_LITERAL", BOUNCE_LITERAL),
        ("RECONSTRUCT_TAPS", RECONSTRUCT_TAPS),
        ("SLOT_LIGHTS", SLOT_LIGHTS),
        ("SLOT_EMISSION", SLOT_EMISSION),
        ("SLOT_SKY", SLOT_SKY),
        ("SLOT_BOUNCES", SLOT_BOUNCES),
        ("SHOW_LIGHT", HintView::Light as u32),
        ("SHOW_NEAREST", HintView::Nearest as u32),
        ("SHOW_FARTHEST", HintView::Farthest as u32),
        ("SHOW_VISIBILITY", HintView::Visibility as u32),
        ("SHOW_CONFIDENCE", HintView::Confidence as u32),
        ("SHOW_NEGATIVE", HintView::Negative as u32),
        ("SHOW_LEAK", HintView::Leak as u32),
    ]
    .map(|(name, value)| ShaderDefVal::UInt(name.into(), value))
    .into()
}
