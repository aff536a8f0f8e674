//! Choices by weight.

/// A choice among some, each with a weight.
#[derive(Clone, Debug, Default)]
pub(super) struct Distribution {
    /// Sums of the weights up to and with each, over the whole.
    cumulative: Vec<f32>,
}

impl Distribution {
    pub fn new(weights: impl IntoIterator<Item = f32>) -> Self {
        let mut sum = 0.0f64;
        let sums: Vec<f64> = weights
            .into_iter()
            .map(|w| {
                sum += f64::from(w.max(0.0));
                sum
            })
            .collect();
        if sum <= 0.0 {
            return Self::default();
        }
        Self {
            cumulative: sums.iter().map(|s| (s / sum) as f32).collect(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.cumulative.is_empty()
    }

    /// The choice for `u`, its probability, and what is left of `u` as a new number in 0..1.
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        let i = self
            .cumulative
            .partition_point(|c| *c <= u)
            .min(self.cumulative.len() - 1);
        let p = self.probability(i);
        let before = self.cumulative[i] - p;
        (i, p, ((u - before) / p).clamp(0.0, 0.999_999_94))
    }

    pub fn probability(&self, i: usize) -> f32 {
        let before = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        self.cumulative[i] - before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_follow_their_weights() {
        let d = Distribution::new([1.0, 0.0, 3.0]);
        assert_eq!(d.sample(0.1).0, 0);
        assert_eq!(d.sample(0.3).0, 2);
        assert!((d.probability(2) - 0.75).abs() < 1e-6);
        let (_, _, rest) = d.sample(0.625);
        assert!((rest - 0.5).abs() < 1e-5);
        assert!(Distribution::new([0.0, -1.0]).is_empty());
    }
}
