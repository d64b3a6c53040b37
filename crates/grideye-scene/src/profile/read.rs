//! Reads a profile by the rows of its keys, and writes it as text.

use super::types::{
    ClockError, CommonMode, FixedPattern, NAME_CHARACTERS_MAX, OCTAVES_MAX, Profile,
    TEXT_BYTES_MAX, Thermistor, WarmUp,
};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use grideye_text::Number::{Whole, Within};
use grideye_text::{Kind, Number, Refusal, Row, Rows, Style, Table, rows};
use std::sync::{Mutex, PoisonError};

const STYLE: Style = Style {
    unknown: "correct the spelling or remove the key; scenes/profiles/README.md describes every key",
    missing: "add the key to this table; scenes/profiles/README.md describes every key",
    mistyped: "scenes/profiles/README.md gives each key's type",
    bytes_max: (TEXT_BYTES_MAX, "check that it is a sensor profile"),
    ..Style::EMPTY
};

const AMOUNTS: Number = Within(0.0, 100.0);
const OFFSETS: Number = Within(-100.0, 100.0);
const TIME_MAX_S: f64 = 1e6;
const TIMES: Number = Within(0.1, TIME_MAX_S);
const PPM: Number = Whole(-500_000.0, 500_000.0);
const OFFSET: &str = "-100 to 100 °C, or a list of 64 such numbers";

/// A profile.
pub static PROFILE: Rows = Rows {
    rows: &[rows! {
        "name" Kind::Text(is_name), "", "up to 100 visible characters", "names appear in messages and reports";
        "noise" Kind::Table(&NOISE), "", "", "each pixel by itself, from tick to tick";
        "common_mode" Kind::Table(&COMMON_MODE), "", "", "all pixels together";
        "fixed_pattern" Kind::Table(&FIXED_PATTERN), "", "", "the same in every frame and room";
        "background" Kind::Table(&BACKGROUND), "", "", "the same in every frame of one room";
        "warm_up" Kind::Table(&WARM_UP), "", "", "over minutes and hours";
        "thermistor" Kind::Table(&THERMISTOR), "", "", "the chip's own thermometer";
        "glitches" Kind::Table(&GLITCHES), "", "", "single wrong pixels";
        "clock" Kind::Table(&CLOCK), "", "", "the sensor's oscillator";
    }],
    ..Rows::EMPTY
};
static NOISE: Rows = section(&[rows! {
    "noise.sigma_c" Kind::OneOrEach(PIXELS, AMOUNTS, &[DATASHEET]), "°C", "0 to 100 °C, a list of 64 such numbers, or \"datasheet\"", "the datasheet has 0.16 °C at 10 frames a second; real units have 0.2 to 0.6";
}]);
static COMMON_MODE: Rows = section(&[rows! {
    "common_mode.sd_c" Kind::Number(AMOUNTS), "°C", "", "real units have 0.04 to 0.2";
    "common_mode.correlation_s" Kind::Number(TIMES), "s", "", "the wander of real units takes seconds to minutes";
    "common_mode.octaves" Kind::Number(OCTAVES), "", "", "each octave wanders twice as fast as the one before; 1 means only the slowest";
    "common_mode.cycle_depth_c" Kind::Number(AMOUNTS), "°C", "", "one frame in five is colder by this much; real units have 0.02 to 0.2";
}]);
static FIXED_PATTERN: Rows = section(&[rows! {
    "fixed_pattern.offset_c" Kind::OneOrEach(PIXELS, OFFSETS, &[]), "°C", OFFSET, "the error added to each pixel; the datasheet allows 2.5 either way";
    "fixed_pattern.spread_c" Kind::Number(AMOUNTS), "°C", "", "real units have 0.15 to 0.25; every seed draws another pattern";
}]);
static BACKGROUND: Rows = section(&[rows! {
    "background.offset_c" Kind::OneOrEach(PIXELS, OFFSETS, &[]), "°C", OFFSET, "what the empty room added to each pixel; `grideye characterize EMPTY.csv --profile FILE` measures it";
}]);
static WARM_UP: Rows = section(&[rows! {
    "warm_up.start_c" Kind::Number(OFFSETS), "°C", "", "the error of all pixels right after power-on";
    "warm_up.time_constant_s" Kind::Number(TIMES), "s", "", "the time in which the error falls to 37 %";
    "warm_up.drift_c_per_hour" Kind::Number(OFFSETS), "°C per hour", "", "a constant drift; omit it for none";
}]);
static THERMISTOR: Rows = section(&[rows! {
    "thermistor.offset_c" Kind::Number(OFFSETS), "°C", "", "self-heating keeps real chips 3.5 to 6 above the scene";
    "thermistor.sigma_c" Kind::Number(AMOUNTS), "°C", "", "real chips have less than their step of 0.0625";
    "thermistor.lag_s" Kind::Number(Within(0.0, TIME_MAX_S)), "s", "", "the time in which self-heating rises to 63 %; 0 means at once";
}]);
static GLITCHES: Rows = section(&[rows! {
    "glitches.probability" Kind::Number(Within(0.0, 1.0)), "", "", "the share of ticks in which one pixel reads 0.0 °C; 0.01 is one in a hundred";
}]);
static CLOCK: Rows = section(&[rows! {
    "clock.error_ppm" Kind::Number(PPM), "", "", "parts per million; -40000 is 4 % slow";
    "clock.drift_ppm_per_hour" Kind::Number(PPM), "", "", "parts per million; -40000 is 4 % slow";
}]);

