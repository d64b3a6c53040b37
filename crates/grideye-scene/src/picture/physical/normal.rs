//! A table of the normal distribution's integral, because a frame needs some thousand values.

use crate::geometry::count;
use std::sync::LazyLock;

/// The response counts as zero beyond this many standard deviations: 3 in 10 million of it lie outside.
pub(super) const REACH: f64 = 5.0;

/// End of the table in standard deviations; 1e-9 lies outside.
const END: f64 = 6.0;
const STEPS_PER_UNIT: f64 = 32.0;
const STEPS: usize = 384;

/// The same for all sensors.
pub(super) static NORMAL: LazyLock<Normal> = LazyLock::new(Normal::new);

/// Cubic pieces that match the integral and its slope at their ends: the error stays below 4e-9.
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pieces: [[f64; 4]; STEPS],
}

impl Normal {
    fn new() -> Self {
        let width = 1.0 / STEPS_PER_UNIT;
        let end = |index: usize| {
            let at = count::float(index) * width - END;
            let density = libm::exp(-0.5 * at * at) / (2.0 * std::f64::consts::PI).sqrt();
            (
                0.5 * libm::erfc(-at * std::f64::consts::FRAC_1_SQRT_2),
                density * width,
            )
        };
        let pieces = std::array::from_fn(|index| {
            let ((low, low_slope), (high, high_slope)) = (end(index), end(index + 1));
            let rise = high - low;
            [
                low,
                low_slope,
                3.0 * rise - 2.0 * low_slope - high_slope,
                low_slope + high_slope - 2.0 * rise,
            ]
        });
        Self { pieces }
    }

    /// The share of the distribution below this many standard deviations.
    #[inline]
    pub(super) fn below(&self, deviations: f64) -> f64 {
        let at = (deviations + END) * STEPS_PER_UNIT;
        let piece = count::whole(at);
        match self.pieces.get(usize::try_from(piece).unwrap_or(STEPS)) {
            Some([a, b, c, d]) if at > 0.0 => {
                let share = at - f64::from(piece);
                ((d * share + c) * share + b) * share + a
            }
            _ if at > 0.0 => 1.0,
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_integral() {
        let normal = Normal::new();
        let mut before = 0.0;
        for step in -7000..=7000 {
            let at = f64::from(step) * 0.001;
            let found = normal.below(at);
            let expected = 0.5 * libm::erfc(-at / 2.0_f64.sqrt());
            assert!((found - expected).abs() < 4e-9, "{at}: {found} {expected}");
            assert!(found >= before - 1e-15, "{at}");
            before = found;
        }
        assert_eq!(normal.below(f64::NEG_INFINITY), 0.0);
        assert_eq!(normal.below(f64::INFINITY), 1.0);
    }
}
