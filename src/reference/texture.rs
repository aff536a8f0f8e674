//! Images, as the path tracer reads them: level 0, bilinear.

use bevy::{
    color::{ColorToComponents, LinearRgba},
    image::{Image, ImageAddressMode, ImageSampler, ImageSamplerDescriptor},
    math::{UVec2, Vec2, Vec3, Vec4},
    render::render_resource::{TextureDimension, TextureFormat},
};

/// An image in memory.
#[derive(Debug)]
pub(super) struct Texture {
    size: UVec2,
    texels: Texels,
    address: [ImageAddressMode; 2],
    /// Nearest texel in place of four.
    nearest: bool,
}

#[derive(Debug)]
enum Texels {
    /// sRGB, four bytes a texel.
    Srgb(Vec<[u8; 4]>),
    /// Linear, four bytes a texel.
    Bytes(Vec<[u8; 4]>),
    Float(Vec<[f32; 4]>),
}

/// Linear values of sRGB bytes.
fn srgb_table() -> &'static [f32; 256] {
    static TABLE: std::sync::OnceLock<[f32; 256]> = std::sync::OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|i| {
            let c = i as f32 / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        })
    })
}

impl Texture {
    /// Decodes a 2D image; `Err` says why that is not possible.
    pub fn new(image: &Image) -> Result<Self, String> {
        if image.texture_descriptor.dimension != TextureDimension::D2 {
            return Err("it is not two-dimensional".into());
        }
        let sampler = match &image.sampler {
            ImageSampler::Default => &ImageSamplerDescriptor::linear(),
            ImageSampler::Descriptor(descriptor) => descriptor,
        };
        Ok(Self {
            size: image.size(),
            texels: texels(image, 0)?,
            address: [sampler.address_mode_u, sampler.address_mode_v],
            nearest: sampler.mag_filter == bevy::image::ImageFilterMode::Nearest,
        })
    }

    /// Linear RGBA at `uv`.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        if !uv.is_finite() {
            return Vec4::ONE;
        }
        let at = uv * self.size.as_vec2();
        if self.nearest {
            return self.texel(at.x.floor(), at.y.floor());
        }
        let base = (at - 0.5).floor();
        let f = at - 0.5 - base;
        let row = |y: f32| self.texel(base.x, y).lerp(self.texel(base.x + 1.0, y), f.x);
        row(base.y).lerp(row(base.y + 1.0), f.y)
    }

    fn texel(&self, x: f32, y: f32) -> Vec4 {
        let wrap = |i: f32, n: u32, mode: ImageAddressMode| -> u32 {
            let (i, n) = (i as i64, i64::from(n));
            let i = match mode {
                ImageAddressMode::Repeat => i.rem_euclid(n),
                ImageAddressMode::MirrorRepeat => {
                    let i = i.rem_euclid(2 * n);
                    i.min(2 * n - 1 - i)
                }
                _ => i.clamp(0, n - 1),
            };
            i as u32
        };
        let x = wrap(x, self.size.x, self.address[0]);
        let y = wrap(y, self.size.y, self.address[1]);
        self.texels.get((y * self.size.x + x) as usize)
    }

    /// Mean of all texels.
    pub fn mean(&self) -> Vec4 {
        let n = (self.size.x * self.size.y) as usize;
        (0..n).map(|i| self.texels.get(i)).sum::<Vec4>() / n as f32
    }
}

impl Texels {
    fn get(&self, i: usize) -> Vec4 {
        match self {
            Self::Srgb(bytes) => {
                let [r, g, b, a] = bytes[i];
                let table = srgb_table();
                Vec4::new(
                    table[r as usize],
                    table[g as usize],
                    table[b as usize],
                    f32::from(a) / 255.0,
                )
            }
            Self::Bytes(bytes) => Vec4::from_array(bytes[i].map(|b| f32::from(b) / 255.0)),
            Self::Float(values) => Vec4::from_array(values[i]),
        }
    }
}

/// The texels of one layer of an image.
fn texels(image: &Image, layer: u32) -> Result<Texels, String> {
    let size = image.size();
    let count = (size.x * size.y) as usize;
    let data = image
        .data
        .as_ref()
        .ok_or("its data is on the GPU only (RenderAssetUsages without MAIN_WORLD)")?;
    let bytes = |data: &[u8]| -> Option<Vec<[u8; 4]>> {
        let from = layer as usize * count * 4;
        let bytes = data.get(from..from + count * 4)?;
        Some(
            bytes
                .chunks_exact(4)
                .map(|b| [b[0], b[1], b[2], b[3]])
                .collect(),
        )
    };
    match image.texture_descriptor.format {
        TextureFormat::Rgba8UnormSrgb => bytes(data).map(Texels::Srgb),
        TextureFormat::Rgba8Unorm => bytes(data).map(Texels::Bytes),
        _ => {
            let mut values = Vec::with_capacity(count);
            for y in 0..size.y {
                for x in 0..size.x {
                    let color = if image.texture_descriptor.size.depth_or_array_layers > 1 {
                        image.get_color_at_3d(x, y, layer)
                    } else {
                        image.get_color_at(x, y)
                    };
                    let color = color.map_err(|e| e.to_string())?;
                    values.push(LinearRgba::from(color).to_f32_array());
                }
            }
            Some(Texels::Float(values))
        }
    }
    .ok_or_else(|| "it has less data than texels".into())
}

/// Six faces, as Bevy's skyboxes have them.
#[derive(Debug)]
pub(super) struct Cubemap {
    side: u32,
    faces: [Texels; 6],
}

impl Cubemap {
    pub fn new(image: &Image) -> Result<Self, String> {
        if image.texture_descriptor.size.depth_or_array_layers != 6 {
            return Err("it does not have six faces".into());
        }
        let mut faces = Vec::new();
        for layer in 0..6 {
            faces.push(texels(image, layer)?);
        }
        let faces = faces.try_into().map_err(|_| "it does not have six faces")?;
        Ok(Self {
            side: image.size().x,
            faces,
        })
    }

    /// Linear RGB in a direction of the cube map's own, left-handed space.
    pub fn sample(&self, d: Vec3) -> Vec3 {
        let a = d.abs();
        // Vulkan's table of cube map faces.
        let (face, s, t, m) = if a.x >= a.y && a.x >= a.z {
            if d.x > 0.0 {
                (0, -d.z, -d.y, a.x)
            } else {
                (1, d.z, -d.y, a.x)
            }
        } else if a.y >= a.z {
            if d.y > 0.0 {
                (2, d.x, d.z, a.y)
            } else {
                (3, d.x, -d.z, a.y)
            }
        } else if d.z > 0.0 {
            (4, d.x, -d.y, a.z)
        } else {
            (5, -d.x, -d.y, a.z)
        };
        let at = (Vec2::new(s, t) / m * 0.5 + 0.5) * self.side as f32 - 0.5;
        let base = at.floor();
        let f = at - base;
        let texel = |dx: f32, dy: f32| {
            let last = self.side as f32 - 1.0;
            let x = (base.x + dx).clamp(0.0, last) as u32;
            let y = (base.y + dy).clamp(0.0, last) as u32;
            self.faces[face].get((y * self.side + x) as usize)
        };
        let row = |dy: f32| texel(0.0, dy).lerp(texel(1.0, dy), f.x);
        row(0.0).lerp(row(1.0), f.y).truncate()
    }
}
