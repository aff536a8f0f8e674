//! Random numbers that are the same on every machine and in every version: SplitMix64 (Steele et al. 2014).

/// A sequence of numbers that its seed determines.
#[derive(Clone, Debug)]
pub struct Generator(u64);

impl Generator {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Another sequence, so that what draws from it may draw more or less without changing what follows here.
    pub fn split(&mut self) -> Self {
        Self(self.bits())
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to below 1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Between two numbers, evenly. The lower one, if the range is empty.
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low).max(0.0) * self.unit()
    }

    /// Between two positive numbers, evenly over their logarithms.
    pub fn log_range(&mut self, low: f32, high: f32) -> f32 {
        low * (high / low).powf(self.unit())
    }

    /// From 0 to below `count`, which is at least 1.
    pub fn below(&mut self, count: usize) -> usize {
        (((self.bits() >> 32) * count as u64) >> 32) as usize
    }

    /// True with this probability, 0 to 1.
    pub fn chance(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// One of some values, of which there is at least one.
    pub fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers of the published algorithm for the seed 0.
    #[test]
    fn numbers_are_those_of_splitmix64() {
        let mut generator = Generator::new(0);
        assert_eq!(generator.bits(), 0xe220_a839_7b1d_cdaf);
        assert_eq!(generator.bits(), 0x6e78_9e6a_a1b9_65f4);
    }

    #[test]
    fn numbers_stay_in_their_ranges() {
        let mut generator = Generator::new(7);
        for _ in 0..10_000 {
            assert!((0.0..1.0).contains(&generator.unit()));
            assert!((0.05..=0.5).contains(&generator.range(0.05, 0.5)));
            assert!((0.0499..=0.501).contains(&generator.log_range(0.05, 0.5)));
            assert!(generator.below(3) < 3);
        }
        assert_eq!(generator.range(2.0, 1.0), 2.0);
    }
}
