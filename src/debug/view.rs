//! [`GiView`]: a debug view by its name; [`GiViews`]: all that an app has.

use bevy::{
    ecs::{prelude::*, system::SystemParam},
    reflect::prelude::*,
    render::extract_resource::ExtractResource,
    shader::ShaderDefVal,
};
use serde::{Deserialize, Serialize};

use super::GiDebugSettings;
use crate::settings::{
    GiTechnique,
    name::{self, name_type},
};

/// Name of a debug view: what GI cameras show. [`GiViews`] lists those that an app has. Views named *unexposed*
/// show plain numbers, without exposure and tone mapping. Serialized as the name; [`GiViews::find`] checks that it exists.
#[derive(Reflect, Clone, Copy, PartialEq, Eq, Hash)]
#[reflect(opaque)]
#[reflect(Default, Clone, Debug, Hash, PartialEq, Serialize, Deserialize)]
pub struct GiView(&'static str);

name_type!(GiView);

impl Default for GiView {
    fn default() -> Self {
        Self::Full
    }
}

/// The views that every technique has.
#[allow(
    non_upper_case_globals,
    reason = "they read like the variants of an enum"
)]
impl GiView {
    /// The picture.
    pub const Full: Self = Self::new("full");
    /// The picture without indirect light, as with the technique off.
    pub const Direct: Self = Self::new("direct");
    /// Indirect light alone, diffuse and specular.
    pub const Indirect: Self = Self::new("indirect");
    /// Diffuse indirect light.
    pub const Diffuse: Self = Self::new("diffuse");
    /// Specular indirect light.
    pub const Specular: Self = Self::new("specular");
    /// Diffuse indirect light before it is multiplied by the albedo: `E / pi`.
    pub const Irradiance: Self = Self::new("irradiance");
    /// Diffuse albedo, unexposed.
    pub const Albedo: Self = Self::new("albedo");
    /// Shading normal in world space, `n / 2 + 1/2`, unexposed.
    pub const Normal: Self = Self::new("normal");
    /// Perceptual roughness, unexposed.
    pub const Roughness: Self = Self::new("roughness");
    /// Factor of the material's occlusion and Bevy's SSAO on diffuse indirect light, unexposed.
    pub const Occlusion: Self = Self::new("occlusion");
    /// Screen-space motion since the last frame, unexposed.
    pub const Motion: Self = Self::new("motion");
    /// Number of frames accumulated in the indirect light of each pixel, unexposed.
    pub const History: Self = Self::new("history");
    /// Which pixels are gathered, and how well the gathered pixels around every other pixel represent it,
    /// unexposed.
    pub const Gather: Self = Self::new("gather");
    /// Weight with which volumes light each pixel, unexposed.
    pub const Coverage: Self = Self::new("coverage");
    /// Albedo of voxels, unexposed.
    pub const VoxelAlbedo: Self = Self::new("voxel-albedo");
    /// Normal of voxels, `n / 2 + 1/2`, unexposed.
    pub const VoxelNormal: Self = Self::new("voxel-normal");
    /// Emission of voxels.
    pub const VoxelEmission: Self = Self::new("voxel-emission");
    /// Ambient occlusion by cones: part of the hemisphere above each surface that no voxels block, weighted by the
    /// cosine, unexposed. The volume's border blocks nothing.
    pub const AmbientOcclusion: Self = Self::new("ambient-occlusion");
    /// All shadow maps, side by side: depth from each light, unexposed.
    pub const ShadowMaps: Self = Self::new("shadow-maps");
    /// All reflective shadow maps: light of each lamp that the surfaces in its view reflect.
    pub const RsmFlux: Self = Self::new("rsm-flux");
    /// All reflective shadow maps: normals, `n / 2 + 1/2`, unexposed.
    pub const RsmNormal: Self = Self::new("rsm-normal");
    /// All reflective shadow maps: albedo, unexposed.
    pub const RsmAlbedo: Self = Self::new("rsm-albedo");
    /// All reflective shadow maps: depth, unexposed.
    pub const RsmDepth: Self = Self::new("rsm-depth");
}

