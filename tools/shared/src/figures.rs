//! Figures of a picture against the truth.
//!
//! All but FLIP are of linear luminances in nits, on means of 8x8 pixels: `o` are those of the picture,
//! `t` those of the truth, over all blocks in which the truth is not black, each of the three channels.
//!
//! | figure | definition |
//! |---|---|
//! | mean ratio | `sum o / sum t` |
//! | relative RMSE | `sqrt(mean (o - t)^2) / mean t` |
//! | median error | median of <code>&#124;Y(o) - Y(t)&#124; / Y(t)</code>, with the luminance `Y` of Rec. 709 |
//! | FLIP | mean of the FLIP map (Andersson et al. 2020) of the pictures as seen |

use bevy::math::UVec2;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8, FlipPool, flip};

use crate::{capture::bytes, headless::Picture};

/// Edge of a block, pixels.
pub const BLOCK: u32 = 8;

/// Means over blocks.
pub struct Blocks {
    /// Blocks across and down; a rest at the right and the bottom is left out.
    pub size: UVec2,
    pub values: Vec<[f32; 3]>,
}

pub fn luminance(p: &[f32]) -> f32 {
    0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]
}

/// Mean luminance of a picture.
pub fn mean(picture: &Picture) -> f32 {
    picture.pixels.iter().map(|p| luminance(p)).sum::<f32>() / picture.pixels.len() as f32
}

pub fn blocks(picture: &Picture) -> Blocks {
    let size = picture.size / BLOCK;
    let mean = |at: UVec2| {
        let mut sum = [0.0f32; 3];
        for i in 0..BLOCK * BLOCK {
            let p = at * BLOCK + UVec2::new(i % BLOCK, i / BLOCK);
            let pixel = picture.pixels[(p.y * picture.size.x + p.x) as usize];
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += value / (BLOCK * BLOCK) as f32;
            }
        }
        sum
    };
    let values = (0..size.element_product())
        .map(|i| mean(UVec2::new(i % size.x, i / size.x)))
        .collect();
    Blocks { size, values }
}

/// Errors of indirect light.
#[derive(Clone, Debug)]
pub struct Errors {
    pub mean_ratio: f32,
    pub relative_rmse: f32,
    pub median_error: f32,
    /// `Y(o) / Y(t) - 1` of each block; NaN where the truth is black.
    pub relative: Vec<f32>,
}

impl Errors {
    /// `None` if the truth is all black, or the sizes differ.
    pub fn new(ours: &Blocks, truth: &Blocks) -> Option<Self> {
        let brightest = truth
            .values
            .iter()
            .map(|t| luminance(t))
            .fold(0.0, f32::max);
        if ours.size != truth.size || brightest <= 0.0 {
            return None;
        }
        // What is black in the truth is background: 1e-5 of the brightest block.
        let floor = 1e-5 * brightest;
        let (mut sums, mut squares, mut count) = ([0.0f64; 2], 0.0f64, 0.0f64);
        let mut relative = Vec::with_capacity(truth.values.len());
        for (o, t) in ours.values.iter().zip(&truth.values) {
            if luminance(t) <= floor {
                relative.push(f32::NAN);
                continue;
            }
            for (o, t) in o.iter().zip(t) {
                sums[0] += f64::from(*o);
                sums[1] += f64::from(*t);
                squares += f64::from(o - t).powi(2);
                count += 1.0;
            }
            relative.push(luminance(o) / luminance(t) - 1.0);
        }
        let mut sorted: Vec<f32> = relative
            .iter()
            .filter(|e| !e.is_nan())
            .map(|e| e.abs())
            .collect();
        sorted.sort_by(f32::total_cmp);
        Some(Self {
            mean_ratio: (sums[0] / sums[1]) as f32,
            relative_rmse: ((squares / count).sqrt() / (sums[1] / count)) as f32,
            median_error: sorted[sorted.len() / 2],
            relative,
        })
    }
}

/// Mean of the FLIP map, and the map in colours, of two pictures as they are seen (encoded, 0..=1).
pub fn flip_of(ours: &Picture, truth: &Picture) -> (f32, Picture) {
    let size = truth.size;
    let image = |picture| FlipImageRgb8::with_data(size.x, size.y, &bytes(picture));
    let map = flip(image(truth), image(ours), DEFAULT_PIXELS_PER_DEGREE);
    let colours = map.apply_color_lut(&nv_flip::magma_lut()).to_vec();
    let pixels = colours
        .chunks_exact(3)
        .map(|c| [c[0], c[1], c[2], 255].map(|c| f32::from(c) / 255.0))
        .collect();
    (FlipPool::from_image(&map).mean(), Picture { size, pixels })
}

/// Relative errors of blocks as a picture of so many pixels a block: blue too dark, red too bright, white
/// right, black where there is no truth; the full colour is an error of 100 %.
pub fn heat_map(errors: &Errors, blocks: UVec2) -> Picture {
    let colour = |error: f32| {
        if error.is_nan() {
            return [0.0, 0.0, 0.0, 1.0];
        }
        let strength = error.abs().min(1.0).sqrt();
        let end = if error < 0.0 {
            [0.13, 0.25, 0.68]
        } else {
            [0.70, 0.10, 0.12]
        };
        let [r, g, b] = end.map(|c: f32| 1.0 + (c - 1.0) * strength);
        [r, g, b, 1.0]
    };
    let size = blocks * BLOCK;
    let pixels = (0..size.element_product())
        .map(|i| {
            let at = UVec2::new(i % size.x, i / size.x) / BLOCK;
            colour(errors.relative[(at.y * blocks.x + at.x) as usize])
        })
        .collect();
    Picture { size, pixels }
}

