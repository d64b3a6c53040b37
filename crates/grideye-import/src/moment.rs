//! Time stamps as people write them, kept to the nanosecond: decimals are read as decimals, never as floating point.

use grideye_frame::days_since_1970;

pub(crate) const NS_PER_S: i64 = 1_000_000_000;
pub(crate) const NS_PER_DAY: i64 = 86_400 * NS_PER_S;

/// What one stamp says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moment {
    /// Nanoseconds since 1970-01-01 UTC.
    Utc(i64),
    /// The same where no zone is said, or only letters, which many zones share.
    Local(i64),
    /// A day: days since 1970-01-01.
    Day(i64),
    /// A time of day in nanoseconds.
    Clock(i64),
    /// A number in a unit that the stamp does not say.
    Number(Decimal),
}

/// A decimal number: `digits` divided by 10 to the power of `scale`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Decimal {
    digits: i128,
    scale: i32,
}

/// More digits than this are cut; a stamp in nanoseconds has 19.
const DIGITS_MAX: usize = 34;

impl Decimal {
    pub(crate) const ONE: Self = Self {
        digits: 1,
        scale: 0,
    };

    /// Of a plain or scientific notation.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let (mantissa, exponent) = match text.split_once(['e', 'E']) {
            Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
            None => (text, 0),
        };
        let unsigned = mantissa.strip_prefix(['-', '+']).unwrap_or(mantissa);
        let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, ""));
        let all_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
        if whole.len() + fraction.len() == 0 || !all_digits(whole) || !all_digits(fraction) {
            return None;
        }
        let fraction = &fraction[..fraction.len().min(DIGITS_MAX.saturating_sub(whole.len()))];
        let digits: i128 = format!("{whole}{fraction}").parse().ok()?;
        let scale = i32::try_from(fraction.len()).ok()?.checked_sub(exponent)?;
        let digits = if mantissa.starts_with('-') {
            -digits
        } else {
            digits
        };
        Some(Self { digits, scale })
    }

    /// In steps of 10 to the power of minus `exponent`: 9 makes nanoseconds of seconds. Rounded half away from zero.
    pub(crate) fn scaled(self, exponent: i32) -> Option<i64> {
        let shift = exponent.checked_sub(self.scale)?;
        let power = 10_i128.checked_pow(shift.unsigned_abs());
        let value = match (shift >= 0, power) {
            (true, power) => self.digits.checked_mul(power?)?,
            (false, None) => 0,
            (false, Some(power)) => (self.digits + self.digits.signum() * power / 2) / power,
        };
        i64::try_from(value).ok()
    }

    pub(crate) fn is_integer(self) -> bool {
        self.scale <= 0 || self.digits == 0
    }
}

/// Whether the day or the month comes first where the year comes last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    DayFirst,
    MonthFirst,
}

/// The moment in a cell's text.
pub(crate) fn parse(text: &str, order: Option<Order>) -> Option<Moment> {
    let text = text
        .trim()
        .trim_end_matches([':', ',', ';'])
        .trim_matches(['[', ']', '(', ')', '<', '>']);
    if let Some(moment) = in_digits(text) {
        return Some(moment);
    }
    if let Some(number) = Decimal::parse(text) {
        return Some(Moment::Number(number));
    }
    if let Some((ns, None)) = clock(text) {
        return Some(Moment::Clock(ns));
    }
    if let Some(moment) = with_named_month(text) {
        return Some(moment);
    }
    let (day, rest) = day(text, order)?;
    if rest.is_empty() {
        return Some(Moment::Day(day));
    }
    let (ns, offset_ns) = clock(
        rest.strip_prefix(['T', 't', ' ', '_', '-', ','])?
            .trim_start(),
    )?;
    moment(day, ns, offset_ns)
}

/// `20210701181407`, with a fraction or without, and with a sign between day and time.
fn in_digits(text: &str) -> Option<Moment> {
    let (first, rest) = digits(text);
    let time = match first.len() {
        14 => format!("{}{rest}", &first[8..]),
        8 => rest
            .strip_prefix(['_', '-', 'T', ' '])
            .filter(|rest| digits(rest).0.len() == 6)?
            .to_owned(),
        _ => return None,
    };
    let part = |from: usize, to: usize| first[from..to].parse().ok();
    let day = days_since_1970(
        part(0, 4).filter(|year| (1_970..2_100).contains(year))?,
        part(4, 6)?,
        part(6, 8)?,
    )?;
    let (ns, offset_ns) = clock(&format!("{}:{}:{}", &time[..2], &time[2..4], &time[4..]))?;
    moment(day, ns, offset_ns)
}

