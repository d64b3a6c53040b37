//! From the file's tables to a profile: every number inside its range, or the message with its place.

use super::document::{
    ClockTable, CommonModeTable, FixedPatternTable, Map, NoiseTable, ProfileTable, ThermistorTable,
    WarmUpTable,
};
use super::error::ProfileError;
use super::types::{
    ClockError, CommonMode, FixedPattern, NAME_CHARACTERS_MAX, OCTAVES_MAX, Profile,
    TEXT_BYTES_MAX, Thermistor, WarmUp,
};
use crate::text::place::Place;
use crate::text::refusal::{Rule, excerpt};
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use std::ops::Range;
use toml::Spanned;

/// The noise of the central four pixels at 10 frames a second (AMG88 spec §4-4, NETD "typ. 0.16 °C").
pub(crate) const DATASHEET_SIGMA_C: f64 = 0.16;
/// The name of the datasheet's noise in a file.
pub(crate) const DATASHEET: &str = "datasheet";

/// Noise against the unit's median by the place of the pixel, upper left quadrant, edge first; the rest mirrors it.
/// Measured over the public recordings of eight and more units: the datasheet is silent beyond the central four.
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
    let file = File { origin, text };
    let tables: ProfileTable = toml::from_str(text).map_err(|error| file.malformed(&error))?;
    Ok(Profile {
        name: file.name(tables.name.as_ref())?,
        noise_sigma_c: file.noise(&tables.noise)?,
        common_mode: file.common_mode(&tables.common_mode)?,
        fixed_pattern: file.fixed_pattern(&tables.fixed_pattern)?,
        warm_up: file.warm_up(&tables.warm_up)?,
        thermistor: file.thermistor(&tables.thermistor)?,
        glitch_probability: file.number(tables.glitches.probability.as_ref(), &PROBABILITY)?,
        clock: file.clock(&tables.clock)?,
    })
}

/// The datasheet's noise for every pixel, °C.
pub(crate) fn datasheet_sigma_c() -> [f64; PIXELS] {
    let centre = NOISE_SHAPE[3][3];
    std::array::from_fn(|pixel| {
        let (row, column) = (pixel / COLUMNS, pixel % COLUMNS);
        let shape = NOISE_SHAPE[row.min(ROWS - 1 - row)][column.min(COLUMNS - 1 - column)];
        DATASHEET_SIGMA_C * shape / centre
    })
}

struct File<'a> {
    origin: &'a str,
    text: &'a str,
}

