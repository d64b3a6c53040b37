//! Reads a profile, checking every number's range, and writes it as text.

use super::types::{
    ClockError, CommonMode, FixedPattern, NAME_CHARACTERS_MAX, OCTAVES_MAX, Profile, ProfileError,
    TEXT_BYTES_MAX, Thermistor, WarmUp,
};
use crate::text::{Refusal, Rule, Source};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use serde::Deserialize;
use serde::de::value::SeqAccessDeserializer;
use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use std::fmt;
use toml::Spanned;

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct ProfileTable {
    name: Option<Spanned<String>>,
    #[serde(default)]
    noise: NoiseTable,
    #[serde(default)]
    common_mode: CommonModeTable,
    #[serde(default)]
    fixed_pattern: FixedPatternTable,
    #[serde(default)]
    background: BackgroundTable,
    #[serde(default)]
    warm_up: WarmUpTable,
    #[serde(default)]
    thermistor: ThermistorTable,
    #[serde(default)]
    glitches: GlitchesTable,
    #[serde(default)]
    clock: ClockTable,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct NoiseTable {
    sigma_c: Option<Spanned<Map>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct CommonModeTable {
    sd_c: Option<Spanned<f64>>,
    correlation_s: Option<Spanned<f64>>,
    octaves: Option<Spanned<f64>>,
    cycle_depth_c: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct FixedPatternTable {
    offset_c: Option<Spanned<Map>>,
    spread_c: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct BackgroundTable {
    offset_c: Option<Spanned<Map>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct WarmUpTable {
    start_c: Option<Spanned<f64>>,
    time_constant_s: Option<Spanned<f64>>,
    drift_c_per_hour: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct ThermistorTable {
    offset_c: Option<Spanned<f64>>,
    sigma_c: Option<Spanned<f64>>,
    lag_s: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct GlitchesTable {
    probability: Option<Spanned<f64>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct ClockTable {
    error_ppm: Option<Spanned<f64>>,
    drift_ppm_per_hour: Option<Spanned<f64>>,
}

/// One number for all pixels, one per pixel, or the name of a known set.
enum Map {
    Named(String),
    One(f64),
    Each(Vec<Spanned<f64>>),
}

impl<'de> Deserialize<'de> for Map {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(MapVisitor)
    }
}

struct MapVisitor;

impl<'de> Visitor<'de> for MapVisitor {
    type Value = Map;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number, or a list of 64 numbers")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Map, E> {
        Ok(Map::Named(name.to_owned()))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Map, E> {
        Ok(Map::One(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Map, E> {
        let number = i32::try_from(number).map_err(E::custom)?;
        self.visit_f64(f64::from(number))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<Map, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(list)).map(Map::Each)
    }
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

pub(crate) fn profile(text: &str, origin: &str) -> Result<Profile, ProfileError> {
    if text.len() > TEXT_BYTES_MAX {
        return Err(ProfileError::TooLong {
            file: origin.to_owned(),
            found: text.len(),
            limit: TEXT_BYTES_MAX,
        });
    }
    let file = File(Source {
        origin,
        text,
        manual: "scenes/profiles/README.md",
        tables: "",
    });
    let tables = toml::from_str(text).map_err(|error| file.0.malformed(&error))?;
    Ok(file.profile(&tables)?)
}

fn datasheet_sigma_c() -> [f64; PIXELS] {
    let center = NOISE_SHAPE[3][3];
    std::array::from_fn(|pixel| {
        let (row, column) = (pixel / COLUMNS, pixel % COLUMNS);
        let shape = NOISE_SHAPE[row.min(ROWS - 1 - row)][column.min(COLUMNS - 1 - column)];
        DATASHEET_SIGMA_C * shape / center
    })
}

struct File<'a>(Source<'a>);

impl File<'_> {
    fn profile(&self, tables: &ProfileTable) -> Result<Profile, Refusal> {
        let (common, warm_up) = (&tables.common_mode, &tables.warm_up);
        let (pattern, thermistor) = (&tables.fixed_pattern, &tables.thermistor);
        let number = |given: &Option<Spanned<f64>>, rule: &Rule| self.number(given, rule);
        let name = self.name(&tables.name)?;
        let noise_sigma_c = match tables.noise.sigma_c.as_ref().map(Spanned::get_ref) {
            Some(Map::Named(name)) if name == DATASHEET => datasheet_sigma_c(),
            _ => self.map(&tables.noise.sigma_c, &NOISE_SIGMA)?,
        };
        let time = (&common.correlation_s, &COMMON_CORRELATION);
        let (sd_c, correlation_s) = self.with_time((&common.sd_c, &COMMON_SD), time)?;
        let common_mode = CommonMode {
            sd_c,
            correlation_s,
            octaves: self.whole(&common.octaves, &OCTAVES)?.max(1).unsigned_abs(),
            cycle_depth_c: number(&common.cycle_depth_c, &CYCLE_DEPTH)?,
        };
        let fixed_pattern = FixedPattern {
            offset_c: self.map(&pattern.offset_c, &PATTERN_OFFSET)?,
            spread_c: number(&pattern.spread_c, &PATTERN_SPREAD)?,
        };
        let background = &tables.background.offset_c;
        let background_c = match background {
            Some(_) => Some(self.map(background, &BACKGROUND_OFFSET)?),
            None => None,
        };
        let time = (&warm_up.time_constant_s, &WARM_UP_TIME);
        let start = (&warm_up.start_c, &WARM_UP_START);
        let (start_c, time_constant_s) = self.with_time(start, time)?;
        Ok(Profile {
            name,
            noise_sigma_c,
            common_mode,
            fixed_pattern,
            background_c,
            warm_up: WarmUp {
                start_c,
                time_constant_s,
                drift_c_per_hour: number(&warm_up.drift_c_per_hour, &DRIFT)?,
            },
            thermistor: Thermistor {
                offset_c: number(&thermistor.offset_c, &THERMISTOR_OFFSET)?,
                sigma_c: number(&thermistor.sigma_c, &THERMISTOR_SIGMA)?,
                lag_s: number(&thermistor.lag_s, &THERMISTOR_LAG)?,
            },
            glitch_probability: number(&tables.glitches.probability, &PROBABILITY)?,
            clock: ClockError {
                error_ppm: self.whole(&tables.clock.error_ppm, &CLOCK_ERROR)?,
                drift_ppm_per_hour: self.whole(&tables.clock.drift_ppm_per_hour, &CLOCK_DRIFT)?,
            },
        })
    }

    fn name(&self, name: &Option<Spanned<String>>) -> Result<String, Refusal> {
        let Some(name) = name else {
            return Ok(String::new());
        };
        let found = name.get_ref();
        if found.chars().count() <= NAME_CHARACTERS_MAX && !found.contains(char::is_control) {
            return Ok(found.clone());
        }
        let hint = "names appear in messages and reports";
        let expected = "up to 100 visible characters";
        Err(self.0.refused("name", name.span(), expected, hint))
    }

    /// An amount and the time constant it requires.
    fn with_time(
        &self,
        (amount, amount_rule): (&Option<Spanned<f64>>, &Rule),
        (time, time_rule): (&Option<Spanned<f64>>, &Rule),
    ) -> Result<(f64, f64), Refusal> {
        let value = self.number(amount, amount_rule)?;
        match (amount, time) {
            (Some(amount), None) if value != 0.0 => {
                let (key, missing) = (amount_rule.key, time_rule.key);
                let problem = format!("`{key}` also needs `{missing}`");
                let place = self.0.place(amount.span().start);
                Err(place.refused(problem, time_rule.hint))
            }
            _ => Ok((value, self.number(time, time_rule)?)),
        }
    }

    /// A number, by default 0.
    fn number(&self, number: &Option<Spanned<f64>>, rule: &Rule) -> Result<f64, Refusal> {
        // Turn minus zero into zero, so that a profile equals its text read back.
        Ok(self.0.number_or(number, rule, 0.0)? + 0.0)
    }

    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "the rules allow only whole numbers up to 500,000"
    )]
    fn whole(&self, number: &Option<Spanned<f64>>, rule: &Rule) -> Result<i32, Refusal> {
        Ok(self.number(number, rule)? as i32)
    }

    fn map(&self, map: &Option<Spanned<Map>>, rule: &Rule) -> Result<[f64; PIXELS], Refusal> {
        let Some(map) = map else {
            return Ok([0.0; PIXELS]);
        };
        match map.get_ref() {
            Map::Named(_) => Err(self
                .0
                .refused(rule.key, map.span(), rule.expected, rule.hint)),
            Map::One(number) => Ok([self.0.check(*number, map.span(), rule)? + 0.0; PIXELS]),
            Map::Each(numbers) => {
                let numbers = numbers.iter();
                let each = numbers.map(|number| Ok(self.0.number(number, rule)? + 0.0));
                let each = each.collect::<Result<Vec<_>, Refusal>>()?;
                <[f64; PIXELS]>::try_from(each).map_err(|each| {
                    let problem =
                        format!("`{}` has {} numbers, expected 64", rule.key, each.len());
                    let hint = "give one number for all pixels, or pixels 1 to 64 in the order of the registers";
                    self.0.place(map.span().start).refused(problem, hint)
                })
            }
        }
    }
}

const NOISE_SIGMA: Rule = Rule {
    key: "noise.sigma_c",
    holds: COMMON_SD.holds,
    expected: "0 to 100 °C, a list of 64 such numbers, or \"datasheet\"",
    hint: "the datasheet has 0.16 °C at 10 frames a second; real units have 0.2 to 0.6",
};
const COMMON_SD: Rule = Rule {
    key: "common_mode.sd_c",
    holds: |celsius| (0.0..=100.0).contains(&celsius),
    expected: "0 to 100 °C",
    hint: "real units have 0.04 to 0.2",
};
const COMMON_CORRELATION: Rule = Rule {
    key: "common_mode.correlation_s",
    holds: |seconds| (0.1..=TIME_MAX_S).contains(&seconds),
    expected: "0.1 to 1000000 s",
    hint: "the wander of real units takes seconds to minutes",
};
const OCTAVES: Rule = Rule {
    key: "common_mode.octaves",
    holds: |octaves| {
        (1.0..=f64::from(OCTAVES_MAX)).contains(&octaves) && octaves == octaves.trunc()
    },
    expected: "a whole number, 1 to 10",
    hint: "each octave wanders twice as fast as the one before; 1 means only the slowest",
};
const CYCLE_DEPTH: Rule = COMMON_SD.with(
    "common_mode.cycle_depth_c",
    "one frame in five is colder by this much; real units have 0.02 to 0.2",
);
const PATTERN_OFFSET: Rule = Rule {
    key: "fixed_pattern.offset_c",
    holds: WARM_UP_START.holds,
    expected: "-100 to 100 °C, or a list of 64 such numbers",
    hint: "the error added to each pixel; the datasheet allows 2.5 either way",
};
const BACKGROUND_OFFSET: Rule = Rule {
    key: "background.offset_c",
    hint: "what the empty room added to each pixel; `grideye characterize EMPTY.csv --profile FILE` measures it",
    ..PATTERN_OFFSET
};
const PATTERN_SPREAD: Rule = COMMON_SD.with(
    "fixed_pattern.spread_c",
    "real units have 0.15 to 0.25; every seed draws another pattern",
);
const WARM_UP_START: Rule = Rule {
    key: "warm_up.start_c",
    holds: |celsius| (-100.0..=100.0).contains(&celsius),
    expected: "-100 to 100 °C",
    hint: "the error of all pixels right after power-on",
};
const WARM_UP_TIME: Rule = COMMON_CORRELATION.with(
    "warm_up.time_constant_s",
    "the time in which the error falls to 37 %",
);
const DRIFT: Rule = Rule {
    key: "warm_up.drift_c_per_hour",
    holds: WARM_UP_START.holds,
    expected: "-100 to 100 °C per hour",
    hint: "a constant drift; omit it for none",
};
const THERMISTOR_OFFSET: Rule = WARM_UP_START.with(
    "thermistor.offset_c",
    "self-heating keeps real chips 3.5 to 6 above the scene",
);
const THERMISTOR_SIGMA: Rule = COMMON_SD.with(
    "thermistor.sigma_c",
    "real chips have less than their step of 0.0625",
);
const THERMISTOR_LAG: Rule = Rule {
    key: "thermistor.lag_s",
    holds: |seconds| (0.0..=TIME_MAX_S).contains(&seconds),
    expected: "0 to 1000000 s",
    hint: "the time in which self-heating rises to 63 %; 0 means at once",
};
const PROBABILITY: Rule = Rule {
    key: "glitches.probability",
    holds: |share| (0.0..=1.0).contains(&share),
    expected: "0 to 1",
    hint: "the share of ticks in which one pixel reads 0.0 °C; 0.01 is one in a hundred",
};
const CLOCK_ERROR: Rule = Rule {
    key: "clock.error_ppm",
    holds: |number| number.abs() <= PPM_MAX && number == number.trunc(),
    expected: "a whole number, -500000 to 500000",
    hint: "parts per million; -40000 is 4 % slow",
};
const CLOCK_DRIFT: Rule = CLOCK_ERROR.of("clock.drift_ppm_per_hour");

const TIME_MAX_S: f64 = 1e6;
const PPM_MAX: f64 = 500_000.0;

/// A profile as text that reads back to the same numbers.
pub(crate) fn toml(profile: &Profile) -> String {
    let mut text = String::new();
    if !profile.name.is_empty() {
        let name = toml::Value::String(profile.name.clone());
        text.push_str(&format!("name = {name}\n"));
    }
    let common = &profile.common_mode;
    let (warm_up, thermistor) = (&profile.warm_up, &profile.thermistor);
    let time = |amount: f64, time: f64| if amount == 0.0 { 0.0 } else { time };
    let octaves = (common.sd_c != 0.0 && common.octaves != 1).then(|| common.octaves.to_string());
    let (noise, pattern, clock) = (
        &profile.noise_sigma_c,
        &profile.fixed_pattern,
        &profile.clock,
    );
    let correlation_s = time(common.sd_c, common.correlation_s);
    let time_constant_s = time(warm_up.start_c, warm_up.time_constant_s);
    let mut table = |name, keys| push_table(&mut text, name, keys);
    table("noise", vec![("sigma_c", list(noise))]);
    let common = vec![
        ("sd_c", decimal(common.sd_c)),
        ("correlation_s", decimal(correlation_s)),
        ("octaves", octaves),
        ("cycle_depth_c", decimal(common.cycle_depth_c)),
    ];
    table("common_mode", common);
    let pattern = vec![
        ("offset_c", list(&pattern.offset_c)),
        ("spread_c", decimal(pattern.spread_c)),
    ];
    table("fixed_pattern", pattern);
    // A background of zero differs from an unknown one.
    let background = profile.background_c.as_ref();
    let background = background.map(|map| list(map).unwrap_or("0".to_owned()));
    table("background", vec![("offset_c", background)]);
    let warm_up = vec![
        ("start_c", decimal(warm_up.start_c)),
        ("time_constant_s", decimal(time_constant_s)),
        ("drift_c_per_hour", decimal(warm_up.drift_c_per_hour)),
    ];
    table("warm_up", warm_up);
    let thermistor = vec![
        ("offset_c", decimal(thermistor.offset_c)),
        ("sigma_c", decimal(thermistor.sigma_c)),
        ("lag_s", decimal(thermistor.lag_s)),
    ];
    table("thermistor", thermistor);
    table(
        "glitches",
        vec![("probability", decimal(profile.glitch_probability))],
    );
    let drift_ppm = f64::from(clock.drift_ppm_per_hour);
    let clock = vec![
        ("error_ppm", decimal(f64::from(clock.error_ppm))),
        ("drift_ppm_per_hour", decimal(drift_ppm)),
    ];
    table("clock", clock);
    text
}

fn push_table(text: &mut String, name: &str, keys: Vec<(&str, Option<String>)>) {
    let mut keys = keys
        .into_iter()
        .filter_map(|(key, value)| Some((key, value?)))
        .peekable();
    if keys.peek().is_none() {
        return;
    }
    let gap = if text.is_empty() { "" } else { "\n" };
    text.push_str(&format!("{gap}[{name}]\n"));
    for (key, value) in keys {
        text.push_str(&format!("{key} = {value}\n"));
    }
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