fn moment(day: i64, ns: i64, offset_ns: Option<i64>) -> Option<Moment> {
    let local = day.checked_mul(NS_PER_DAY)?.checked_add(ns)?;
    Some(match offset_ns {
        Some(offset) => Moment::Utc(local.checked_sub(offset)?),
        None => Moment::Local(local),
    })
}

/// The letters of a zone that is not UTC, in a stamp.
pub(crate) fn zone_letters(text: &str) -> Option<&str> {
    let mut words = text
        .split_whitespace()
        .map(|word| word.trim_matches(['(', ')', '[', ']']));
    words.find(|word| is_zone(word) && !["UTC", "GMT"].contains(word))
}

/// Halves of a day, and what loggers write behind a time.
const NO_ZONES: [&str; 9] = [
    "AM", "PM", "INFO", "DEBUG", "WARN", "ERROR", "TRACE", "FATAL", "LOG",
];

/// Whether a word may name a zone: `CET`, `Europe/Berlin`.
fn is_zone(word: &str) -> bool {
    let is_short =
        (2..=5).contains(&word.len()) && word.bytes().all(|byte| byte.is_ascii_uppercase());
    let is_place = word.contains('/') && word.starts_with(|first: char| first.is_ascii_uppercase());
    (is_short || is_place) && !NO_ZONES.contains(&word)
}

/// Whether a time of day has two parts and no fraction: hours and minutes, or minutes and seconds.
pub(crate) fn has_two_parts(text: &str) -> bool {
    text.matches(':').count() == 1 && !text.contains(['.', ','])
}

/// Whether a time of day has only minutes and seconds.
pub(crate) fn is_past_the_hour(text: &str) -> bool {
    text.matches(':').count() == 1 && !has_two_parts(text)
}

const MONTHS: [&str; 12] = [
    "Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec",
];

/// A day with its month's name, as C's `ctime`, mail, the command `date` and system logs have it: `Tue Nov 21 04:09:25 2017`,
/// `21 Nov 2017 04:09:25 +0100`, `Nov 21 04:09:25`; the last has no year, and is a time of day.
fn with_named_month(text: &str) -> Option<Moment> {
    let (mut month, mut day, mut year, mut time) = (None, None, None, String::new());
    let is_date = |word: &&str| {
        !word.contains(':') && word.contains('-') && word.contains(char::is_alphabetic)
    };
    let words = text
        .split([' ', ',', '\t'])
        .flat_map(|word| match is_date(&word) {
            true => word.split('-').collect::<Vec<_>>(),
            false => vec![word],
        });
    for word in words.filter(|word| !word.is_empty()) {
        let number = word.trim_end_matches('.').parse::<i64>().ok();
        let named = MONTHS
            .iter()
            .zip(1_i64..)
            .find(|(name, _)| word.starts_with(**name));
        match (named, number) {
            (Some((_, number)), None) if month.is_none() => month = Some(number),
            (None, Some(number)) if word.len() == 4 && year.is_none() => year = Some(number),
            (None, Some(number)) if word.len() <= 3 && day.is_none() => day = Some(number),
            _ if word.contains(':') && time.is_empty() => word.clone_into(&mut time),
            _ if ["AM", "PM", "am", "pm"].contains(&word)
                || word.starts_with(['+', '-'])
                || is_zone(word) =>
            {
                time = time + " " + word;
            }
            // The day of the week.
            _ if month.is_none() && word.chars().all(char::is_alphabetic) => {}
            _ => return None,
        }
    }
    let (ns, offset_ns) = clock(time.trim())?;
    match year {
        Some(year) => moment(days_since_1970(year, month?, day?)?, ns, offset_ns),
        None => (month.is_some() && day.is_some()).then_some(Moment::Clock(ns)),
    }
}

/// The day that the text begins with, and the text after it.
fn day(text: &str, order: Option<Order>) -> Option<(i64, &str)> {
    let (first, rest) = digits(text);
    if first.len() == 8 {
        let part = |from: usize, to: usize| first[from..to].parse().ok();
        return Some((
            days_since_1970(part(0, 4)?, part(4, 6)?, part(6, 8)?)?,
            rest,
        ));
    }
    let separator = rest
        .chars()
        .next()
        .filter(|character| "-/._".contains(*character))?;
    let (second, rest) = digits(&rest[1..]);
    let (third, rest) = digits(rest.strip_prefix(separator)?);
    let number = |text: &str| text.parse::<i64>().ok();
    let (a, b, c) = (number(first)?, number(second)?, number(third)?);
    let day = match (first.len(), third.len(), order?) {
        (4, ..) => days_since_1970(a, b, c),
        (_, 4, Order::DayFirst) => days_since_1970(c, b, a),
        (_, 4, Order::MonthFirst) => days_since_1970(c, a, b),
        _ => None,
    };
    Some((day?, rest))
}

