//! Time stamps in UTC, to the nanosecond.

use grideye_frame::{day_of, days_since_1970};
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
const DAY_S: i64 = 86_400;
/// Milliseconds since 1970 and seconds of a scene have another number of digits.
const UNIX_DIGITS: usize = 10;

impl Utc {
    /// Parses ISO 8601 with a time zone, or Unix seconds of ten digits (2001 to 2199); either with a fraction.
    pub(crate) fn parse(text: &str) -> Result<Self, NoUtc> {
        let (head, zone) = match split_zone(text) {
            Some((head, zone_s)) => (head, Some(zone_s)),
            None => (text, None),
        };
        let (whole, fraction) = match head.split_once('.') {
            Some((whole, fraction)) => (whole, nanoseconds(fraction).ok_or(NoUtc::Malformed)?),
            None => (head, 0),
        };
        let seconds = match (seconds_since_1970(whole), zone) {
            (Some(seconds), Some(zone_s)) => seconds - zone_s,
            (Some(_), None) => return Err(NoUtc::Local),
            (None, None) if whole.len() == UNIX_DIGITS => digits(whole).ok_or(NoUtc::Malformed)?,
            _ => return Err(NoUtc::Malformed),
        };
        let is_known = day_of(seconds.div_euclid(DAY_S)).0 <= 2199;
        let ns = seconds * NS_PER_S + fraction;
        is_known.then_some(Self { ns }).ok_or(NoUtc::Malformed)
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
        let (seconds, ns) = (self.ns.div_euclid(NS_PER_S), self.ns.rem_euclid(NS_PER_S));
        let (year, month, day) = day_of(seconds.div_euclid(DAY_S));
        let of_day = seconds.rem_euclid(DAY_S);
        let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
        let time = format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}");
        let fraction = format!(".{ns:09}");
        let fraction = fraction.trim_end_matches('0').trim_end_matches('.');
        formatter.pad(&format!("{time}{fraction}Z"))
    }
}

/// The text before a time zone, and the zone's seconds ahead of UTC.
fn split_zone(text: &str) -> Option<(&str, i64)> {
    if let Some(head) = text.strip_suffix(['Z', 'z']) {
        return Some((head, 0));
    }
    // The date has dashes too, so a zone must follow a colon.
    let colon = text.find(':')?;
    let sign = colon + text.get(colon..)?.rfind(['+', '-'])?;
    let (head, zone) = text.split_at_checked(sign)?;
    let ahead = if zone.starts_with('+') { 1 } else { -1 };
    let (hours, minutes) = match zone.as_bytes().get(1..)? {
        [h1, h2] => ([*h1, *h2], [b'0', b'0']),
        [h1, h2, b':', m1, m2] | [h1, h2, m1, m2] => ([*h1, *h2], [*m1, *m2]),
        _ => return None,
    };
    let (hours, minutes) = (number(&hours)?, number(&minutes)?);
    let is_zone = hours <= 14 && minutes <= 59;
    is_zone.then_some((head, ahead * (hours * 60 + minutes) * 60))
}

/// Seconds since 1970 of `2026-11-25T10:00:00`, with `T` or a blank, as if it were UTC.
fn seconds_since_1970(text: &str) -> Option<i64> {
    let (date, time) = text.split_once(['T', 't', ' '])?;
    let [y1, y2, y3, y4, b'-', month @ .., b'-', d1, d2] = date.as_bytes() else {
        return None;
    };
    let [h1, h2, b':', m1, m2, b':', s1, s2] = time.as_bytes() else {
        return None;
    };
    if month.len() != 2 {
        return None;
    }
    let day = days_since_1970(
        number(&[*y1, *y2, *y3, *y4])?,
        number(month)?,
        number(&[*d1, *d2])?,
    )?;
    let (hour, minute, second) = (
        number(&[*h1, *h2])?,
        number(&[*m1, *m2])?,
        number(&[*s1, *s2])?,
    );
    let is_time = hour <= 23 && minute <= 59 && second <= 59;
    is_time.then_some(((day * 24 + hour) * 60 + minute) * 60 + second)
}

fn nanoseconds(fraction: &str) -> Option<i64> {
    let is_fraction = (1..=9).contains(&fraction.len());
    is_fraction
        .then(|| digits(&format!("{fraction:0<9}")))
        .flatten()
}

fn digits(text: &str) -> Option<i64> {
    number(text.as_bytes())
}

/// Parses a short number of digits only.
fn number(text: &[u8]) -> Option<i64> {
    text.iter().try_fold(0, |number, byte| {
        byte.is_ascii_digit()
            .then(|| number * 10 + i64::from(byte - b'0'))
    })
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
