//! Time stamps in UTC, to the nanosecond.

use jiff::Timestamp;
use jiff::fmt::temporal::Pieces;
use std::fmt;

/// A moment in UTC, printed as `2026-11-25T10:00:00.123Z`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Utc {
    /// Nanoseconds since 1970-01-01.
    pub ns: i64,
}

/// Why a text is no time stamp.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NoUtc {
    /// It is a date and time, but of no time zone.
    Local,
    Malformed,
}

const NS_PER_S: i64 = 1_000_000_000;
const HOUR_S: i32 = 3600;
/// Milliseconds since 1970 and seconds of a scene have another number of digits.
const UNIX_DIGITS: usize = 10;

impl Utc {
    /// Parses ISO 8601 with a time zone, or Unix seconds of ten digits (2001 to 2199); either with a fraction.
    pub(crate) fn parse(text: &str) -> Result<Self, NoUtc> {
        let ns = match unix_ns(text) {
            Some(ns) => Some(ns),
            None => iso_ns(text)?,
        };
        ns.map(|ns| Self { ns }).ok_or(NoUtc::Malformed)
    }

    /// This many seconds later, to the nanosecond.
    pub(crate) fn after_s(self, seconds: f64) -> Self {
        let later = std::time::Duration::try_from_secs_f64(seconds).unwrap_or_default();
        let later_ns = i64::try_from(later.as_nanos()).unwrap_or(i64::MAX);
        Self {
            ns: self.ns.saturating_add(later_ns),
        }
    }

    /// Seconds from an earlier moment to this one.
    pub(crate) fn since_s(self, earlier: Self) -> f64 {
        let ns = self.ns.saturating_sub(earlier.ns);
        std::time::Duration::from_nanos(u64::try_from(ns).unwrap_or(0)).as_secs_f64()
    }
}

impl fmt::Display for Utc {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // All 64 bits are within the years that it knows.
        let moment = Timestamp::from_nanosecond(self.ns.into()).unwrap_or_default();
        formatter.pad(&moment.to_string())
    }
}

fn unix_ns(text: &str) -> Option<i64> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, "0"));
    let are_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let is_fraction = (1..=9).contains(&fraction.len()) && are_digits(fraction);
    let seconds: i64 = whole
        .parse()
        .ok()
        .filter(|_| whole.len() == UNIX_DIGITS && are_digits(whole))?;
    let fraction_ns: i64 = format!("{fraction:0<9}")
        .parse()
        .ok()
        .filter(|_| is_fraction)?;
    let is_known = seconds < UNIX_END_S;
    is_known.then_some(seconds * NS_PER_S + fraction_ns)
}

/// The end of 2199.
const UNIX_END_S: i64 = 7_258_118_400;

fn iso_ns(text: &str) -> Result<Option<i64>, NoUtc> {
    // Seconds must be there, and no leap second, whose time would be that of the next.
    let has_seconds = text
        .get(16..19)
        .is_some_and(|end| end.starts_with(':') && end != ":60");
    let Some(pieces) = Pieces::parse(text).ok().filter(|_| has_seconds) else {
        return Ok(None);
    };
    let local = pieces.date().to_datetime(pieces.time().unwrap_or_default());
    let offset = pieces.to_numeric_offset().ok_or(NoUtc::Local)?;
    let is_known = (1970..=2199).contains(&local.year()) && offset.seconds().abs() < 15 * HOUR_S;
    let moment = offset.to_timestamp(local).ok().filter(|_| is_known);
    Ok(moment.and_then(|moment| i64::try_from(moment.as_nanosecond()).ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seconds from `date -u -d STAMP +%s`.
    #[test]
    fn stamps_are_exact_to_the_nanosecond() {
        for (text, seconds, ns) in [
            ("2026-11-25T10:00:00Z", 1_795_600_800, 0),
            ("2026-11-25T10:00:00.123Z", 1_795_600_800, 123_000_000),
            ("2026-11-25 10:00:00.000000001z", 1_795_600_800, 1),
            ("2026-11-25t11:30:00+01:30", 1_795_600_800, 0),
            ("2026-11-24T22:00:00.5-1200", 1_795_600_800, 500_000_000),
            ("2026-11-25 12:00:00+02", 1_795_600_800, 0),
            ("2000-02-29T23:59:59.999999999Z", 951_868_799, 999_999_999),
            ("1970-01-01T00:00:00Z", 0, 0),
            ("1795600800", 1_795_600_800, 0),
            ("1795600800.000000001", 1_795_600_800, 1),
            ("1000000000.5", 1_000_000_000, 500_000_000),
        ] {
            let found = Utc::parse(text).map(|utc| utc.ns);
            assert_eq!(found, Ok(seconds * 1_000_000_000 + ns), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused() {
        for local in ["2026-11-25T10:00:00", "2026-11-25 10:00:00.5"] {
            assert_eq!(Utc::parse(local), Err(NoUtc::Local), "{local}");
        }
        let wrong = "|Z|now|10:00:00Z|2026-11-25|2026-11-25Z|2026-11-25T10:00Z|2026-02-29T10:00:00Z|2026-11-25T24:00:00Z|\
                     2026-11-25T10:00:60Z|2026-11-25T10:00:00.Z|2026-11-25T10:00:00.1234567890Z|26-11-25T10:00:00Z|\
                     2026-11-25T10:00:00+15|2026-11-25T10:00:00+1|2026-11-25T10:00:00 UTC|2026-1-25T10:00:00Z|\
                     1795600800Z|1795600800.|179560080|1795600800123|-1795600800|9000000000|1.7956e9|12.5";
        for text in wrong.split('|') {
            assert_eq!(Utc::parse(text), Err(NoUtc::Malformed), "{text}");
        }
    }

    #[test]
    fn a_printed_stamp_reads_as_itself() {
        for text in [
            "2026-11-25T10:00:00Z",
            "2000-02-29T23:59:59.999999999Z",
            "2026-11-25T00:00:00.05Z",
        ] {
            assert_eq!(Utc::parse(text).unwrap().to_string(), text);
        }
    }
}
