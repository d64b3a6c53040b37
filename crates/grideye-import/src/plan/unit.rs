//! What the pixels' numbers are, told by their names, their level, their steps and their noise.

use crate::columns::Unit;
use crate::error::ImportError;
use std::collections::BTreeSet;

/// Degrees Celsius that an AMG8833 shows of a scene: those of the datasheet's range, and of rooms beyond it.
const PLAUSIBLE_C: core::ops::RangeInclusive<f64> = -20.0..=100.0;
/// No room is as warm, in °C.
const ROOM_MAX_C: f64 = 45.0;
/// Share of values that lie on the sensor's steps of 0.25 °C where the unit is right.
const ON_STEPS: f64 = 0.9;
/// The same of another unit, by chance or where one decimal is printed: 0.6.
const BY_CHANCE: f64 = 0.8;
/// Frames that show how often pixels change.
const FRAMES_MIN: usize = 4;
/// Share of pixels that change from frame to frame. Noise of 0.23 to 0.26 °C (measured on real units)
/// changes 0.72 of raw words, 0.45 of whole °F, 0.27 of whole °C.
const WORDS_CHANGE: f64 = 0.58;
const CELSIUS_CHANGES: f64 = 0.36;
/// Share of a noise's changes that are by one step: 0.4 of raw words on the noisiest unit measured; finer numbers have steps of
/// several.
const SINGLE_STEPS: f64 = 0.15;
/// The bit of a raw word that is its sign.
const SIGN: f64 = 2_048.0;
/// A raw word of 150 °C.
const WORD_MAX: f64 = 600.0;

/// The pixels' numbers of the first frames.
pub(super) struct Sample {
    /// Frame by frame, those that are there.
    pub(super) frames: Vec<Vec<Option<f64>>>,
    /// Decimals that most have.
    pub(super) decimals: i32,
}

/// A unit, and why, if it was guessed.
type Told = (Unit, Option<String>);

impl Sample {
    /// # Errors
    /// [`ImportError`] with the options that answer.
    pub(super) fn tell(&self, named: Option<Unit>) -> Result<Told, ImportError> {
        let mut values: Vec<f64> = self
            .frames
            .iter()
            .flatten()
            .filter_map(|value| *value)
            .collect();
        values.sort_by(f64::total_cmp);
        let (Some(least), Some(most)) = (values.first().copied(), values.last().copied()) else {
            return Ok((named.unwrap_or(Unit::Celsius), None));
        };
        let median = values[values.len() / 2];
        let distinct: BTreeSet<i64> = values.iter().map(|value| thousandths(*value)).collect();
        if least >= 0.0 && most <= 1.0 && distinct.len() > 1 && named.is_none() {
            let what = if distinct.len() == 2 {
                "are only 0 and 1: a mask, no temperatures"
            } else {
                "lie between 0 and 1: scaled for a network, no temperatures"
            };
            return Err(ask(&format!("the pixels {what}"), &[]));
        }
        if let Some(unit) = named {
            return match PLAUSIBLE_C.contains(&level(unit, median)) {
                true => Ok((unit, None)),
                false => Err(self.doubt(median, &format!("their names say {}", unit.name()))),
            };
        }
        match values.iter().all(|value| value.fract() == 0.0) {
            true => self.whole(least, median, most, &distinct),
            false => self.fractions(least, median, &values, distinct.len()),
        }
    }

