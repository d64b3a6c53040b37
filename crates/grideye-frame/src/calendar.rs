//! Days of the Gregorian calendar, from 1970 to 2199.

/// Days from 1970-01-01 to a day with this year, month (1 to 12) and day (1 to 31); `None` if it does not exist or is not
/// within 1970 to 2199.
///
/// ```
/// assert_eq!(grideye_frame::days_since_1970(2000, 3, 1), Some(11_017));
/// assert_eq!(grideye_frame::days_since_1970(2026, 2, 29), None);
/// ```
#[must_use]
pub fn days_since_1970(year: i64, month: i64, day: i64) -> Option<i64> {
    if !(1970..=2199).contains(&year) || !(1..=12).contains(&month) {
        return None;
    }
    let first = days_before_month(12 * year + month);
    let days = days_before_month(12 * year + month + 1) - first;
    (1..=days)
        .contains(&day)
        .then(|| first - days_before_month(JANUARY_1970) + day - 1)
}

/// Year, month and day of a day from 1970 to 2199; the inverse of [`days_since_1970`].
#[must_use]
pub fn day_of(days_since_1970: i64) -> (i64, i64, i64) {
    let days = days_since_1970 + days_before_month(JANUARY_1970);
    // No month has more than 31 days, so this is never too late.
    let mut month = JANUARY_1970 + days_since_1970.max(0) / 31;
    while days_before_month(month + 1) <= days {
        month += 1;
    }
    let day = days - days_before_month(month) + 1;
    ((month - 1) / 12, (month - 1) % 12 + 1, day)
}

const JANUARY_1970: i64 = 12 * 1970 + 1;

/// Days before a month, counted from March of the year 0: in a year that begins in March, the leap day comes last.
/// Months count from the December before the year 0.
const fn days_before_month(month: i64) -> i64 {
    let months = month - 3;
    let (year, month) = (months.div_euclid(12), months.rem_euclid(12));
    365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From `date -u -d DAY +%s`, divided by 86,400.
    #[test]
    fn days_are_those_of_the_date_program() {
        for (day, days) in [
            ((1970, 1, 1), 0),
            ((1999, 12, 31), 10_956),
            ((2000, 2, 29), 11_016),
            ((2026, 11, 25), 20_782),
            ((2100, 3, 1), 47_541),
            ((2199, 12, 31), 84_005),
        ] {
            let (year, month, date) = day;
            assert_eq!(days_since_1970(year, month, date), Some(days), "{day:?}");
            assert_eq!(day_of(days), day);
        }
        for (year, month, day) in [
            (1969, 12, 31),
            (2200, 1, 1),
            (2100, 2, 29),
            (2026, 13, 1),
            (2026, 4, 31),
            (2026, 4, 0),
        ] {
            assert_eq!(
                days_since_1970(year, month, day),
                None,
                "{year}-{month}-{day}"
            );
        }
    }
}
