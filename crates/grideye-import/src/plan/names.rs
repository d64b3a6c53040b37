//! What columns are by their names.

use crate::columns::{Role, Unit};
use grideye_frame::{COLUMNS, PIXELS};
use std::collections::BTreeMap;

/// Words for a time in a name.
const TIMES: [&str; 21] = [
    "time",
    "unix",
    "stamp",
    "date",
    "epoch",
    "utc",
    "millis",
    "micros",
    "elapsed",
    "uptime",
    "ticks",
    "zeit",
    "tiempo",
    "temps",
    "fecha",
    "hora",
    "heure",
    "時刻",
    "時間",
    "日時",
    "время",
];
const TIME_NAMES: [&str; 9] = [
    "when", "ts", "t", "ms", "us", "clock", "seconds", "tbootns", "дата",
];
const NUMBERS: [&str; 13] = [
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
];
const SENSORS: [&str; 4] = ["sensor", "sensorid", "sensorname", "grideye"];
const DEVICES: [&str; 12] = [
    "device",
    "deviceid",
    "devicename",
    "node",
    "nodeid",
    "nodename",
    "mac",
    "macaddress",
    "macaddr",
    "host",
    "hostname",
    "board",
];
/// What people call the thermistor besides.
const CHIPS: [&str; 7] = [
    "sensortemp",
    "sensortemperature",
    "chiptemp",
    "chiptemperature",
    "dietemp",
    "boardtemp",
    "internaltemp",
];
/// A sensor's place, or whoever sends for it: a column of its own if the rows alternate.
const PLACES: [&str; 20] = [
    "ip",
    "i2caddr",
    "raum",
    "zimmer",
    "ort",
    "port",
    "room",
    "place",
    "location",
    "position",
    "topic",
    "source",
    "channel",
    "address",
    "addr",
    "i2caddress",
    "side",
    "tag",
    "id",
    "unit",
];

/// A name without what people add to it: `Thermistor (C)` and `thermistor_c` are one.
fn plain(name: &str) -> String {
    let letters = name.chars().filter(|letter| letter.is_alphanumeric());
    letters.flat_map(char::to_lowercase).collect()
}

/// The role that a name gives to a column of one value; of `sensor.thermistor` the last word counts too.
pub(super) fn role(name: &str) -> Option<Role> {
    let last = name
        .rsplit_once('.')
        .and_then(|(_, last)| role_of(&plain(last)));
    role_of(&plain(name))
        .filter(|role| last.is_none() || *role != Role::Sensor)
        .or(last)
}

fn role_of(plain: &str) -> Option<Role> {
    let is_one_of = |names: &[&str]| names.contains(&plain);
    if plain.starts_with("therm") && !plain.starts_with("thermal") || is_one_of(&CHIPS) {
        return Some(Role::Thermistor);
    }
    if TIMES.iter().any(|word| plain.contains(word))
        || is_one_of(&TIME_NAMES)
        || ends_in_unit(plain)
    {
        return Some(Role::Time);
    }
    let roles = [
        (&NUMBERS[..], Role::Number),
        (&SENSORS, Role::Sensor),
        (&DEVICES, Role::Device),
        (&["boot"], Role::Boot),
    ];
    let found = roles.into_iter().find(|(names, _)| is_one_of(names));
    found.map(|(_, role)| role)
}

/// `tms`, `seconds`, and `secondssincestart`.
fn ends_in_unit(plain: &str) -> bool {
    unit_of(plain).is_some()
        || ["tms", "tus", "ms", "us"].contains(&plain)
        || plain.contains("since")
            && unit_of(plain.split("since").next().unwrap_or_default()).is_some()
}

/// Whether a time is in minutes, hours or days by its name.
pub(super) fn is_coarse(name: &str) -> bool {
    words(name).iter().any(|word| {
        [
            "min", "mins", "minute", "minutes", "minuten", "hour", "hours", "h", "days",
        ]
        .contains(&word.as_str())
    })
}

/// Whether a column by its name says which of several sensors it is, if their rows alternate.
pub(super) fn is_place(name: &str) -> bool {
    PLACES.contains(&plain(name.rsplit('.').next().unwrap_or(name)).as_str())
}

/// The words of a name: `t_ms`, `timeMs` and `Zeit [ms]` end in `ms`.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for character in name.chars() {
        if !character.is_alphanumeric() && !"°".contains(character)
            || (character.is_uppercase() && was_lower)
        {
            words.push(String::new());
        }
        if character.is_alphanumeric() {
            if let Some(word) = words.last_mut() {
                word.extend(character.to_lowercase());
            }
        }
        was_lower = character.is_lowercase();
    }
    words.retain(|word| !word.is_empty());
    words
}