/// How much the pixels of a still scene move: their standard deviations over time.
#[derive(Clone)]
pub struct Stability {
    sums: Vec<[f64; 2]>,
    frames: u32,
}

impl Stability {
    pub fn new(size: UVec2) -> Self {
        Self {
            sums: vec![[0.0; 2]; size.element_product() as usize],
            frames: 0,
        }
    }

    pub fn add(&mut self, picture: &Picture) {
        self.frames += 1;
        for (sum, pixel) in self.sums.iter_mut().zip(&picture.pixels) {
            let y = f64::from(luminance(pixel));
            sum[0] += y;
            sum[1] += y * y;
        }
    }

    /// Mean standard deviation of a pixel over the mean luminance.
    pub fn deviation(&self) -> f32 {
        let n = f64::from(self.frames.max(1));
        let (mut deviation, mut total) = (0.0, 0.0);
        for [sum, squares] in &self.sums {
            let mean = sum / n;
            deviation += (squares / n - mean * mean).max(0.0).sqrt();
            total += mean;
        }
        (deviation / total.max(1e-12)) as f32
    }
}

/// Mean absolute difference of two pictures' luminances.
pub fn distance(a: &Picture, b: &Picture) -> f32 {
    let pairs = a.pixels.iter().zip(&b.pixels);
    let sum: f32 = pairs
        .map(|(a, b)| (luminance(a) - luminance(b)).abs())
        .sum();
    sum / a.pixels.len() as f32
}

/// Frames after which less than a tenth is missing of the way to the last picture, for good; the ways
/// are distances to it, frame by frame.
pub fn frames_to_90_percent(distances: &[f32]) -> u32 {
    let first = distances.first().copied().unwrap_or(0.0);
    let last_far = distances.iter().rposition(|d| *d > 0.1 * first);
    last_far.map_or(0, |i| i as u32 + 1)
}

/// The value below which so much (0 to 1) of some sorted ones lie, interpolated. NaN if there are none.
pub fn percentile(sorted: &[f32], part: f32) -> f32 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f32::NAN;
    };
    let at = part.clamp(0.0, 1.0) * last as f32;
    let (below, above) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    below + (above - below) * at.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Picture {
        let size = UVec2::new(17, 16);
        Picture {
            size,
            pixels: vec![[value, value, value, 1.0]; size.element_product() as usize],
        }
    }

    #[test]
    fn figures_of_flat_pictures_are_exact() {
        let errors = Errors::new(&blocks(&flat(1.5)), &blocks(&flat(2.0))).unwrap();
        assert_eq!(errors.mean_ratio, 0.75);
        assert_eq!(errors.relative_rmse, 0.25);
        assert_eq!(errors.median_error, 0.25);
        assert_eq!(errors.relative.len(), 4, "a rest of a block is left out");
        assert!(Errors::new(&blocks(&flat(1.0)), &blocks(&flat(0.0))).is_none());
    }

    #[test]
    fn background_does_not_count() {
        let (mut ours, mut truth) = (flat(3.0), flat(2.0));
        for y in 0..8 {
            for x in 0..8 {
                truth.pixels[y * 17 + x] = [0.0; 4];
                ours.pixels[y * 17 + x] = [100.0; 4];
            }
        }
        let errors = Errors::new(&blocks(&ours), &blocks(&truth)).unwrap();
        assert_eq!(errors.mean_ratio, 1.5);
        assert!(errors.relative[0].is_nan());
    }

    #[test]
    fn flip_is_zero_for_the_same_and_one_for_black_against_white() {
        assert_eq!(flip_of(&flat(0.4), &flat(0.4)).0, 0.0);
        let (worst, map) = flip_of(&flat(0.0), &flat(1.0));
        assert!(worst > 0.9, "{worst}");
        assert_eq!(map.size, UVec2::new(17, 16));
    }

    #[test]
    fn percentiles_are_interpolated() {
        let sorted = [0.0, 1.0, 2.0, 4.0];
        let percentiles = [0.0, 0.5, 1.0].map(|part| percentile(&sorted, part));
        assert_eq!(percentiles, [0.0, 1.5, 4.0]);
        assert_eq!(percentile(&[3.0], 0.9), 3.0);
        assert!(percentile(&[], 0.5).is_nan());
    }

    #[test]
    fn time_is_counted_to_the_last_frame_that_is_off() {
        assert_eq!(frames_to_90_percent(&[1.0, 0.5, 0.09, 0.2, 0.05, 0.0]), 4);
        assert_eq!(frames_to_90_percent(&[0.0]), 0);
        let mut still = Stability::new(UVec2::new(17, 16));
        still.add(&flat(1.0));
        still.add(&flat(3.0));
        assert_eq!(still.deviation(), 0.5);
    }
}
