//! Conversions of small numbers.

#![expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "a score, seconds and counts of frames lose nothing that matters"
)]

pub(crate) const fn single(value: f64) -> f32 {
    value as f32
}

pub(crate) const fn float(value: i32) -> f32 {
    value as f32
}

pub(crate) const fn double(count: u64) -> f64 {
    count as f64
}

/// The nearest whole number.
pub(crate) fn whole(value: f32) -> i32 {
    libm::roundf(value) as i32
}
