//! Lossy number conversions that the standard library leaves to `as`.

/// A count as a float.
#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts here are grid points, pixels and frames, far below 2^52"
)]
#[must_use]
pub const fn float(count: usize) -> f64 {
    count as f64
}

/// The count at or below a float: 0 for negative numbers and NaN, the largest count above the range.
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion should saturate"
)]
#[must_use]
pub const fn floor(length: f64) -> usize {
    length as usize
}

/// The same for few: fewer instructions.
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the conversion should saturate"
)]
#[must_use]
pub const fn whole(length: f64) -> u32 {
    length as u32
}

/// A temperature or a pixel share in single precision, as frame formats store it (2 µK at 20 °C).
#[must_use]
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "frame formats store fewer digits"
)]
pub const fn single(value: f64) -> f32 {
    value as f32
}

/// The smallest and the largest of some numbers.
#[must_use]
pub fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}
