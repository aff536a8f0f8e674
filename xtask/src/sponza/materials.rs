//! The scene's materials and the texture sets they use.

use super::textures::Set;

/// A material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mat {
    /// Dressed limestone blocks of the court façades.
    Ashlar,
    /// Carved stone without joints: columns, mouldings, reliefs.
    Carved,
    /// The same stone, darker and warmer: lower columns.
    CarvedDark,
    /// Lime plaster of the vaults.
    Plaster,
    /// Brick of the enclosing walls.
    Brick,
    /// Stone slabs of the ground floor.
    Floor,
    /// Terracotta-toned slabs of the gallery.
    GalleryFloor,
    /// Clay roof tiles.
    RoofTile,
    /// Dark timber.
    Wood,
    /// Wrought iron.
    Iron,
    /// Bronze of tie-backs and lamps.
    Bronze,
    /// Red curtain.
    CurtainRed,
    /// Green curtain.
    CurtainGreen,
    /// Blue curtain.
    CurtainBlue,
    /// Red and gold banner.
    BannerRed,
    /// Blue and white banner.
    BannerBlue,
    /// Leaf cards, alpha-masked.
    Leaf,
    /// Glazed clay of the vases.
    Vase,
    /// Potting soil.
    Soil,
    /// Lamp glass, glowing.
    LampGlass,
}

/// All materials, in file order.
pub const ALL: [Mat; 20] = [
    Mat::Ashlar,
    Mat::Carved,
    Mat::CarvedDark,
    Mat::Plaster,
    Mat::Brick,
    Mat::Floor,
    Mat::GalleryFloor,
    Mat::RoofTile,
    Mat::Wood,
    Mat::Iron,
    Mat::Bronze,
    Mat::CurtainRed,
    Mat::CurtainGreen,
    Mat::CurtainBlue,
    Mat::BannerRed,
    Mat::BannerBlue,
    Mat::Leaf,
    Mat::Vase,
    Mat::Soil,
    Mat::LampGlass,
];

/// The fixed parameters of a material.
pub struct Params {
    /// Name in the file.
    pub name: &'static str,
    /// Texture set, if any.
    pub set: Option<Set>,
    /// Linear base colour factor.
    pub base: [f32; 3],
    /// Metallic factor.
    pub metallic: f32,
    /// Roughness factor.
    pub roughness: f32,
    /// Linear emissive factor.
    pub emissive: [f32; 3],
    /// `KHR_materials_emissive_strength`.
    pub emissive_strength: f32,
    /// Drawn from both sides.
    pub double_sided: bool,
    /// Alpha-tested at one half.
    pub masked: bool,
}

impl Mat {
    /// Metres covered by one repeat of the texture.
    pub fn tile_metres(self) -> f32 {
        match self {
            Mat::Ashlar | Mat::Floor => 3.2,
            Mat::GalleryFloor => 2.4,
            Mat::Plaster => 3.2,
            Mat::Brick => 2.0,
            Mat::Carved | Mat::CarvedDark => 1.6,
            Mat::RoofTile | Mat::Vase => 1.2,
            Mat::Wood => 1.6,
            Mat::Iron | Mat::Bronze | Mat::Soil | Mat::LampGlass => 0.5,
            // Cloth and leaves carry their own 0..1 coordinates.
            _ => 1.0,
        }
    }

    /// The material's parameters.
    pub fn params(self) -> Params {
        let plain = |name, set, base: [f32; 3]| Params {
            name,
            set: Some(set),
            base,
            metallic: 0.0,
            roughness: 1.0,
            emissive: [0.0; 3],
            emissive_strength: 1.0,
            double_sided: false,
            masked: false,
        };
        let cloth = |name, set| Params {
            double_sided: true,
            ..plain(name, set, [1.0; 3])
        };
        match self {
            Mat::Ashlar => plain("Ashlar", Set::Ashlar, [1.0; 3]),
            Mat::Carved => plain("CarvedStone", Set::Carved, [1.0; 3]),
            Mat::CarvedDark => plain("ColumnStone", Set::Carved, [0.88, 0.84, 0.78]),
            Mat::Plaster => plain("Plaster", Set::Plaster, [1.0; 3]),
            Mat::Brick => plain("Brick", Set::Brick, [1.0; 3]),
            Mat::Floor => plain("FloorSlabs", Set::Floor, [1.0; 3]),
            Mat::GalleryFloor => plain("GallerySlabs", Set::Floor, [0.95, 0.72, 0.55]),
            Mat::RoofTile => plain("RoofTile", Set::Clay, [1.0; 3]),
            Mat::Wood => plain("DarkWood", Set::Wood, [1.0; 3]),
            Mat::Iron => Params {
                metallic: 1.0,
                ..plain("Iron", Set::Iron, [0.30, 0.28, 0.27])
            },
            Mat::Bronze => Params {
                metallic: 1.0,
                roughness: 0.75,
                ..plain("Bronze", Set::Iron, [0.86, 0.62, 0.30])
            },
            Mat::CurtainRed => cloth("CurtainRed", Set::CurtainRed),
            Mat::CurtainGreen => cloth("CurtainGreen", Set::CurtainGreen),
            Mat::CurtainBlue => cloth("CurtainBlue", Set::CurtainBlue),
            Mat::BannerRed => cloth("BannerRed", Set::BannerRed),
            Mat::BannerBlue => cloth("BannerBlue", Set::BannerBlue),
            Mat::Leaf => Params {
                double_sided: true,
                masked: true,
                ..plain("Leaf", Set::Leaf, [1.0; 3])
            },
            Mat::Vase => Params {
                roughness: 0.6,
                ..plain("Vase", Set::Clay, [0.95, 0.80, 0.62])
            },
            Mat::Soil => Params {
                ..plain("Soil", Set::Plaster, [0.10, 0.07, 0.05])
            },
            Mat::LampGlass => Params {
                set: None,
                roughness: 0.35,
                emissive: [1.0, 0.56, 0.20],
                emissive_strength: 12.0,
                ..plain("LampGlass", Set::Plaster, [0.75, 0.62, 0.42])
            },
        }
    }
}