/// The part of the crate that draws a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Painter {
    /// Nobody: it is Bevy's picture.
    Bevy,
    /// The composite, in place of adding light.
    Composite,
    /// The composite, which shows what the technique's own shader has gathered.
    Gather,
    /// The pass that shows the surfaces in voxels.
    Voxels,
    /// The same pass, with the technique's own cells.
    Cells,
    /// The pass that traces cones through the opacity of volumes.
    Opacity,
    /// The pass that shows what lights see.
    LightMaps,
}

/// A debug view of an app.
#[derive(Clone, Copy, Debug)]
pub struct ViewEntry {
    /// Its name.
    pub view: GiView,
    /// Meaning of the colours, with their range.
    pub legend: &'static str,
    /// Whether it shows luminances, which are exposed, rather than plain numbers.
    pub is_luminance: bool,
    /// The only technique that has it. `None`: all of them.
    pub technique: Option<GiTechnique>,
    /// Who draws it.
    pub(crate) painter: Painter,
}

const fn entry(
    view: GiView,
    legend: &'static str,
    is_luminance: bool,
    painter: Painter,
) -> ViewEntry {
    ViewEntry {
        view,
        legend,
        is_luminance,
        technique: None,
        painter,
    }
}

/// The views that every technique has. In shaders, a view is its place in this list.
#[rustfmt::skip]
const ENTRIES: [ViewEntry; 23] = [
    entry(GiView::Full, "the picture, exposed", true, Painter::Composite),
    entry(GiView::Direct, "the picture without indirect light, exposed", true, Painter::Bevy),
    entry(GiView::Indirect, "indirect light, diffuse and specular, exposed", true, Painter::Composite),
    entry(GiView::Diffuse, "diffuse indirect light, exposed", true, Painter::Composite),
    entry(GiView::Specular, "specular indirect light, exposed", true, Painter::Composite),
    entry(GiView::Irradiance, "indirect irradiance over pi, before the albedo, exposed", true, Painter::Composite),
    entry(GiView::Albedo, "diffuse albedo, 0 to 1", false, Painter::Composite),
    entry(GiView::Normal, "shading normal in the world: grey is 0, red +x, green +y, blue +z", false, Painter::Composite),
    entry(GiView::Roughness, "perceptual roughness: black 0, white 1", false, Painter::Composite),
    entry(GiView::Occlusion, "ambient occlusion of material and SSAO: black 0 (none left), white 1 (all left)", false, Painter::Composite),
    entry(GiView::Motion, "motion since the last frame: grey 0, red +16 px to the right, green +16 px down, black -16 px", false, Painter::Composite),
    entry(GiView::History, "frames in the history: black 1, white as many as the settings allow", false, Painter::Composite),
    entry(GiView::Gather, "white: gathered pixels; others: green if the gathered ones around show their surface, red if not", false, Painter::Composite),
    entry(GiView::Coverage, "part of the pixel that volumes light: black 0, white 1", false, Painter::Composite),
    entry(GiView::VoxelAlbedo, "albedo of voxels, 0 to 1", false, Painter::Voxels),
    entry(GiView::VoxelNormal, "normal of voxels: grey is 0, red +x, green +y, blue +z", false, Painter::Voxels),
    entry(GiView::VoxelEmission, "emission of voxels, exposed", true, Painter::Voxels),
    entry(GiView::AmbientOcclusion, "part of the hemisphere above that no voxels block: black 0, white 1", false, Painter::Opacity),
    entry(GiView::ShadowMaps, "depth seen from each light, a tile a map: white near, black far or nothing", false, Painter::LightMaps),
    entry(GiView::RsmFlux, "light that lit surfaces send on, as each light sees them, a tile a map, exposed", true, Painter::LightMaps),
    entry(GiView::RsmNormal, "normals as each light sees them: grey is 0, red +x, green +y, blue +z", false, Painter::LightMaps),
    entry(GiView::RsmAlbedo, "albedo as each light sees it, 0 to 1", false, Painter::LightMaps),
    entry(GiView::RsmDepth, "depth of the reflective shadow maps: white near, black far or nothing", false, Painter::LightMaps),
];

