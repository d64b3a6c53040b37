//! The conversions between numbers that the standard library has no lossless form of.

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

/// The count at or below a float: zero below zero and for not-a-number, the largest count above the range.
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a saturating conversion is what is wanted"
)]
#[must_use]
pub const fn floor(length: f64) -> usize {
    length as usize
}

/// A temperature, or a share of a pixel, in single precision, which is what the formats of frames have: 2 µK at 20 °C.
#[must_use]
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "fewer digits are what is wanted"
)]
pub const fn single(value: f64) -> f32 {
    value as f32
}

/// The least and the greatest of some numbers.
#[must_use]
pub fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    })
}
