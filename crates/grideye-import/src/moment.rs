//! Time stamps as people write them, kept to the nanosecond: decimals are read as decimals, never as floating point.

use grideye_frame::days_since_1970;

pub(crate) const NS_PER_S: i64 = 1_000_000_000;
pub(crate) const NS_PER_DAY: i64 = 86_400 * NS_PER_S;

/// What one stamp says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moment {
    /// Nanoseconds since 1970-01-01 UTC.
    Utc(i64),
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
    let text = text.trim().trim_end_matches([':', ',', ';']);
    if let Some(number) = Decimal::parse(text) {
        return Some(Moment::Number(number));
    }
    if let Some((ns, None)) = clock(text) {
        return Some(Moment::Clock(ns));
    }
    if let Some(moment) = unix_date(text) {
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
    utc(day, ns, offset_ns.unwrap_or(0))
}

fn utc(day: i64, ns: i64, offset_ns: i64) -> Option<Moment> {
    let midnight = day.checked_mul(NS_PER_DAY)?;
    midnight.checked_add(ns - offset_ns).map(Moment::Utc)
}

const MONTHS: [&str; 12] = [
    "Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec",
];

/// `Tue Nov 21 04:09:25 2017`, as C's `ctime` and the command `date` print it; the latter adds a zone, only UTC of which
/// is unambiguous.
fn unix_date(text: &str) -> Option<Moment> {
    let mut words: Vec<&str> = text.split_whitespace().collect();
    if words.len() == 6 {
        ["UTC", "GMT"].contains(&words[4]).then_some(())?;
        words.remove(4);
    }
    let [_, month, day, time, year] = words[..] else {
        return None;
    };
    let month = MONTHS.iter().position(|name| *name == month)?;
    let month = i64::try_from(month).ok()? + 1;
    let day = days_since_1970(year.parse().ok()?, month, day.parse().ok()?)?;
    utc(day, clock(time)?.0, 0)
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
        Some(rest) => digits(rest),
        None => ("0", rest),
    };
    let (fraction, rest) = match rest.strip_prefix(['.', ',', ':']) {
        Some(rest) => digits(rest),
        None => ("", rest),
    };
    let fraction_ns = Decimal::parse(&format!("0.{fraction}0"))?.scaled(9)?;
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

/// `Some(None)` for none, `None` for something else.
fn offset_ns(text: &str) -> Option<Option<i64>> {
    let sign = match text.chars().next() {
        None => return Some(None),
        Some('+') => 1,
        Some('-') => -1,
        Some(_) if ["Z", "z", "UTC", "GMT"].contains(&text) => return Some(Some(0)),
        Some(_) => return None,
    };
    let plain: String = text[1..].split(':').collect();
    if !plain.bytes().all(|byte| byte.is_ascii_digit()) || ![2, 4].contains(&plain.len()) {
        return None;
    }
    let hours: i64 = plain[..2].parse().ok()?;
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
            ("2021-07-01T18:14:07.123456789Z", whole + 123_456_789),
        ] {
            assert_eq!(at(text), Some(Moment::Utc(ns)), "{text}");
        }
        assert_eq!(at("2021-07-01"), Some(Moment::Day(18_809)));
        let clock = ((18 * 60 + 14) * 60 + 7) * NS_PER_S;
        for text in ["18:14:07", "18_14_07", "18:14:07:", "6:14:07 pm"] {
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
