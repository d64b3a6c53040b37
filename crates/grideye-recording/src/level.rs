//! Doubts values that no AMG8833 shows in a room: they have another unit, or are no temperatures.

use crate::record::Record;
use grideye_frame::word::pixel_celsius;
use std::fmt;

/// Why values are doubted as degrees Celsius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Doubt {
    /// Median of all values.
    pub median: f64,
    /// What they probably are.
    pub likely: Likely,
}

/// What values probably are in place of degrees Celsius.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Likely {
    /// Degrees Fahrenheit.
    Fahrenheit,
    /// Kelvin.
    Kelvin,
    /// Tenths of a degree.
    Tenths,
    /// Hundredths of a degree.
    Hundredths,
    /// The sensor's words, a quarter of a degree each.
    Words,
    /// Whole degrees Fahrenheit, or words of a cold room.
    WholeFahrenheitOrWords,
    /// Words with the sign of another format.
    OtherSign,
    /// A mask, or shares from 0 to 1.
    Shares,
    /// Gray values from 0 to 255.
    Gray,
    /// Anything but the sensor's own readings: most are no multiple of 0.25.
    NotSteps,
    /// Nothing known.
    Unknown,
}

/// Values that are looked at: of a thousand frames.
const VALUES_MAX: usize = 64_000;
/// The levels of what a sensor looks at in and about a building, °C.
const LEVELS_C: [f64; 2] = [-20.0, 100.0];
const ABSOLUTE_ZERO_C: f64 = -273.15;
/// Fewer different values tell nothing of the steps between them.
const DIFFERENT_MIN: usize = 8;
/// Share of the values that is called all of them.
const ALL: f64 = 0.97;

/// Whether these are no degrees Celsius of an AMG8833.
pub fn doubt(values: impl IntoIterator<Item = f64>) -> Option<Doubt> {
    let values = values.into_iter().filter(|value| value.is_finite());
    let values: Vec<f64> = values.take(VALUES_MAX).collect();
    let mut sorted = values.clone();
    sorted.sort_by(f64::total_cmp);
    let (median, low, high) = (
        *sorted.get(sorted.len() / 2)?,
        *sorted.first()?,
        *sorted.last()?,
    );
    sorted.dedup();
    let different = sorted.len();
    let all = |is_so: &dyn Fn(f64) -> bool| {
        let so = values.iter().filter(|value| is_so(**value)).count();
        share(so, values.len()) >= ALL
    };
    let multiples = |of: f64| all(&|value| ((value / of).round() * of - value).abs() < 0.02 * of);
    let likely = if low < ABSOLUTE_ZERO_C {
        Likely::OtherSign
    } else if (0.0..=1.0).contains(&low) && high <= 1.0 && different > 1 && !only_quarters(&sorted)
    {
        Likely::Shares
    } else if multiples(1.0) && (200.0..=255.0).contains(&high) && (0.0..40.0).contains(&low) {
        Likely::Gray
    } else if !(LEVELS_C[0]..=LEVELS_C[1]).contains(&median) {
        // A step of the sensor is 2.5 tenths or 25 hundredths, perhaps rounded.
        let near_multiples =
            |of: f64| all(&|value| ((value / of).round() * of - value).abs() < 0.21 * of);
        match median {
            50.0..500.0 if near_multiples(2.5) => Likely::Tenths,
            500.0..5_000.0 if near_multiples(25.0) => Likely::Hundredths,
            223.0..373.0 => Likely::Kelvin,
            100.0..200.0 if multiples(1.0) => Likely::Words,
            _ => Likely::Unknown,
        }
    } else if different < DIFFERENT_MIN {
        return None;
    } else if multiples(1.0) && median > 60.0 {
        Likely::WholeFahrenheitOrWords
    } else if median > 40.0 && all(&is_of_fahrenheit) {
        Likely::Fahrenheit
    } else if !multiples(0.25) && !mostly_quarters(&values) {
        Likely::NotSteps
    } else {
        return None;
    };
    Some(Doubt { median, likely })
}

/// The same of a recording's frames.
pub fn doubt_of<'r>(records: impl IntoIterator<Item = &'r Record>) -> Option<Doubt> {
    let frames = records
        .into_iter()
        .filter_map(|record| record.reading.frame());
    doubt(frames.flat_map(|frame| {
        frame
            .pixels
            .map(|word| f64::from(pixel_celsius(word).get()))
    }))
}

/// Whether it is a multiple of 0.25 °C in degrees Fahrenheit, as they are or to the next quarter: five of nine quarters are.
fn is_of_fahrenheit(value: f64) -> bool {
    let steps = (value - 32.0) / 0.45;
    ((steps - steps.round()) * 0.45).abs() < 0.13
}

/// Whether they are the quarters between their ends, and more than the ends alone.
fn only_quarters(different: &[f64]) -> bool {
    different.len() > 2 && mostly_quarters(different)
}

