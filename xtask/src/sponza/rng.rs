//! Small deterministic hashes: the only source of "randomness" in the scene.

/// Mixes two lattice coordinates and a seed into 32 well-spread bits.
pub fn hash(x: i32, y: i32, seed: u32) -> u32 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1)
        ^ (y as u32).wrapping_mul(0x85EB_CA77).rotate_left(13)
        ^ seed.wrapping_mul(0xC2B2_AE3D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297A_2D39);
    h ^ (h >> 15)
}

/// [`hash`] as a number in 0..1.
pub fn unit(x: i32, y: i32, seed: u32) -> f32 {
    (hash(x, y, seed) >> 8) as f32 / 16_777_216.0
}

/// A counter-based stream of numbers.
pub struct Rng {
    seed: u32,
    count: i32,
}

impl Rng {
    /// A stream of its own for each `seed`.
    pub fn new(seed: u32) -> Self {
        Self { seed, count: 0 }
    }

    /// The next number in 0..1.
    pub fn next(&mut self) -> f32 {
        self.count += 1;
        unit(self.count, 77, self.seed)
    }

    /// The next number in `lo..hi`.
    pub fn range(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * self.next()
    }
}