    fn fractions(
        &self,
        least: f64,
        median: f64,
        values: &[f64],
        distinct: usize,
    ) -> Result<Told, ImportError> {
        let share = |unit: Unit| self.share_on_steps(values, unit, 0.0);
        let (celsius, fahrenheit, kelvin) = (
            share(Unit::Celsius),
            share(Unit::Fahrenheit),
            share(Unit::Kelvin),
        );
        let fits = |unit: Unit| PLAUSIBLE_C.contains(&unit.celsius(median));
        if kelvin >= ON_STEPS && celsius < BY_CHANCE && fits(Unit::Kelvin) {
            return Ok((
                Unit::Kelvin,
                Some("kelvin, since 273.15 less is on the sensor's steps".to_owned()),
            ));
        }
        // With one decimal, values of one scale may be on the other's steps too; no room has 70 °C.
        let is_no_celsius = celsius < BY_CHANCE || median >= ROOM_MAX_C && distinct >= 6;
        if fahrenheit >= ON_STEPS && is_no_celsius && fits(Unit::Fahrenheit) && median >= 0.0 {
            return Ok((
                Unit::Fahrenheit,
                Some("°F, since the values are on steps of 0.45".to_owned()),
            ));
        }
        if !fits(Unit::Celsius) || least < -273.15 {
            return Err(self.doubt(median, "no scene has so many °C"));
        }
        if celsius >= BY_CHANCE {
            return Ok((Unit::Celsius, None));
        }
        // Corrected by a constant, they are on steps beside the sensor's.
        let residues = (0..25)
            .map(|shift| self.share_on_steps(values, Unit::Celsius, f64::from(shift) / 100.0));
        if self.decimals >= 2 && residues.fold(0.0, f64::max) >= ON_STEPS {
            return Ok((
                Unit::Celsius,
                Some("°C, a constant beside the sensor's steps of 0.25".to_owned()),
            ));
        }
        Err(ask(
            &format!(
                "most pixels are no multiples of 0.25 °C, which is all that a Grid-EYE gives; their median is {median}"
            ),
            &[Unit::Celsius, Unit::Fahrenheit, Unit::Kelvin],
        ))
    }

    fn whole(
        &self,
        least: f64,
        median: f64,
        most: f64,
        distinct: &BTreeSet<i64>,
    ) -> Result<Told, ImportError> {
        if distinct.len() == 1 && median == 0.0 {
            return Err(ask(
                "all pixels are 0: a mask without anybody, or a sensor that does not answer",
                &[Unit::Celsius],
            ));
        }
        if least >= 0.0 && most >= SIGN {
            if let Some(told) = negative_words(distinct)? {
                return Ok(told);
            }
        }
        if (0.0..=50.0).contains(&least) && (200.0..=255.0).contains(&most) {
            return Err(ask(
                "the pixels go up to 255: a gray image, no temperatures",
                &[],
            ));
        }
        let (changes, single) = self.changes().unzip();
        if single.is_some_and(|single| single < SINGLE_STEPS) {
            return Err(self.doubt(median, "they hardly ever change by 1"));
        }
        let digits: BTreeSet<i64> = distinct
            .iter()
            .map(|value| (value / 1_000).rem_euclid(10))
            .collect();
        let is_rounded = distinct.len() >= 6
            && digits
                .iter()
                .all(|digit| [0, 2, 3, 5, 7, 8].contains(digit));
        let is = |unit: Unit| {
            Ok((
                unit,
                Some(format!("{}, told by the level and the noise", unit.name())),
            ))
        };
        match (median, changes) {
            (100.0..=500.0, _) if is_rounded => {
                Err(self.doubt(median, "they end as rounded tenths do"))
            }
            (115.0..=240.0, _) => is(Unit::Words),
            (46.0..115.0, Some(changes)) if changes >= WORDS_CHANGE => is(Unit::Words),
            (-20.0..46.0, Some(changes)) if changes >= WORDS_CHANGE + 0.04 => is(Unit::Words),
            (-20.0..46.0, Some(changes)) if changes <= CELSIUS_CHANGES => is(Unit::Celsius),
            _ => Err(self.doubt(median, "whole numbers")),
        }
    }

    /// The share of pixels that change from frame to frame, and how many of all changes are by one step. It is that of the upper
    /// quartile of frames: a sensor that is read too often gives frames twice, and such as are half of the frame before.
    fn changes(&self) -> Option<(f64, f64)> {
        let (mut shares, mut all, mut single) = (Vec::new(), 0_usize, 0_usize);
        for pair in self.frames.windows(2) {
            let both = pair[0].iter().zip(&pair[1]);
            let steps = both.filter_map(|(one, next)| Some((one.as_ref()? - next.as_ref()?).abs()));
            let steps: Vec<f64> = steps.collect();
            let changed = steps.iter().filter(|step| **step > 0.0).count();
            shares.push(ratio(changed, steps.len()));
            all += changed;
            single += steps
                .iter()
                .filter(|step| (0.5..1.5).contains(*step))
                .count();
        }
        shares.sort_by(f64::total_cmp);
        let share = shares
            .get(shares.len() * 3 / 4)
            .filter(|_| shares.len() + 1 >= FRAMES_MIN)?;
        Some((*share, if all == 0 { 1.0 } else { ratio(single, all) }))
    }

