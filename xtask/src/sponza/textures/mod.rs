//! Textures painted by code: every set is a height field with albedo and
//! roughness, from which the glTF maps are derived.

mod canvas;
mod fabric;
mod foliage;
mod masonry;
mod noise;
mod surfaces;

use anyhow::anyhow;
use glam::{Vec2, vec2};

use canvas::{Canvas, Texel};

/// A group of maps used together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Set {
    /// Limestone blocks.
    Ashlar,
    /// Carved stone.
    Carved,
    /// Lime plaster.
    Plaster,
    /// Bricks.
    Brick,
    /// Floor slabs.
    Floor,
    /// Fired clay.
    Clay,
    /// Oak.
    Wood,
    /// Hammered metal.
    Iron,
    /// Red curtain cloth.
    CurtainRed,
    /// Green curtain cloth.
    CurtainGreen,
    /// Blue curtain cloth.
    CurtainBlue,
    /// Red banner.
    BannerRed,
    /// Blue banner.
    BannerBlue,
    /// Twigs with alpha.
    Leaf,
}

const SETS: [Set; 14] = [
    Set::Ashlar,
    Set::Carved,
    Set::Plaster,
    Set::Brick,
    Set::Floor,
    Set::Clay,
    Set::Wood,
    Set::Iron,
    Set::CurtainRed,
    Set::CurtainGreen,
    Set::CurtainBlue,
    Set::BannerRed,
    Set::BannerBlue,
    Set::Leaf,
];

/// An encoded image file.
pub struct Image {
    /// Name in the file.
    pub name: String,
    /// MIME type.
    pub mime: &'static str,
    /// Encoded bytes.
    pub bytes: Vec<u8>,
}

/// Indices of a set's maps in [`Images::files`].
#[derive(Clone, Copy)]
pub struct Maps {
    /// Base colour.
    pub colour: usize,
    /// Tangent-space normals.
    pub normal: usize,
    /// Metallic-roughness.
    pub roughness: usize,
}

/// All encoded images.
pub struct Images {
    /// The files.
    pub files: Vec<Image>,
    maps: Vec<Maps>,
}

impl Images {
    /// The maps of a set.
    pub fn set(&self, set: Set) -> Maps {
        self.maps[set as usize]
    }
}

/// How a set is painted.
struct Recipe {
    /// Pixels.
    size: (u32, u32),
    /// Extent in metres, for the slope of the normals.
    metres: Vec2,
    /// Radius in pixels, depth in metres and strength of the dirt in hollows.
    cavities: (usize, f32, f32),
    /// The surface.
    texel: Box<dyn Fn(Vec2) -> Texel>,
}

fn recipe(set: Set) -> Recipe {
    let make = |px: u32, metres: f32, depth: f32, texel: fn(Vec2) -> Texel| Recipe {
        size: (px, px),
        metres: Vec2::splat(metres),
        cavities: (5, depth, 0.30),
        texel: Box::new(texel),
    };
    let cloth = |metres: Vec2, texel: Box<dyn Fn(Vec2) -> Texel>| Recipe {
        size: (512, 1024),
        metres,
        cavities: (2, 0.002, 0.15),
        texel,
    };
    let curtain =
        |dye: [f32; 3]| cloth(vec2(1.8, 2.9), Box::new(move |uv| fabric::curtain(uv, dye)));
    let banner_size = vec2(0.86, 3.3);
    match set {
        Set::Ashlar => make(1024, 3.2, 0.006, masonry::ashlar),
        Set::Carved => make(1024, 1.6, 0.003, surfaces::carved),
        Set::Plaster => make(1024, 3.2, 0.005, surfaces::plaster),
        Set::Brick => make(1024, 2.0, 0.006, masonry::brick),
        Set::Floor => make(1024, 3.2, 0.005, masonry::floor),
        Set::Clay => make(512, 1.2, 0.003, surfaces::clay),
        Set::Wood => make(512, 1.6, 0.003, surfaces::wood),
        Set::Iron => make(256, 0.5, 0.003, surfaces::iron),
        Set::CurtainRed => curtain([0.47, 0.030, 0.026]),
        Set::CurtainGreen => curtain([0.042, 0.215, 0.060]),
        Set::CurtainBlue => curtain([0.028, 0.085, 0.36]),
        Set::BannerRed => cloth(banner_size, Box::new(fabric::banner_red)),
        Set::BannerBlue => cloth(banner_size, Box::new(fabric::banner_blue)),
        Set::Leaf => {
            let twigs = foliage::Twigs::new();
            Recipe {
                size: (512, 512),
                metres: vec2(2.0, 0.9),
                cavities: (1, 1.0, 0.0),
                texel: Box::new(move |uv| foliage::texel(&twigs, uv)),
            }
        }
    }
}

/// The set whose normal and roughness maps a set borrows: all curtains are
/// one weave in different dyes.
fn relief_of(set: Set) -> Set {
    match set {
        Set::CurtainGreen | Set::CurtainBlue => Set::CurtainRed,
        other => other,
    }
}

/// Paints and encodes all sets, on as many threads as there are cores; the
/// result does not depend on how many.
pub fn paint_all(divisor: u32) -> anyhow::Result<Images> {
    let workers = std::thread::available_parallelism().map_or(2, |n| n.get());
    let next = std::sync::atomic::AtomicUsize::new(0);
    let slots: Vec<std::sync::Mutex<Option<anyhow::Result<Vec<Image>>>>> =
        SETS.iter().map(|_| std::sync::Mutex::new(None)).collect();
    std::thread::scope(|s| {
        for _ in 0..workers.min(SETS.len()) {
            s.spawn(|| {
                loop {
                    let i = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                    let (Some(&set), Some(slot)) = (SETS.get(i), slots.get(i)) else {
                        break;
                    };
                    if let Ok(mut slot) = slot.lock() {
                        *slot = Some(paint(set, divisor));
                    }
                }
            });
        }
    });
    let mut files: Vec<Image> = Vec::new();
    let mut maps: Vec<Maps> = Vec::new();
    for (&set, slot) in SETS.iter().zip(slots) {
        let painted = slot
            .into_inner()
            .map_err(|_| anyhow!("a painter panicked"))?
            .ok_or_else(|| anyhow!("{set:?} was not painted"))??;
        let base = files.len();
        files.extend(painted);
        let own = relief_of(set) == set;
        maps.push(Maps {
            colour: base,
            normal: if own {
                base + 1
            } else {
                maps[relief_of(set) as usize].normal
            },
            roughness: if own {
                base + 2
            } else {
                maps[relief_of(set) as usize].roughness
            },
        });
    }
    Ok(Images { files, maps })
}

fn paint(set: Set, divisor: u32) -> anyhow::Result<Vec<Image>> {
    let r = recipe(set);
    let (w, h) = (r.size.0 / divisor, r.size.1 / divisor);
    let (radius, depth, strength) = r.cavities;
    let canvas = Canvas::paint(w, h, r.texel).with_cavities(radius, depth, strength);
    let image = |kind: &str, mime, bytes| Image {
        name: format!("{set:?}{kind}"),
        mime,
        bytes,
    };
    let mut out = vec![if set == Set::Leaf {
        image("Colour", "image/png", canvas::png(&foliage::rgba(w), w, h)?)
    } else {
        image("Colour", "image/jpeg", canvas.colour_jpeg(90)?)
    }];
    if relief_of(set) == set {
        out.push(image(
            "Normal",
            "image/jpeg",
            canvas.normal_jpeg(r.metres, 90)?,
        ));
        out.push(image("Roughness", "image/jpeg", canvas.roughness_jpeg(82)?));
    }
    Ok(out)
}