/// The power of ten between the unit in a name and nanoseconds, if it names one.
pub(super) fn unit(name: &str) -> Option<i32> {
    words(name)
        .iter()
        .rev()
        .find_map(|word| match word.as_str() {
            "s" => Some(9),
            "ms" => Some(6),
            "us" | "µs" | "μs" => Some(3),
            "ns" => Some(0),
            word => unit_of(word).or_else(|| {
                let stem = ["timestamp", "time", "uptime", "elapsed"]
                    .iter()
                    .find_map(|stem| word.strip_prefix(*stem))?;
                unit(stem)
            }),
        })
}

/// Of a word that is no letter or two.
fn unit_of(word: &str) -> Option<i32> {
    match word {
        "nanos" | "nanoseconds" | "nsec" => Some(0),
        "usec" | "micros" | "microseconds" => Some(3),
        "msec" | "millis" | "milliseconds" | "millisekunden" => Some(6),
        "sec" | "secs" | "seconds" | "sekunden" | "segundos" | "secondes" => Some(9),
        _ => None,
    }
}

/// Endings of names whose numbers are multiples.
const SCALED: [(&str, Unit); 6] = [
    ("x100", Unit::Hundredths),
    ("cC", Unit::Hundredths),
    ("_cc", Unit::Hundredths),
    ("x10", Unit::Tenths),
    ("dC", Unit::Tenths),
    ("_dc", Unit::Tenths),
];

/// The unit of the pixels that a name says.
pub(super) fn value_unit(name: &str) -> Option<Unit> {
    let letters: String = name
        .chars()
        .map(|letter| if letter.is_ascii_digit() { ' ' } else { letter })
        .collect();
    if name.contains("°F") || name.contains("ºF") {
        return Some(Unit::Fahrenheit);
    }
    if let Some((_, unit)) = SCALED.iter().find(|(ending, _)| name.ends_with(ending)) {
        return Some(*unit);
    }
    // A letter alone is a unit behind the pixel's number, or beside a temperature: `r0c0` has none.
    let behind = name
        .rsplit(|letter: char| letter.is_ascii_digit())
        .next()
        .unwrap_or_default();
    let is_temperature = name.to_lowercase().contains("temp");
    let others = words(&letters)
        .into_iter()
        .rev()
        .filter(|word| word.len() > 1 || is_temperature);
    words(behind)
        .into_iter()
        .rev()
        .chain(others)
        .find_map(|word| match word.as_str() {
            "c" | "degc" | "celsius" => Some(Unit::Celsius),
            "f" | "degf" | "fahrenheit" => Some(Unit::Fahrenheit),
            "k" | "degk" | "kelvin" => Some(Unit::Kelvin),
            "tenths" | "decic" | "decidegc" | "decidegrees" => Some(Unit::Tenths),
            "hundredths" | "centic" | "centidegc" | "centidegrees" => Some(Unit::Hundredths),
            "counts" | "words" | "lsb" | "adc" => Some(Unit::Words),
            _ => None,
        })
}

/// A name in parts: what stands before its last number, its numbers, and the word before each of them.
struct Counted {
    stem: String,
    before_last: String,
    numbers: Vec<usize>,
    words: Vec<String>,
}

impl Counted {
    fn of(name: &str) -> Self {
        let mut counted = Self {
            stem: String::new(),
            before_last: String::new(),
            numbers: Vec::new(),
            words: Vec::new(),
        };
        let (mut digits, mut word, mut begin, mut was_letter) =
            (String::new(), String::new(), 0, false);
        for (at, character) in name.char_indices().chain([(name.len(), ' ')]) {
            if character.is_ascii_digit() {
                if digits.is_empty() {
                    begin = at;
                }
                was_letter = false;
                digits.push(character);
                continue;
            }
            if let Ok(number) = digits.parse() {
                counted.numbers.push(number);
                counted.words.push(std::mem::take(&mut word));
                counted.before_last = name[..begin].to_owned() + "#" + &name[at..];
            }
            digits.clear();
            if character.is_alphabetic() {
                counted.stem.extend(character.to_lowercase());
                if !was_letter {
                    word.clear();
                }
                word.extend(character.to_lowercase());
            }
            was_letter = character.is_alphabetic();
        }
        counted
    }

    /// Row, then column: `c0r1` and `x0y1` say the column first.
    fn place(&self) -> Vec<usize> {
        let mut numbers = self.numbers.clone();
        let is_one_of = |at: usize, names: &[&str]| {
            self.words
                .get(at)
                .is_some_and(|word| names.contains(&word.as_str()))
        };
        if numbers.len() == 2
            && is_one_of(0, &["c", "col", "column", "x", "spalte"])
            && is_one_of(1, &["r", "row", "y", "zeile", "line"])
        {
            numbers.swap(0, 1);
        }
        numbers
    }
}