    /// The share of values that are on the sensor's steps as far as they are printed, if they are in this unit.
    fn share_on_steps(&self, values: &[f64], unit: Unit, shift_c: f64) -> f64 {
        let printed_c = 0.501 * 10_f64.powi(-self.decimals) / unit.per_degree();
        let is_on = |value: &&f64| {
            let steps = (unit.celsius(**value) - shift_c) * 4.0;
            (steps - steps.round()).abs() / 4.0 <= printed_c.max(2e-4)
        };
        ratio(values.iter().filter(is_on).count(), values.len())
    }

    fn doubt(&self, median: f64, why: &str) -> ImportError {
        let all = [
            Unit::Celsius,
            Unit::Fahrenheit,
            Unit::Kelvin,
            Unit::Tenths,
            Unit::Hundredths,
            Unit::Words,
        ];
        let fitting: Vec<Unit> = all
            .into_iter()
            .filter(|unit| (-20.0..=60.0).contains(&level(*unit, median)))
            .collect();
        let told: Vec<String> = fitting
            .iter()
            .map(|unit| format!("{:.1} °C in {}", level(*unit, median), unit.name()))
            .collect();
        let levels = if told.is_empty() {
            "no temperature in any unit".to_owned()
        } else {
            told.join(", ")
        };
        ask(
            &format!(
                "the unit of the pixels is not clear ({why}): their median {median} would be {levels}"
            ),
            &fitting,
        )
    }
}

/// Raw words of which some are negative.
fn negative_words(distinct: &BTreeSet<i64>) -> Result<Option<Told>, ImportError> {
    let low = |value: &i64| *value < thousandths(WORD_MAX);
    let near =
        |from: f64, value: &i64| (thousandths(from)..thousandths(from + WORD_MAX)).contains(value);
    let twos = |value: &i64| {
        [4_096.0, 65_536.0]
            .iter()
            .any(|size| (thousandths(size - WORD_MAX)..thousandths(*size)).contains(value))
    };
    if distinct.iter().all(|value| low(value) || twos(value)) {
        return Ok(Some((
            Unit::Words,
            Some("raw words, since those above 2047 are negative".to_owned()),
        )));
    }
    if distinct.iter().all(|value| low(value) || near(SIGN, value)) {
        let all = [Unit::SignMagnitude, Unit::Hundredths];
        let count = if distinct.iter().any(low) { 1 } else { 2 };
        return Err(ask(
            "raw words from 2048 on are -512 °C in two's complement, and -0 °C in sign and magnitude",
            &all[..count],
        ));
    }
    Ok(None)
}

/// Degrees Celsius of a value in a unit.
fn level(unit: Unit, value: f64) -> f64 {
    if unit.is_words() {
        // Negative in twelve or sixteen bits.
        let size = [4_096.0, 65_536.0]
            .into_iter()
            .find(|size| (size - 2.0 * WORD_MAX..*size).contains(&value));
        (value - size.unwrap_or(0.0)) / unit.per_degree()
    } else {
        unit.celsius(value)
    }
}

fn ask(what: &str, units: &[Unit]) -> ImportError {
    let options: Vec<String> = units
        .iter()
        .map(|unit| format!("--columns unit={}", unit.name()))
        .collect();
    let hint = match units.is_empty() {
        true => "take the numbers that the sensor gave, or write them in °C; --columns unit=UNIT says one all the same".to_owned(),
        false => format!("say the unit if you know it: {}", options.join(" or ")),
    };
    ImportError::refused(what, hint)
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "only told apart by it"
)]
fn thousandths(value: f64) -> i64 {
    (value * 1_000.0).round() as i64
}

#[expect(
    clippy::as_conversions,
    clippy::cast_precision_loss,
    reason = "counts of a sample"
)]
fn ratio(part: usize, of: usize) -> f64 {
    part as f64 / of.max(1) as f64
}
