//! Painting surfaces pixel by pixel and encoding them.

use glam::{Vec2, vec2, vec3};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// The surface at one point.
#[derive(Clone, Copy)]
pub struct Texel {
    /// Linear albedo.
    pub colour: [f32; 3],
    /// Height in metres.
    pub height: f32,
    /// Perceptual roughness.
    pub rough: f32,
}

/// A painted surface.
pub struct Canvas {
    width: usize,
    height: usize,
    texels: Vec<Texel>,
}

impl Canvas {
    /// Evaluates `f` over the unit square, v down.
    pub fn paint(width: u32, height: u32, f: impl Fn(Vec2) -> Texel) -> Self {
        let (w, h) = (width as usize, height as usize);
        let mut texels = Vec::with_capacity(w * h);
        for y in 0..h {
            for x in 0..w {
                texels.push(f(vec2(
                    (x as f32 + 0.5) / w as f32,
                    (y as f32 + 0.5) / h as f32,
                )));
            }
        }
        Self {
            width: w,
            height: h,
            texels,
        }
    }

    /// Darkens hollows: dirt gathers where the surface lies `depth` metres
    /// under its surroundings.
    pub fn with_cavities(mut self, radius: usize, depth: f32, strength: f32) -> Self {
        let blurred = self.blurred_heights(radius);
        for (t, b) in self.texels.iter_mut().zip(blurred) {
            let k = ((b - t.height) / depth).clamp(-0.5, 1.0);
            let s = 1.0 - strength * k;
            t.colour = t.colour.map(|c| c * s);
        }
        self
    }

    /// Box blur of the heights, wrapping around.
    fn blurred_heights(&self, radius: usize) -> Vec<f32> {
        let pass = |src: &[f32], n: usize, stride: usize, lines: usize, line_stride: usize| {
            let mut out = vec![0.0; src.len()];
            let inv = 1.0 / (2 * radius + 1) as f32;
            for l in 0..lines {
                let at = |i: usize| src[l * line_stride + (i % n) * stride];
                let mut sum: f32 = (0..=2 * radius).map(|k| at(n * 8 + k - radius)).sum();
                for i in 0..n {
                    out[l * line_stride + i * stride] = sum * inv;
                    sum += at(n * 8 + i + 1 + radius) - at(n * 8 + i - radius);
                }
            }
            out
        };
        let heights: Vec<f32> = self.texels.iter().map(|t| t.height).collect();
        let rows = pass(&heights, self.width, 1, self.height, self.width);
        pass(&rows, self.height, self.width, self.width, 1)
    }

    /// Base colour as JPEG.
    pub fn colour_jpeg(&self, quality: u8) -> anyhow::Result<Vec<u8>> {
        let data: Vec<u8> = self
            .texels
            .iter()
            .flat_map(|t| t.colour.map(encode_srgb))
            .collect();
        jpeg(&data, self.width, self.height, quality)
    }

    /// glTF metallic-roughness map: roughness in green, full blue so that the
    /// metallic factor decides.
    pub fn roughness_jpeg(&self, quality: u8) -> anyhow::Result<Vec<u8>> {
        let data: Vec<u8> = self
            .texels
            .iter()
            .flat_map(|t| [255, unorm(t.rough.clamp(0.05, 1.0)), 255])
            .collect();
        jpeg(&data, self.width, self.height, quality)
    }

    /// Tangent-space normals (green up) from the heights, for a tile of the
    /// given size in metres.
    pub fn normal_jpeg(&self, metres: Vec2, quality: u8) -> anyhow::Result<Vec<u8>> {
        let (w, h) = (self.width, self.height);
        let at = |x: usize, y: usize| self.texels[(y % h) * w + x % w].height;
        let (sx, sy) = (w as f32 / (2.0 * metres.x), h as f32 / (2.0 * metres.y));
        let mut data = Vec::with_capacity(w * h * 3);
        for y in 0..h {
            for x in 0..w {
                let dx = (at(x + 1, y) - at(x + w - 1, y)) * sx;
                // Rows run down, the bitangent up.
                let dy = (at(x, y + h - 1) - at(x, y + 1)) * sy;
                let n = vec3(-dx, -dy, 1.0).normalize();
                data.extend([n.x, n.y, n.z].map(|v| unorm(v * 0.5 + 0.5)));
            }
        }
        jpeg(&data, w, h, quality)
    }
}

/// Linear value to an sRGB byte.
pub fn encode_srgb(v: f32) -> u8 {
    let v = v.clamp(0.0, 1.0);
    unorm(if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    })
}

fn unorm(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

fn jpeg(rgb: &[u8], w: usize, h: usize, quality: u8) -> anyhow::Result<Vec<u8>> {
    let mut out = Vec::new();
    JpegEncoder::new_with_quality(&mut out, quality).write_image(
        rgb,
        w as u32,
        h as u32,
        ExtendedColorType::Rgb8,
    )?;
    Ok(out)
}

/// RGBA bytes as PNG.
pub fn png(rgba: &[u8], w: u32, h: u32) -> anyhow::Result<Vec<u8>> {
    let mut out = Vec::new();
    PngEncoder::new_with_quality(&mut out, CompressionType::Best, FilterType::Adaptive)
        .write_image(rgba, w, h, ExtendedColorType::Rgba8)?;
    Ok(out)
}