/// The numbers in a name, and its column.
type Numbered = (Vec<usize>, usize);

/// The columns of the pixels in order, by names that count: `p0` to `p63`, `pixel_1` to `pixel_64`, `r0c0` to `r7c7`, `t00` to
/// `t77`; one entry for each family of 64. `Err` has the number of pixels of another sensor.
pub(super) fn families(names: &[String]) -> Result<Vec<Vec<usize>>, usize> {
    let mut in_lines = BTreeMap::<String, Vec<Numbered>>::new();
    let mut in_grids = BTreeMap::<(String, usize), Vec<Numbered>>::new();
    for (column, name) in names.iter().enumerate() {
        let counted = Counted::of(name);
        if let Some(last) = counted.numbers.last() {
            in_lines
                .entry(counted.before_last.clone())
                .or_default()
                .push((vec![*last], column));
            in_grids
                .entry((counted.stem.clone(), counted.numbers.len()))
                .or_default()
                .push((counted.place(), column));
        }
    }
    let mut found: Vec<Vec<usize>> = Vec::new();
    let mut most = 0;
    let lines = in_lines.into_values().map(|family| (1, family));
    for (count, mut family) in lines.chain(
        in_grids
            .into_iter()
            .map(|((_, count), family)| (count, family)),
    ) {
        family.sort();
        most = most.max(family.len());
        let pixels = match (count, family.len()) {
            (1, PIXELS) => in_line(&family).or_else(|| in_rows(&two_digits(&family)?)),
            (2, PIXELS) => in_rows(&family),
            _ => None,
        };
        if let Some(pixels) = pixels.filter(|pixels| !found.contains(pixels)) {
            found.push(pixels);
        }
    }
    if found.is_empty() && most > PIXELS {
        return Err(most);
    }
    found.sort();
    Ok(found)
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
fn two_digits(family: &[Numbered]) -> Option<Vec<Numbered>> {
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
            assert_eq!(families(&names), Ok(vec![in_order.clone()]), "{names:?}");
        }
        let backwards: Vec<usize> = (1..=64).rev().collect();
        assert_eq!(
            families(&named(|index| format!("p{}", 63 - index))),
            Ok(vec![backwards])
        );
        assert_eq!(
            families(&named(|index| format!("p{}", index + 2))),
            Ok(vec![])
        );
        let transposed: Vec<usize> = (0..64).map(|pixel| 1 + pixel % 8 * 8 + pixel / 8).collect();
        for names in [
            named(|index| format!("c{}r{}", index / 8, index % 8)),
            named(|index| format!("temp_col{}_row{}", index / 8, index % 8)),
            named(|index| format!("x{}y{}", index / 8 + 1, index % 8 + 1)),
        ] {
            assert_eq!(families(&names), Ok(vec![transposed.clone()]), "{names:?}");
        }
        let two = [
            named(|index| format!("s1_p{index}")),
            named(|index| format!("s2_p{index}")),
        ]
        .concat();
        assert_eq!(families(&two).unwrap().len(), 2);
        let large: Vec<String> = (0..768).map(|index| format!("p{index}")).collect();
        assert_eq!(families(&large), Err(768));
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
            ("sensor.thermistor", Some(Role::Thermistor)),
            ("elapsed_s", Some(Role::Time)),
            ("時刻", Some(Role::Time)),
            ("mac", Some(Role::Device)),
            ("room", None),
            ("", None),
        ] {
            assert_eq!(role(name), expected, "{name}");
        }
        assert_eq!(unit("time_ms"), Some(6));
        assert_eq!(unit("Time (s)"), Some(9));
        assert_eq!(unit("timestamp"), None);
        for (name, expected) in [
            ("millis", 6),
            ("time_us", 3),
            ("Zeit [s]", 9),
            ("elapsedMs", 6),
            ("timestampms", 6),
            ("t (µs)", 3),
        ] {
            assert_eq!(unit(name), Some(expected), "{name}");
        }
        for (name, expected) in [
            ("p0_degF", Some(Unit::Fahrenheit)),
            ("p12 (°F)", Some(Unit::Fahrenheit)),
            ("pixel_3_K", Some(Unit::Kelvin)),
            ("t63_x10", Some(Unit::Tenths)),
            ("p7cC", Some(Unit::Hundredths)),
            ("p7", None),
            ("r0c0", None),
        ] {
            assert_eq!(value_unit(name), expected, "{name}");
        }
    }
}
