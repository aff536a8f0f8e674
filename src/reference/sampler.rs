//! Low-discrepancy numbers: Owen-scrambled Sobol points (Burley 2020), a sequence of its own for each
//! pixel.

/// The numbers of one path, four at a time.
pub(super) struct Sampler {
    index: u32,
    seed: u32,
    /// Sets of four dimensions used up.
    set: u32,
}

/// Length of a Sobol sequence of the crate; longer renders go on with another scramble.
const LENGTH: u32 = 1 << 16;
/// Sets of four dimensions of the crate.
const SETS: u32 = 64;

impl Sampler {
    /// The numbers of sample `index` of a pixel.
    pub fn new(pixel: u32, index: u32, seed: u32) -> Self {
        Self {
            index: index % LENGTH,
            seed: hash(pixel ^ hash(seed ^ hash(index / LENGTH))),
            set: 0,
        }
    }

    /// The next four numbers, 0..1.
    pub fn next(&mut self) -> [f32; 4] {
        let set = self.set;
        self.set += 1;
        let seed = self.seed ^ hash(set / SETS);
        sobol_burley::sample_4d(self.index, set % SETS, seed)
    }
}

/// A good mix of 32 bits (Wellons 2018, "lowbias32").
fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_stratified_and_pixels_differ() {
        let mut cells = [0; 16];
        for index in 0..256 {
            let [x, y, ..] = Sampler::new(7, index, 1).next();
            cells[(x * 4.0) as usize * 4 + (y * 4.0) as usize] += 1;
        }
        assert_eq!(
            cells, [16; 16],
            "every sixteenth of the square gets as much"
        );
        let first = |pixel, seed| Sampler::new(pixel, 0, seed).next();
        assert_ne!(first(0, 0), first(1, 0));
        assert_ne!(first(0, 0), first(0, 1));
    }
}