fn mostly_quarters(values: &[f64]) -> bool {
    let on_steps = values.iter().filter(|value| (4.0 * **value).fract() == 0.0);
    share(on_steps.count(), values.len()) > 0.5
}

fn share(some: usize, all: usize) -> f64 {
    let float = |number: usize| f64::from(u32::try_from(number).unwrap_or(u32::MAX));
    float(some) / float(all.max(1))
}

impl Likely {
    /// In words, and the unit by which `grideye convert --columns unit=` reads them.
    const fn told(self) -> (&'static str, Option<&'static str>) {
        match self {
            Self::Fahrenheit => ("degrees Fahrenheit", Some("fahrenheit")),
            Self::Kelvin => ("kelvin", Some("kelvin")),
            Self::Tenths => ("tenths of a degree", Some("tenths")),
            Self::Hundredths => ("hundredths of a degree", Some("hundredths")),
            Self::Words => ("the sensor's words", Some("words")),
            Self::WholeFahrenheitOrWords => (
                "whole degrees Fahrenheit or the sensor's words",
                Some("fahrenheit or words"),
            ),
            Self::OtherSign => (
                "words of negative temperatures in another format",
                Some("words-sign-magnitude"),
            ),
            Self::Shares => ("a mask, or shares from 0 to 1", None),
            Self::Gray => ("gray values from 0 to 255", None),
            Self::NotSteps => ("interpolated, or of another unit", None),
            Self::Unknown => ("of another unit", None),
        }
    }
}

impl fmt::Display for Doubt {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, unit) = self.likely.told();
        write!(
            formatter,
            "these are hardly degrees Celsius of an AMG8833 (the median is {:.2}): they are probably {what}\nhint: ",
            self.median
        )?;
        match unit {
            Some(unit) => write!(
                formatter,
                "convert the original file again with --columns unit={unit}"
            ),
            None => formatter.write_str("use the temperatures that the sensor gave"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 19 to 24 °C as the sensor reads it, in steps of 0.25 °C.
    fn room() -> Vec<f64> {
        let step = |index: u32| f64::from(76 + index * 37 % 11 + index / 64 * 5 % 9) / 4.0;
        (0..64 * 20).map(step).collect()
    }

    fn likely(values: impl Iterator<Item = f64>) -> Option<Likely> {
        doubt(values.collect::<Vec<_>>()).map(|doubt| doubt.likely)
    }

    fn rounded(step: f64) -> impl Fn(f64) -> f64 {
        move |value| (value / step).round() * step
    }

    #[test]
    fn a_room_is_not_doubted_at_any_level_that_rooms_have() {
        for level_c in [-25.0, -19.0, 0.0, 10.0, 20.25, 30.0, 49.75] {
            assert_eq!(
                likely(room().into_iter().map(|c| c + level_c)),
                None,
                "{level_c}"
            );
        }
        // One temperature, and an oven.
        assert_eq!(likely([21.0; 640].into_iter()), None);
        assert_eq!(likely(room().into_iter().map(|c| 3.0 + 3.0 * c)), None);
        assert_eq!(likely(std::iter::empty()), None);
    }

    #[test]
    fn other_units_are_named_as_they_are_and_to_the_sensors_step() {
        let fahrenheit = |c: f64| 1.8 * c + 32.0;
        for rounded in [rounded(0.25), rounded(0.01)] {
            let as_is =
                |unit: &dyn Fn(f64) -> f64| likely(room().into_iter().map(|c| rounded(unit(c))));
            assert_eq!(as_is(&fahrenheit), Some(Likely::Fahrenheit));
            assert_eq!(as_is(&|c| c + 273.15), Some(Likely::Kelvin));
            assert_eq!(as_is(&|c| 10.0 * c), Some(Likely::Tenths));
            assert_eq!(as_is(&|c| 100.0 * c), Some(Likely::Hundredths));
            assert_eq!(as_is(&|c| 4.0 * c), Some(Likely::WholeFahrenheitOrWords));
            assert_eq!(as_is(&|c| 4.0 * (c + 8.0)), Some(Likely::Words));
        }
        let whole = rounded(1.0);
        let of = |unit: &dyn Fn(f64) -> f64| likely(room().into_iter().map(|c| whole(unit(c))));
        assert_eq!(of(&fahrenheit), Some(Likely::WholeFahrenheitOrWords));
        assert_eq!(of(&|c| 51.0 * (c - 19.0)), Some(Likely::Gray));
        assert_eq!(
            likely(room().into_iter().map(|c| (c - 19.0) / 5.3)),
            Some(Likely::Shares)
        );
        assert_eq!(
            likely(room().into_iter().map(|c| c - 300.0)),
            Some(Likely::OtherSign)
        );
        assert_eq!(
            likely(room().into_iter().map(|c| 1.013 * c + 0.07)),
            Some(Likely::NotSteps)
        );
        let mask = room().into_iter().map(|c| f64::from(u8::from(c > 23.0)));
        assert_eq!(likely(mask), Some(Likely::Shares));
    }
}
