//! The paper's evaluation graph: how many pixels differ by less than each threshold.

use crate::numbers::{count, differences, index, long_count};

/// Number of thresholds of the evaluation graph.
pub const THRESHOLDS: usize = 101;
const PER_DEGREE: f64 = 20.0;

/// The thresholds of the evaluation graph: 0 to 5 °C in steps of 0.05.
#[must_use]
pub fn thresholds_c() -> [f64; THRESHOLDS] {
    std::array::from_fn(|step| count(step) / PER_DEGREE)
}

/// Counts of pixel differences by the first threshold above them, and of those above none.
#[derive(Debug, Clone)]
pub(crate) struct Graph([u64; THRESHOLDS + 1]);

impl Default for Graph {
    fn default() -> Self {
        Self([0; THRESHOLDS + 1])
    }
}

impl Graph {
    pub(crate) fn add(&mut self, real: &[f64], simulated: &[f64]) {
        for difference in differences(real, simulated).map(f64::abs) {
            let nearest = index(difference * PER_DEGREE + 0.5).min(THRESHOLDS);
            let is_reached = nearest < THRESHOLDS && count(nearest) / PER_DEGREE <= difference;
            self.0[nearest + usize::from(is_reached)] += 1;
        }
    }

    /// Share of the pixels, 0 to 1, that differ by strictly less than each of [`thresholds_c`]; 0 without pixels.
    pub(crate) fn shares(&self) -> [f64; THRESHOLDS] {
        let pixels = long_count(self.0.iter().sum::<u64>().max(1));
        let mut below = 0;
        std::array::from_fn(|threshold| {
            below += self.0[threshold];
            long_count(below) / pixels
        })
    }
}
