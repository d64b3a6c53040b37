//! Converts between counts and lengths, and finds round steps for a scale.

/// A count as a length.
#[must_use]
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts here are dots, characters and frames, far below 2^53"
)]
pub const fn float(count: usize) -> f64 {
    count as f64
}

/// A length as a count: rounded, and 0 if negative or NaN.
#[must_use]
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "rounded and not negative; a canvas cuts off what lies beyond it"
)]
pub fn whole(length: f64) -> usize {
    length.round().max(0.0) as usize
}

/// The smallest of 1, 2, 5, 10 … thousandths that is at least `length`; at most 10⁶.
#[must_use]
pub fn round_step(length: f64) -> f64 {
    let mut decade = 1e-3;
    while decade < 1e6 {
        for factor in [1.0, 2.0, 5.0] {
            if factor * decade >= length - 1e-9 {
                return factor * decade;
            }
        }
        decade *= 10.0;
    }
    decade
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round_and_no_shorter_than_asked() {
        for (length, step) in [
            (0.0, 1e-3),
            (0.0011, 2e-3),
            (0.1, 0.1),
            (0.21, 0.5),
            (0.6, 1.0),
            (2.0, 2.0),
            (700.0, 1000.0),
            (1e9, 1e6),
        ] {
            let found = round_step(length);
            assert!((found - step).abs() < 1e-9 * step, "{length}: {found}");
        }
    }

    #[test]
    fn lengths_below_zero_become_zero() {
        assert_eq!([-3.0, f64::NAN, 0.5, 1.49].map(whole), [0, 0, 1, 1]);
    }
}