impl File<'_> {
    fn name(&self, name: Option<&Spanned<String>>) -> Result<String, ProfileError> {
        let Some(name) = name else {
            return Ok(String::new());
        };
        let found = name.get_ref();
        if found.chars().count() <= NAME_CHARACTERS_MAX && !found.contains(char::is_control) {
            return Ok(found.clone());
        }
        Err(self.refused(name.span(), &NAME))
    }

    fn noise(&self, table: &NoiseTable) -> Result<[f64; PIXELS], ProfileError> {
        if let Some(sigma) = &table.sigma_c {
            if matches!(sigma.get_ref(), Map::Named(name) if name == DATASHEET) {
                return Ok(datasheet_sigma_c());
            }
        }
        self.map(table.sigma_c.as_ref(), &NOISE_SIGMA)
    }

    fn common_mode(&self, table: &CommonModeTable) -> Result<CommonMode, ProfileError> {
        let sd = (table.sd_c.as_ref(), &COMMON_SD);
        let correlation = (table.correlation_s.as_ref(), &COMMON_CORRELATION);
        let (sd_c, correlation_s) = self.with_time(sd, correlation)?;
        Ok(CommonMode {
            sd_c,
            correlation_s,
            octaves: self.octaves(table.octaves.as_ref())?,
            cycle_depth_c: self.number(table.cycle_depth_c.as_ref(), &CYCLE_DEPTH)?,
        })
    }

    fn fixed_pattern(&self, table: &FixedPatternTable) -> Result<FixedPattern, ProfileError> {
        Ok(FixedPattern {
            offset_c: self.map(table.offset_c.as_ref(), &PATTERN_OFFSET)?,
            spread_c: self.number(table.spread_c.as_ref(), &PATTERN_SPREAD)?,
        })
    }

    fn warm_up(&self, table: &WarmUpTable) -> Result<WarmUp, ProfileError> {
        let start = (table.start_c.as_ref(), &WARM_UP_START);
        let time = (table.time_constant_s.as_ref(), &WARM_UP_TIME);
        let (start_c, time_constant_s) = self.with_time(start, time)?;
        Ok(WarmUp {
            start_c,
            time_constant_s,
            drift_c_per_hour: self.number(table.drift_c_per_hour.as_ref(), &DRIFT)?,
        })
    }

    fn thermistor(&self, table: &ThermistorTable) -> Result<Thermistor, ProfileError> {
        Ok(Thermistor {
            offset_c: self.number(table.offset_c.as_ref(), &THERMISTOR_OFFSET)?,
            sigma_c: self.number(table.sigma_c.as_ref(), &THERMISTOR_SIGMA)?,
            lag_s: self.number(table.lag_s.as_ref(), &THERMISTOR_LAG)?,
        })
    }

    fn clock(&self, table: &ClockTable) -> Result<ClockError, ProfileError> {
        Ok(ClockError {
            error_ppm: self.whole(table.error_ppm.as_ref(), &CLOCK_ERROR)?,
            drift_ppm_per_hour: self.whole(table.drift_ppm_per_hour.as_ref(), &CLOCK_DRIFT)?,
        })
    }

    /// An amount and the time that it needs beside it.
    fn with_time(
        &self,
        (amount, amount_rule): (Option<&Spanned<f64>>, &Rule),
        (time, time_rule): (Option<&Spanned<f64>>, &Rule),
    ) -> Result<(f64, f64), ProfileError> {
        let value = self.number(amount, amount_rule)?;
        match (amount, time) {
            (Some(amount), None) if value != 0.0 => Err(ProfileError::MissingKey {
                place: self.place(amount.span().start),
                key: amount_rule.key,
                missing: time_rule.key,
                hint: time_rule.hint,
            }),
            _ => Ok((value, self.number(time, time_rule)?)),
        }
    }

    /// A number, 0 where the file has none.
    fn number(&self, number: Option<&Spanned<f64>>, rule: &Rule) -> Result<f64, ProfileError> {
        number.map_or(Ok(0.0), |number| {
            self.held(*number.get_ref(), number.span(), rule)
        })
    }

    /// One where the file has none.
    fn octaves(&self, octaves: Option<&Spanned<f64>>) -> Result<u32, ProfileError> {
        let octaves = self.whole(octaves, &OCTAVES)?.max(1);
        Ok(octaves.unsigned_abs())
    }

    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "the rules admit whole numbers of at most 500,000 alone"
    )]
    fn whole(&self, number: Option<&Spanned<f64>>, rule: &Rule) -> Result<i32, ProfileError> {
        Ok(self.number(number, rule)? as i32)
    }

    fn map(&self, map: Option<&Spanned<Map>>, rule: &Rule) -> Result<[f64; PIXELS], ProfileError> {
        let Some(map) = map else {
            return Ok([0.0; PIXELS]);
        };
        match map.get_ref() {
            Map::Named(_) => Err(self.refused(map.span(), rule)),
            Map::One(number) => Ok([self.held(*number, map.span(), rule)?; PIXELS]),
            Map::Each(numbers) => {
                let mut each = Vec::with_capacity(PIXELS);
                for number in numbers {
                    each.push(self.held(*number.get_ref(), number.span(), rule)?);
                }
                <[f64; PIXELS]>::try_from(each).map_err(|each| ProfileError::Length {
                    place: self.place(map.span().start),
                    key: rule.key,
                    found: each.len(),
                    hint: "give one number for all pixels, or pixels 1 to 64 in the order of the registers",
                })
            }
        }
    }

    fn held(&self, number: f64, span: Range<usize>, rule: &Rule) -> Result<f64, ProfileError> {
        if (rule.holds)(number) {
            // Minus zero is zero, so that a profile equals what is read back from its text.
            return Ok(number + 0.0);
        }
        Err(self.refused(span, rule))
    }

    fn refused(&self, span: Range<usize>, rule: &Rule) -> ProfileError {
        ProfileError::Value {
            place: self.place(span.start),
            key: rule.key,
            found: excerpt(self.text.get(span).unwrap_or_default()),
            expected: rule.expected,
            hint: rule.hint,
        }
    }

    fn malformed(&self, error: &toml::de::Error) -> ProfileError {
        let byte = error.span().map_or(0, |span| span.start);
        let message = error
            .message()
            .trim_end()
            .replace('\n', ", ")
            .replace("expected f64", "expected a number");
        let hint = if message.starts_with("unknown field") {
            "correct the spelling or remove the key; scenes/profiles/README.md describes every key"
        } else if message.starts_with("invalid") {
            "scenes/profiles/README.md gives each key's type"
        } else {
            "the file must be TOML: text in quotes, every key once, lists in brackets"
        };
        // The reader names unknown keys, but not the key of a value that it refuses.
        let message = match self.key_before(byte) {
            Some(key) => format!("`{key}`: {message}"),
            None => message,
        };
        ProfileError::Malformed {
            place: self.place(byte),
            message,
            hint,
        }
    }

    /// The key that stands before a byte on its line, if the byte is in a value.
    fn key_before(&self, byte: usize) -> Option<&str> {
        let line = self.text.get(..byte)?.rsplit('\n').next()?;
        line.split_once('=').map(|(key, _)| key.trim())
    }

    fn place(&self, byte: usize) -> Place {
        Place::of_byte(self.origin, self.text, byte)
    }
}

