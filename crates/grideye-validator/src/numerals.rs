//! Numbers in words: fixed decimals with their sign, counts of frames, times.

use std::time::Duration;

/// A number with fixed decimals, a proper minus sign, and no minus before zero.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let digits = format!("{value:.decimals$}");
    match digits.strip_prefix('-') {
        Some(rest) if rest.chars().all(|digit| matches!(digit, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => digits,
    }
}

/// The same with a plus sign before what is above zero.
pub(crate) fn signed(value: f64, decimals: usize) -> String {
    let digits = fixed(value, decimals);
    let is_zero = digits.chars().all(|digit| matches!(digit, '0' | '.'));
    if value > 0.0 && !is_zero {
        format!("+{digits}")
    } else {
        digits
    }
}

/// A number of frames: `1 frame`, `3 frames`.
pub(crate) fn frames(number: usize) -> String {
    if number == 1 {
        "1 frame".to_owned()
    } else {
        format!("{number} frames")
    }
}

/// A time in seconds.
pub(crate) fn seconds(time: Duration) -> String {
    format!("{:.1} s", time.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(fixed(-0.004, 2), "0.00");
        assert_eq!(fixed(-1.5, 1), "\u{2212}1.5");
        assert_eq!(signed(0.25, 2), "+0.25");
        assert_eq!(signed(0.001, 2), "0.00");
        assert_eq!(signed(-2.0, 1), "\u{2212}2.0");
    }
}
