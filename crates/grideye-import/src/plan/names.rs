//! What columns are by their names.

use crate::columns::Role;
use grideye_frame::{COLUMNS, PIXELS};
use std::collections::BTreeMap;

/// A name without what people add to it: `Thermistor (C)` and `thermistor_c` are one.
fn plain(name: &str) -> String {
    let letters = name.chars().filter(char::is_ascii_alphanumeric);
    letters.map(|letter| letter.to_ascii_lowercase()).collect()
}

/// The role that a name gives to a column of one value.
pub(super) fn role(name: &str) -> Option<Role> {
    let plain = plain(name);
    let is_one_of = |names: &[&str]| names.contains(&plain.as_str());
    if plain.starts_with("therm") && !plain.starts_with("thermal") {
        return Some(Role::Thermistor);
    }
    let time = ["time", "stamp", "date", "epoch", "utc", "millis"];
    if time.iter().any(|word| plain.contains(word))
        || is_one_of(&["when", "ts", "t", "ms", "us", "clock", "seconds", "tbootns"])
    {
        return Some(Role::Time);
    }
    if is_one_of(&[
        "seq",
        "sequence",
        "index",
        "idx",
        "frame",
        "frameid",
        "frameno",
        "framenumber",
        "framenum",
        "no",
        "n",
        "row",
        "unnamed0",
    ]) {
        return Some(Role::Number);
    }
    if is_one_of(&["sensor", "sensorid", "sensorname"]) {
        return Some(Role::Sensor);
    }
    if is_one_of(&["device", "deviceid", "devicename", "node", "nodeid"]) {
        return Some(Role::Device);
    }
    is_one_of(&["boot"]).then_some(Role::Boot)
}

/// The power of ten between the unit in a name and nanoseconds, if it names one.
pub(super) fn unit(name: &str) -> Option<i32> {
    let words = name.split(|character: char| !character.is_ascii_alphanumeric());
    words
        .rev()
        .find_map(|word| match word.to_ascii_lowercase().as_str() {
            "ns" | "nanoseconds" => Some(0),
            "us" | "usec" | "micros" | "microseconds" => Some(3),
            "ms" | "msec" | "millis" | "milliseconds" => Some(6),
            "s" | "sec" | "seconds" => Some(9),
            _ => None,
        })
}

/// The integers in a name, and the name without them.
fn numbers(name: &str) -> (String, Vec<usize>) {
    let (mut stem, mut numbers, mut digits) = (String::new(), Vec::new(), String::new());
    for character in name.chars().chain(core::iter::once(' ')) {
        if character.is_ascii_digit() {
            digits.push(character);
            continue;
        }
        if !digits.is_empty() {
            numbers.extend(digits.parse::<usize>());
            digits.clear();
        }
        if character.is_ascii_alphabetic() {
            stem.push(character.to_ascii_lowercase());
        }
    }
    (stem, numbers)
}

/// The numbers in a name, and its column.
type Numbered = (Vec<usize>, usize);
type Family = Vec<Numbered>;

/// The columns of the pixels in order, by names that count: `p0` to `p63`, `pixel_1` to `pixel_64`, `r0c0` to `r7c7`,
/// `t00` to `t77`. `Err` has the number of pixels of another sensor.
pub(super) fn pixels(names: &[String]) -> Result<Option<Vec<usize>>, usize> {
    let mut families: BTreeMap<(String, usize), Family> = BTreeMap::new();
    for (column, name) in names.iter().enumerate() {
        let (stem, numbers) = numbers(name);
        if matches!(numbers.len(), 1..=2) {
            families
                .entry((stem, numbers.len()))
                .or_default()
                .push((numbers, column));
        }
    }
    let mut families: Vec<_> = families.into_iter().collect();
    // Pixels before others that count to 64, for example a background.
    families.sort_by_key(|((stem, _), _)| {
        !["p", "px", "pix", "pixel", "t", "temp"].contains(&stem.as_str())
    });
    let found = families.iter_mut().find_map(|((_, count), family)| {
        family.sort();
        match (*count, family.len()) {
            (1, PIXELS) => in_line(family).or_else(|| in_rows(&two_digits(family)?)),
            (2, PIXELS) => in_rows(family),
            _ => None,
        }
    });
    let others = families.iter().map(|(_, family)| family.len());
    match (found, others.max()) {
        (None, Some(other)) if other > PIXELS => Err(other),
        (found, _) => Ok(found),
    }
}

fn in_line(family: &[Numbered]) -> Option<Vec<usize>> {
    let counts_from = |first: usize| {
        family
            .iter()
            .zip(first..)
            .all(|((numbers, _), number)| numbers[0] == number)
    };
    (counts_from(0) || counts_from(1)).then(|| family.iter().map(|(_, column)| *column).collect())
}

/// `t00` to `t77`, or `t11` to `t88`.
fn two_digits(family: &[Numbered]) -> Option<Family> {
    let split = |(numbers, column): &Numbered| {
        (numbers[0] < 100).then(|| (vec![numbers[0] / 10, numbers[0] % 10], *column))
    };
    family.iter().map(split).collect()
}

fn in_rows(family: &[Numbered]) -> Option<Vec<usize>> {
    let fits = |first: usize| {
        let place = |index: usize| [index / COLUMNS + first, index % COLUMNS + first];
        family
            .iter()
            .enumerate()
            .all(|(index, (numbers, _))| *numbers == place(index))
    };
    (fits(0) || fits(1)).then(|| family.iter().map(|(_, column)| *column).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: impl Fn(usize) -> String) -> Vec<String> {
        core::iter::once("time".to_owned())
            .chain((0..64).map(name))
            .collect()
    }

    #[test]
    fn pixels_are_found_by_usual_names() {
        let in_order: Vec<usize> = (1..=64).collect();
        for names in [
            named(|index| format!("p{index}")),
            named(|index| format!("Pixel {}", index + 1)),
            named(|index| format!("t{index}")),
            named(|index| format!("{index}")),
            named(|index| format!("r{}c{}", index / 8, index % 8)),
            named(|index| format!("({}, {})", index / 8 + 1, index % 8 + 1)),
            named(|index| format!("T{}{}", index / 8, index % 8)),
            named(|index| format!("frame[{index}]")),
        ] {
            assert_eq!(pixels(&names), Ok(Some(in_order.clone())), "{names:?}");
        }
        let backwards: Vec<usize> = (1..=64).rev().collect();
        assert_eq!(
            pixels(&named(|index| format!("p{}", 63 - index))),
            Ok(Some(backwards))
        );
        assert_eq!(pixels(&named(|index| format!("p{}", index + 2))), Ok(None));
        let large: Vec<String> = (0..768).map(|index| format!("p{index}")).collect();
        assert_eq!(pixels(&large), Err(768));
    }

    #[test]
    fn roles_are_told_by_usual_names() {
        for (name, expected) in [
            ("Thermistor (C)", Some(Role::Thermistor)),
            ("therm_temp", Some(Role::Thermistor)),
            ("thermal", None),
            ("Time Stamp", Some(Role::Time)),
            ("t_utc_ns", Some(Role::Time)),
            ("frame_id", Some(Role::Number)),
            ("sensor", Some(Role::Sensor)),
            ("people", None),
            ("", None),
        ] {
            assert_eq!(role(name), expected, "{name}");
        }
        assert_eq!(unit("time_ms"), Some(6));
        assert_eq!(unit("Time (s)"), Some(9));
        assert_eq!(unit("timestamp"), None);
    }
}