impl GiView {
    /// The views that every technique has, in the order in which examples cycle through them.
    pub const ALL: [Self; ENTRIES.len()] = {
        let mut all = [Self::Full; ENTRIES.len()];
        let mut i = 0;
        while i < all.len() {
            all[i] = ENTRIES[i].view;
            i += 1;
        }
        all
    };

    /// What it is in shaders; one of a technique is the picture.
    pub(crate) fn number(self) -> u32 {
        let place = Self::ALL.iter().position(|view| *view == self);
        place.unwrap_or(0) as u32
    }

    /// `VIEW_<NAME>` for each view, for shaders, and `VIEW_GATHERED` for plain numbers that a technique gathers.
    pub(crate) fn shader_defs() -> Vec<ShaderDefVal> {
        let numbers = Self::ALL.iter().map(|view| {
            let name = view.name().to_uppercase().replace('-', "_");
            ShaderDefVal::UInt(format!("VIEW_{name}"), view.number())
        });
        let gathered = ShaderDefVal::UInt("VIEW_GATHERED".into(), GATHERED);
        numbers.chain([gathered]).collect()
    }
}

/// What a view of plain numbers that a technique gathers is in shaders.
pub(crate) const GATHERED: u32 = ENTRIES.len() as u32;

/// All debug views of an app: those that every technique has, then those of each technique. The same in both
/// worlds.
#[derive(Resource, ExtractResource, Clone, Debug)]
pub struct GiViews {
    entries: Vec<ViewEntry>,
}

impl Default for GiViews {
    fn default() -> Self {
        Self {
            entries: ENTRIES.to_vec(),
        }
    }
}

impl GiViews {
    /// All views.
    pub fn iter(&self) -> impl Iterator<Item = &ViewEntry> {
        self.entries.iter()
    }

    /// The views that there are while cameras use a technique.
    pub fn of(&self, technique: GiTechnique) -> impl Iterator<Item = &ViewEntry> {
        self.iter()
            .filter(move |entry| entry.technique.is_none_or(|own| own == technique))
    }

    /// Adds a view. An entry of the same name is replaced.
    pub(crate) fn add(&mut self, entry: ViewEntry) {
        self.entries.retain(|old| old.view != entry.view);
        self.entries.push(entry);
    }

    /// The entry of a view; that of the picture if there is no such view.
    pub fn get(&self, view: GiView) -> &ViewEntry {
        let found = self.iter().find(|entry| entry.view == view);
        found.unwrap_or(&ENTRIES[0])
    }

    /// The view with this name, if it is registered.
    ///
    /// # Errors
    /// A sentence that lists all names.
    pub fn find(&self, name: &str) -> Result<GiView, String> {
        let all = self.iter().map(|entry| entry.view);
        name::find("view", all, GiView::name, name)
    }
}

/// The view that GI cameras show.
#[derive(SystemParam)]
pub(crate) struct ShownView<'w> {
    debug: Res<'w, GiDebugSettings>,
    views: Res<'w, GiViews>,
}

impl ShownView<'_> {
    pub fn entry(&self) -> &ViewEntry {
        self.views.get(self.debug.view)
    }

    pub fn view(&self) -> GiView {
        self.entry().view
    }

    pub fn painter(&self) -> Painter {
        self.entry().painter
    }
}

/// Run condition: whether a part of the crate draws the view that is shown.
pub(crate) fn paints(painter: Painter) -> impl Fn(ShownView) -> bool + Clone {
    move |shown| shown.painter() == painter
}

/// A slice through voxels, perpendicular to a world axis.
#[derive(Reflect, Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Serialize, Deserialize)]
#[repr(u32)]
pub enum GiSlice {
    /// No slice: voxels are shown as cubes.
    #[default]
    None,
    /// The yz plane.
    X,
    /// The xz plane.
    Y,
    /// The xy plane.
    Z,
}