/// The order of such dates, if these texts have any: told by a number above 12.
pub(crate) fn order_of<'t>(texts: impl Iterator<Item = &'t str>) -> Result<Order, ()> {
    let mut is_there = false;
    for text in texts {
        let mut parts = text.split(['-', '/', '.', '_', ' ', 'T']);
        let numbers = [parts.next(), parts.next(), parts.next()];
        let [Some(first), Some(second), Some(year)] = numbers else {
            continue;
        };
        let (Ok(first), Ok(second), 4) = (first.parse::<u8>(), second.parse::<u8>(), year.len())
        else {
            continue;
        };
        if first > 12 {
            return Ok(Order::DayFirst);
        }
        if second > 12 {
            return Ok(Order::MonthFirst);
        }
        is_there |= first != second;
    }
    // Where there is none, nothing depends on it.
    if is_there {
        Err(())
    } else {
        Ok(Order::DayFirst)
    }
}

fn digits(text: &str) -> (&str, &str) {
    let end = text.find(|character: char| !character.is_ascii_digit());
    text.split_at(end.unwrap_or(text.len()))
}

/// A time of day in nanoseconds, and its zone's offset if it has one.
fn clock(text: &str) -> Option<(i64, Option<i64>)> {
    let (hours, rest) = digits(text);
    let separator = rest
        .chars()
        .next()
        .filter(|character| ":_-".contains(*character))?;
    let (minutes, rest) = digits(&rest[1..]);
    if !(1..=2).contains(&hours.len()) || minutes.len() != 2 {
        return None;
    }
    let (seconds, rest) = match rest.strip_prefix(separator) {
        Some(rest) => {
            let (seconds, rest) = digits(rest);
            (Some(seconds), rest)
        }
        None => (None, rest),
    };
    let (fraction, rest) = match rest.strip_prefix(['.', ',', ':', separator]) {
        Some(rest) => digits(rest),
        None => ("", rest),
    };
    let fraction_ns = Decimal::parse(&format!("0.{fraction}0"))?.scaled(9)?;
    // A fraction is one of seconds: `16:00.5` are minutes and seconds.
    let (hours, minutes, seconds) = match seconds {
        Some(seconds) => (hours, minutes, seconds),
        None if fraction.is_empty() => (hours, minutes, "0"),
        None => ("0", hours, minutes),
    };
    let [hours, minutes, seconds] = [hours, minutes, seconds].map(|text| text.parse::<i64>().ok());
    let (mut hours, minutes, seconds) = (hours?, minutes?, seconds?);
    let rest = rest.trim_start();
    let half = rest.get(..2).map(str::to_ascii_uppercase);
    let rest = match half.as_deref() {
        Some("AM" | "PM") if (1..=12).contains(&hours) => {
            hours = hours % 12 + if half.as_deref() == Some("PM") { 12 } else { 0 };
            &rest[2..]
        }
        _ => rest,
    };
    if hours > 23 || minutes > 59 || seconds > 60 {
        return None;
    }
    let ns = ((hours * 60 + minutes) * 60 + seconds) * NS_PER_S + fraction_ns;
    Some((ns, offset_ns(rest.trim())?))
}

