//! What the options of several commands share.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::ops::RangeInclusive;
use std::str::FromStr;

/// The default seed of a comparison's simulation.
pub(crate) const SEED: u64 = 2;

/// The values of an option, and for each a line of its name and help.
pub(super) type Choices<T> = (&'static [T], &'static str);

/// Parses one of these names.
pub(super) fn one_of<T>((values, lines): Choices<T>) -> impl TypedValueParser<Value = T>
where
    T: Clone + Send + Sync + 'static,
{
    let words = move || lines.lines().filter_map(|line| line.split_once(' '));
    let named = words().map(|(word, help)| PossibleValue::new(word).help(help));
    PossibleValuesParser::new(named).map(move |chosen| {
        let place = words().position(|(word, _)| word == chosen);
        values[place.unwrap_or_default()].clone()
    })
}

/// Parses a number within bounds; the error is `expected`.
pub(super) fn within<T: FromStr + PartialOrd>(
    text: &str,
    range: &RangeInclusive<T>,
    expected: impl Into<String>,
) -> Result<T, String> {
    let number = text.parse().ok();
    number
        .filter(|number| range.contains(number))
        .ok_or_else(|| expected.into())
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    within(
        text,
        &(f64::from_bits(1)..=f64::MAX),
        "expected a number above 0",
    )
}