const OCTAVES: Number = Whole(1.0, 10.0);
const _: () = assert!(
    OCTAVES_MAX == 10 && NAME_CHARACTERS_MAX == 100,
    "as the rows say"
);

const fn section(rows: &'static [&'static [Row]]) -> Rows {
    Rows {
        rows,
        ..Rows::EMPTY
    }
}

fn is_name(name: &str) -> bool {
    name.chars().count() <= NAME_CHARACTERS_MAX && !name.contains(char::is_control)
}

/// Noise of the central four pixels at 10 frames per second (AMG88 spec §4-4, NETD "typ. 0.16 °C").
const DATASHEET_SIGMA_C: f64 = 0.16;
const DATASHEET: &str = "datasheet";

/// Noise relative to the unit's median in the upper left quadrant, edge first, from recordings of at least eight units.
const NOISE_SHAPE: [[f64; 4]; 4] = [
    [1.25, 1.12, 1.07, 1.02],
    [1.14, 1.05, 0.97, 0.97],
    [1.09, 0.99, 0.92, 0.91],
    [1.05, 0.96, 0.90, 0.88],
];

fn datasheet_sigma_c() -> [f64; PIXELS] {
    let center = NOISE_SHAPE[3][3];
    std::array::from_fn(|pixel| {
        let (row, column) = (pixel / COLUMNS, pixel % COLUMNS);
        let shape = NOISE_SHAPE[row.min(ROWS - 1 - row)][column.min(COLUMNS - 1 - column)];
        DATASHEET_SIGMA_C * shape / center
    })
}

pub(crate) fn profile(text: &str, origin: &str) -> Result<Profile, Refusal> {
    /// The last one read: the scenes of a data set have the same one, frame after frame.
    static LAST: Mutex<Option<(String, Profile)>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    match &*last {
        Some((known, profile)) if known == text => Ok(profile.clone()),
        _ => {
            let profile = parsed(text, origin)?;
            *last = Some((text.to_owned(), profile.clone()));
            Ok(profile)
        }
    }
}

fn parsed(text: &str, origin: &str) -> Result<Profile, Refusal> {
    grideye_text::read((origin, text), &STYLE, &PROFILE, |table| {
        for [amount, time] in [
            ["common_mode.sd_c", "common_mode.correlation_s"],
            ["warm_up.start_c", "warm_up.time_constant_s"],
        ] {
            check_time(table, amount, time)?;
        }
        Ok(read(table))
    })
}

/// An amount needs its time constant.
fn check_time(table: &Table<'_>, amount: &str, time: &str) -> Result<(), Refusal> {
    let given = table
        .get(amount)
        .filter(|given| given.number() != Some(0.0));
    match given.filter(|_| table.get(time).is_none()) {
        None => Ok(()),
        Some(given) => {
            let (section, key) = time.split_once('.').unwrap_or_default();
            let row = PROFILE.below(section).and_then(|rows| rows.row(key));
            let hint = row.map_or("", |row| row.doc);
            let problem = format!("`{amount}` also needs `{time}`");
            Err(given.place().refused(problem, hint))
        }
    }
}

