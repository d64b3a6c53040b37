//! What a script's text says: a time with its unit, and where in the text something stands.

use crate::script::error::Place;
use alloc::borrow::ToOwned;
use core::ops::Range;
use core::time::Duration;

/// Line and column of the beginning of a span.
pub(super) fn place(text: &str, origin: &str, span: Range<usize>) -> Place {
    let before = text.get(..span.start).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.get(line_start..).unwrap_or_default();
    Place(
        origin.to_owned(),
        before.matches('\n').count() + 1,
        line.chars().count() + 1,
    )
}

/// A decimal number and a unit, to the nanosecond.
pub(super) fn duration(text: &str) -> Option<Duration> {
    let text = text.trim();
    let digits_end = text.find(|c: char| !c.is_ascii_digit() && c != '.')?;
    let (number, unit) = text.split_at(digits_end);
    let nanoseconds_per_unit: u128 = match unit.trim() {
        "ns" => 1,
        "us" | "µs" | "μs" => 1_000,
        "ms" => 1_000_000,
        "s" => 1_000_000_000,
        "min" => 60_000_000_000,
        "h" => 3_600_000_000_000,
        _ => return None,
    };
    let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
    // Beyond twelve digits a fraction of an hour is less than a nanosecond.
    if whole.is_empty() || fraction.is_empty() || whole.len() > 20 || fraction.len() > 12 {
        return None;
    }
    let scale = 10_u128.checked_pow(u32::try_from(fraction.len()).ok()?)?;
    let parts = whole.parse::<u128>().ok()? * scale + fraction.parse::<u128>().ok()?;
    let nanoseconds = parts.checked_mul(nanoseconds_per_unit)? / scale;
    Some(Duration::from_nanos(u64::try_from(nanoseconds).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString as _;

    #[test]
    fn times_are_exact_to_the_nanosecond() {
        let rows = [
            ("12.5 s", Some(12_500_000_000)),
            ("0 s", Some(0)),
            ("1ns", Some(1)),
            ("1.5 us", Some(1_500)),
            ("2 µs", Some(2_000)),
            (" 200 ms ", Some(200_000_000)),
            ("0.1 min", Some(6_000_000_000)),
            ("24 h", Some(86_400_000_000_000)),
            ("0.000000001 s", Some(1)),
            ("0.9 ns", Some(0)),
            ("600 h 1", None),
            ("12.5", None),
            ("s", None),
            ("-1 s", None),
            (".5 s", None),
            ("1. s", None),
            ("1.2.3 s", None),
            ("1e3 s", None),
            ("1 S", None),
            ("99999999999999999999 h", None),
            ("999999999999999999999 s", None),
            ("0.1234567890123 h", None),
            ("", None),
        ];
        for (text, nanoseconds) in rows {
            let expected = nanoseconds.map(Duration::from_nanos);
            assert_eq!(duration(text), expected, "{text:?}");
        }
    }

    #[test]
    fn places_count_characters_from_one() {
        let text = "a = 1\nµ = \"2\"\n";
        let at = |start: usize| place(text, "f.toml", start..start).to_string();
        assert_eq!(at(0), "f.toml:1:1");
        assert_eq!(at(6), "f.toml:2:1");
        assert_eq!(at(8), "f.toml:2:2");
        assert_eq!(at(text.len()), "f.toml:3:1");
        assert_eq!(at(99), "f.toml:3:1");
    }
}
