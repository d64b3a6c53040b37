//! Round lengths for the rulers of drawings.

/// The next of 1, 2, 5, 10 … of at least `length`.
pub(crate) fn round_step(length: f64) -> f64 {
    let mut step = 1e-3;
    while step < 1e6 {
        for factor in [1.0, 2.0, 5.0] {
            if factor * step >= length {
                return factor * step;
            }
        }
        step *= 10.0;
    }
    step
}