fn read(table: &Table<'_>) -> Profile {
    // Turn minus zero into zero, so that a profile equals its text read back.
    let number = |path| table.number(path).unwrap_or(0.0) + 0.0;
    let map = |path| {
        let map = table.list::<PIXELS>(path);
        map.map(|map| map.map(|number| number + 0.0))
    };
    let noise = table.get("noise.sigma_c");
    let is_datasheet = noise.is_some_and(|noise| noise.text().is_some());
    Profile {
        name: table.text("name").unwrap_or_default().to_owned(),
        noise_sigma_c: match is_datasheet {
            true => datasheet_sigma_c(),
            false => map("noise.sigma_c").unwrap_or([0.0; PIXELS]),
        },
        common_mode: CommonMode {
            sd_c: number("common_mode.sd_c"),
            correlation_s: number("common_mode.correlation_s"),
            octaves: whole(number("common_mode.octaves")).max(1).unsigned_abs(),
            cycle_depth_c: number("common_mode.cycle_depth_c"),
        },
        fixed_pattern: FixedPattern {
            offset_c: map("fixed_pattern.offset_c").unwrap_or([0.0; PIXELS]),
            spread_c: number("fixed_pattern.spread_c"),
        },
        background_c: map("background.offset_c"),
        warm_up: WarmUp {
            start_c: number("warm_up.start_c"),
            time_constant_s: number("warm_up.time_constant_s"),
            drift_c_per_hour: number("warm_up.drift_c_per_hour"),
        },
        thermistor: Thermistor {
            offset_c: number("thermistor.offset_c"),
            sigma_c: number("thermistor.sigma_c"),
            lag_s: number("thermistor.lag_s"),
        },
        glitch_probability: number("glitches.probability"),
        clock: ClockError {
            error_ppm: whole(number("clock.error_ppm")),
            drift_ppm_per_hour: whole(number("clock.drift_ppm_per_hour")),
        },
    }
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "the rows allow only whole numbers up to 500,000"
)]
fn whole(number: f64) -> i32 {
    number as i32
}

/// A profile as text that reads back to the same numbers.
pub(crate) fn toml(profile: &Profile) -> String {
    let mut text = String::new();
    if !profile.name.is_empty() {
        let name = toml::Value::String(profile.name.clone());
        text.push_str(&format!("name = {name}\n"));
    }
    let mut section = "";
    for (path, value) in written(profile) {
        let (Some(value), Some((table, key))) = (value, path.split_once('.')) else {
            continue;
        };
        if table != section {
            let gap = if text.is_empty() { "" } else { "\n" };
            text.push_str(&format!("{gap}[{table}]\n"));
            section = table;
        }
        text.push_str(&format!("{key} = {value}\n"));
    }
    text
}

fn written(profile: &Profile) -> [(&'static str, Option<String>); 17] {
    let (common, pattern) = (&profile.common_mode, &profile.fixed_pattern);
    let (warm_up, thermistor) = (&profile.warm_up, &profile.thermistor);
    let time = |amount: f64, time: f64| decimal(time).filter(|_| amount != 0.0);
    let octaves = (common.sd_c != 0.0 && common.octaves != 1).then(|| common.octaves.to_string());
    // A background of zero differs from an unknown one.
    let background = profile.background_c.as_ref();
    let background = background.map(|map| list(map).unwrap_or("0".to_owned()));
    let clock = &profile.clock;
    [
        ("noise.sigma_c", list(&profile.noise_sigma_c)),
        ("common_mode.sd_c", decimal(common.sd_c)),
        (
            "common_mode.correlation_s",
            time(common.sd_c, common.correlation_s),
        ),
        ("common_mode.octaves", octaves),
        ("common_mode.cycle_depth_c", decimal(common.cycle_depth_c)),
        ("fixed_pattern.offset_c", list(&pattern.offset_c)),
        ("fixed_pattern.spread_c", decimal(pattern.spread_c)),
        ("background.offset_c", background),
        ("warm_up.start_c", decimal(warm_up.start_c)),
        (
            "warm_up.time_constant_s",
            time(warm_up.start_c, warm_up.time_constant_s),
        ),
        (
            "warm_up.drift_c_per_hour",
            decimal(warm_up.drift_c_per_hour),
        ),
        ("thermistor.offset_c", decimal(thermistor.offset_c)),
        ("thermistor.sigma_c", decimal(thermistor.sigma_c)),
        ("thermistor.lag_s", decimal(thermistor.lag_s)),
        ("glitches.probability", decimal(profile.glitch_probability)),
        ("clock.error_ppm", decimal(clock.error_ppm.into())),
        (
            "clock.drift_ppm_per_hour",
            decimal(clock.drift_ppm_per_hour.into()),
        ),
    ]
}

/// The shortest decimal for this number; `None` for zero.
fn decimal(number: f64) -> Option<String> {
    (number != 0.0).then(|| number.to_string())
}

/// One number if all are equal, otherwise eight rows of eight.
fn list(map: &[f64; PIXELS]) -> Option<String> {
    if map.iter().all(|each| *each == map[0]) {
        return decimal(map[0]);
    }
    let mut text = "[\n".to_owned();
    for row in map.chunks(COLUMNS) {
        let row: Vec<String> = row.iter().map(f64::to_string).collect();
        text.push_str(&format!("  {},\n", row.join(", ")));
    }
    text.push(']');
    Some(text)
}