const NAME: Rule = Rule {
    key: "name",
    holds: |_| false,
    expected: "up to 100 visible characters",
    hint: "names appear in messages and reports",
};
const NOISE_SIGMA: Rule = Rule {
    key: "noise.sigma_c",
    holds: amount,
    expected: "0 to 100 °C, a list of 64 such numbers, or \"datasheet\"",
    hint: "the datasheet has 0.16 °C at 10 frames a second; real units have 0.2 to 0.6",
};
const COMMON_SD: Rule = Rule {
    key: "common_mode.sd_c",
    holds: amount,
    expected: "0 to 100 °C",
    hint: "real units have 0.04 to 0.2",
};
const COMMON_CORRELATION: Rule = Rule {
    key: "common_mode.correlation_s",
    holds: time,
    expected: "0.1 to 1000000 s",
    hint: "the wander of real units takes seconds to minutes",
};
const OCTAVES: Rule = Rule {
    key: "common_mode.octaves",
    holds: |octaves| {
        (1.0..=f64::from(OCTAVES_MAX)).contains(&octaves) && octaves == octaves.trunc()
    },
    expected: "a whole number, 1 to 10",
    hint: "each octave is a wander twice as quick as the one before; 1 is the slow one alone",
};
const CYCLE_DEPTH: Rule = Rule {
    key: "common_mode.cycle_depth_c",
    holds: amount,
    expected: "0 to 100 °C",
    hint: "one frame in five is colder by this much; real units have 0.02 to 0.2",
};
const PATTERN_OFFSET: Rule = Rule {
    key: "fixed_pattern.offset_c",
    holds: offset,
    expected: "-100 to 100 °C, or a list of 64 such numbers",
    hint: "what each pixel shows too much; the datasheet admits 2.5 either way",
};
const PATTERN_SPREAD: Rule = Rule {
    key: "fixed_pattern.spread_c",
    holds: amount,
    expected: "0 to 100 °C",
    hint: "real units have 0.15 to 0.25; every seed draws another pattern",
};
const WARM_UP_START: Rule = Rule {
    key: "warm_up.start_c",
    holds: offset,
    expected: "-100 to 100 °C",
    hint: "the error of all pixels right after power-on",
};
const WARM_UP_TIME: Rule = Rule {
    key: "warm_up.time_constant_s",
    holds: time,
    expected: "0.1 to 1000000 s",
    hint: "the time in which the error falls to 37 %",
};
const DRIFT: Rule = Rule {
    key: "warm_up.drift_c_per_hour",
    holds: offset,
    expected: "-100 to 100 °C an hour",
    hint: "a drift that never ends; leave it out for none",
};
const THERMISTOR_OFFSET: Rule = Rule {
    key: "thermistor.offset_c",
    holds: offset,
    expected: "-100 to 100 °C",
    hint: "self-heating keeps real chips 3.5 to 6 above the scene",
};
const THERMISTOR_SIGMA: Rule = Rule {
    key: "thermistor.sigma_c",
    holds: amount,
    expected: "0 to 100 °C",
    hint: "real chips have less than their step of 0.0625",
};
const THERMISTOR_LAG: Rule = Rule {
    key: "thermistor.lag_s",
    holds: |seconds| (0.0..=TIME_MAX_S).contains(&seconds),
    expected: "0 to 1000000 s",
    hint: "the time in which self-heating has risen to 63 %; 0 is at once",
};
const PROBABILITY: Rule = Rule {
    key: "glitches.probability",
    holds: |share| (0.0..=1.0).contains(&share),
    expected: "0 to 1",
    hint: "the share of ticks in which one pixel reads 0.0 °C; 0.01 is one in a hundred",
};
const CLOCK_ERROR: Rule = Rule {
    key: "clock.error_ppm",
    holds: parts_per_million,
    expected: "a whole number, -500000 to 500000",
    hint: "parts per million; -40000 is 4 % slow",
};
const CLOCK_DRIFT: Rule = Rule {
    key: "clock.drift_ppm_per_hour",
    ..CLOCK_ERROR
};

const TIME_MAX_S: f64 = 1e6;
const PPM_MAX: f64 = 500_000.0;

fn amount(celsius: f64) -> bool {
    (0.0..=100.0).contains(&celsius)
}

fn offset(celsius: f64) -> bool {
    (-100.0..=100.0).contains(&celsius)
}

fn time(seconds: f64) -> bool {
    (0.1..=TIME_MAX_S).contains(&seconds)
}

fn parts_per_million(number: f64) -> bool {
    number.abs() <= PPM_MAX && number == number.trunc()
}
