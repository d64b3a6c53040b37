//! Text for people: escaping, signed numbers, times, counts.

use std::fmt::Display;
use std::time::Duration;

/// Escapes text for an element or a quoted attribute.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            _ => safe.push(character),
        }
    }
    safe
}

/// For the middle of a sentence: the first letter in lower case.
#[must_use]
pub fn lower(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_lowercase);
    first.collect::<String>() + letters.as_str()
}

/// For the beginning of one.
#[must_use]
pub fn upper(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.collect::<String>() + letters.as_str()
}

/// A number with fixed decimals and a true minus sign; never "−0".
#[must_use]
pub fn fixed(value: f64, decimals: usize) -> String {
    let digits = format!("{value:.decimals$}");
    match digits.strip_prefix('-') {
        Some(rest) if rest.chars().all(|digit| matches!(digit, '0' | '.')) => rest.to_owned(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => digits,
    }
}

/// [`fixed`], with a plus sign before positive numbers.
#[must_use]
pub fn signed(value: f64, decimals: usize) -> String {
    let digits = fixed(value, decimals);
    let is_zero = digits.chars().all(|digit| matches!(digit, '0' | '.'));
    if value > 0.0 && !is_zero {
        format!("+{digits}")
    } else {
        digits
    }
}

/// A number of things: `1 frame`, `3 frames`.
#[must_use]
pub fn counted(number: impl Display, what: &str) -> String {
    match number.to_string().as_str() {
        "1" => format!("1 {what}"),
        number => format!("{number} {what}s"),
    }
}

/// A number of frames.
#[must_use]
pub fn frames(number: usize) -> String {
    counted(number, "frame")
}

/// A time in seconds with one decimal.
#[must_use]
pub fn seconds(time: Duration) -> String {
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
        assert_eq!([1, 3].map(frames), ["1 frame", "3 frames"]);
        assert_eq!(seconds(Duration::from_millis(1_250)), "1.2 s");
    }

    #[test]
    fn markup_is_escaped() {
        assert_eq!(
            escape(r#"<b a="x">&'"#),
            "&lt;b a=&quot;x&quot;&gt;&amp;&#39;"
        );
    }
}