/// `Some(None)` for none, or for letters that many zones share; `None` for something else.
pub(crate) fn offset_ns(text: &str) -> Option<Option<i64>> {
    // `UTC+1` is one hour east, and `+01:00[Europe/Berlin]` says it twice.
    let named = text
        .strip_prefix("UTC")
        .or_else(|| text.strip_prefix("GMT"))
        .filter(|rest| !rest.is_empty());
    let text = named.unwrap_or(text).split('[').next().unwrap_or_default();
    let sign = match text.chars().next() {
        None => return Some(None),
        Some('+') => 1,
        Some('-') => -1,
        Some(_) if ["Z", "z", "UTC", "GMT"].contains(&text) => return Some(Some(0)),
        Some(_) => return is_zone(text.trim_matches(['(', ')', '[', ']'])).then_some(None),
    };
    let plain: String = text[1..].split(':').collect();
    if !plain.bytes().all(|byte| byte.is_ascii_digit()) || ![1, 2, 4].contains(&plain.len()) {
        return None;
    }
    let hours: i64 = plain[..plain.len().min(2)].parse().ok()?;
    let minutes: i64 = plain.get(2..4).map_or(Ok(0), str::parse).ok()?;
    Some(Some(sign * (hours * 60 + minutes) * 60 * NS_PER_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Option<Moment> {
        parse(text, Some(Order::DayFirst))
    }

    /// Seconds by `date -d … +%s`.
    #[test]
    fn stamps_are_read_as_people_write_them() {
        let whole = 1_625_163_247 * NS_PER_S;
        let part = whole + 274_925_000;
        for (text, ns) in [
            ("2021-07-01T18:14:07Z", whole),
            ("2021-07-01 18:14:07", whole),
            ("2021/07/01 18:14:07", whole),
            ("20210701T18:14:07Z", whole),
            ("2021-07-01T18:14:07.274925", part),
            ("2021-07-01T18:14:07,274925Z", part),
            ("2021-07-01 20:14:07.274925+02:00", part),
            ("2021-07-01T12:44:07.274925-0530", part),
            ("2021-07-01_18-14-07", whole),
            ("2021-07-01 06:14:07 PM", whole),
            ("01/07/2021 18:14:07", whole),
            ("1.7.2021 18:14:07:", whole),
            ("Thu Jul  1 18:14:07 2021", whole),
            ("Thu Jul  1 18:14:07 UTC 2021", whole),
            ("Thu Jul  1 18:14:07 CEST 2021", whole),
            ("Thu, 1 Jul 2021 20:14:07 +0200", whole),
            ("01-Jul-2021 18:14:07", whole),
            ("Jul 1, 2021 6:14:07 PM", whole),
            ("[2021-07-01 18:14:07]", whole),
            ("2021-07-01T18:14:07.123456789Z", whole + 123_456_789),
        ] {
            let found = match at(text) {
                Some(Moment::Utc(found) | Moment::Local(found)) => Some(found),
                _ => None,
            };
            assert_eq!(found, Some(ns), "{text}");
        }
        assert_eq!(at("2021-07-01 18:14:07Z"), Some(Moment::Utc(whole)));
        assert_eq!(at("2021-07-01 18:14:07 CEST"), Some(Moment::Local(whole)));
        assert_eq!(zone_letters("Thu Jul  1 18:14:07 CEST 2021"), Some("CEST"));
        assert_eq!(zone_letters("Thu Jul  1 06:14:07 PM UTC 2021"), None);
        assert_eq!(at("2021-07-01"), Some(Moment::Day(18_809)));
        let clock = ((18 * 60 + 14) * 60 + 7) * NS_PER_S;
        assert_eq!(
            at("14:07.5"),
            Some(Moment::Clock((14 * 60 + 7) * NS_PER_S + NS_PER_S / 2))
        );
        for text in [
            "18:14:07",
            "18_14_07",
            "18:14:07:",
            "6:14:07 pm",
            "Jul  1 18:14:07",
        ] {
            assert_eq!(at(text), Some(Moment::Clock(clock)), "{text}");
        }
        for text in [
            "",
            "person",
            "24:00:00",
            "2021-13-01",
            "18:6",
            "2021-07-01T",
            "1-2",
            "p(0,0)",
        ] {
            assert_eq!(at(text), None, "{text}");
        }
    }

    #[test]
    fn decimals_are_exact_in_any_notation() {
        let ns = |text: &str| Decimal::parse(text).and_then(|number| number.scaled(9));
        assert_eq!(ns("1795199399.998"), Some(1_795_199_399_998_000_000));
        assert_eq!(ns("1.795199399998e+09"), Some(1_795_199_399_998_000_000));
        assert_eq!(ns("1521008322.810246"), Some(1_521_008_322_810_246_000));
        assert_eq!(ns("0.0000000015"), Some(2));
        assert_eq!(ns("-1.5"), Some(-1_500_000_000));
        assert_eq!(ns(".5"), Some(500_000_000));
        assert_eq!(ns("1e-400"), Some(0));
        for text in ["", ".", "1e", "1x", "nan", "1e99", "--1"] {
            assert_eq!(ns(text), None, "{text}");
        }
    }

    #[test]
    fn the_order_of_day_and_month_is_told_by_a_number_above_12() {
        assert_eq!(
            order_of(["03/04/2021 1:00:00", "13/04/2021"].into_iter()),
            Ok(Order::DayFirst)
        );
        assert_eq!(order_of(["03/14/2021"].into_iter()), Ok(Order::MonthFirst));
        assert_eq!(order_of(["03/04/2021"].into_iter()), Err(()));
        assert_eq!(
            order_of(["2021-03-04", "x"].into_iter()),
            Ok(Order::DayFirst)
        );
    }
}
