//! One cell of a text layout, and the values it may have.

use crate::error::RecordingError;
use crate::record::{COUNT_MAX, check_name};
use crate::text::quoted;
use core::fmt;
use grideye_frame::word::{self, OutOfRange};
use grideye_frame::{Celsius, NAME_RULE, PixelWord, ThermistorWord};

/// Maximum characters of a temperature: few enough that double precision distinguishes any two of them.
const DEGREE_CHARS_MAX: usize = 16;

/// A cell with its place, for error messages.
pub(crate) struct Cell<'c> {
    pub(crate) line: u64,
    pub(crate) column: Column,
    pub(crate) text: &'c str,
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Column {
    Named(&'static str),
    /// A pixel, by the layout's own number.
    Pixel(usize),
}

impl fmt::Display for Column {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name) => formatter.write_str(name),
            Self::Pixel(number) => write!(formatter, "pixel{number}"),
        }
    }
}

impl Cell<'_> {
    pub(crate) fn refused(&self, expected: impl AsRef<str>) -> RecordingError {
        let found = match self.text {
            "" => "an empty cell".to_owned(),
            text => quoted(text),
        };
        RecordingError::cell(self.line, self.column, expected.as_ref(), &found)
    }

    pub(crate) fn name(&self) -> Result<String, RecordingError> {
        check_name(self.text)
            .map(|()| self.text.to_owned())
            .map_err(|error| RecordingError::cell(self.line, self.column, NAME_RULE, &error.found))
    }

    /// Digits only, up to [`COUNT_MAX`].
    pub(crate) fn count(&self) -> Result<u64, RecordingError> {
        let refused = || self.refused(format!("an integer from 0 to {COUNT_MAX}"));
        if !self.text.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(refused());
        }
        match self.text.parse() {
            Ok(count) if count <= COUNT_MAX => Ok(count),
            _ => Err(refused()),
        }
    }

    /// Nanoseconds of a wall clock: digits, with or without a minus sign.
    pub(crate) fn nanoseconds(&self) -> Result<i64, RecordingError> {
        let refused = || self.refused("a signed 64-bit integer");
        // The standard parser accepts a plus sign too.
        if self.text.starts_with('+') {
            return Err(refused());
        }
        self.text.parse().ok().ok_or_else(refused)
    }

    pub(crate) fn pixel(&self) -> Result<PixelWord, RecordingError> {
        self.word(word::pixel_word, word::pixel_celsius, word::PIXEL_STEP)
    }

    pub(crate) fn thermistor(&self) -> Result<ThermistorWord, RecordingError> {
        self.word(
            word::thermistor_word,
            word::thermistor_celsius,
            word::THERMISTOR_STEP,
        )
    }

    /// The word for exactly the temperature in the cell.
    fn word<W: Copy>(
        &self,
        encode: impl Fn(Celsius) -> Result<W, OutOfRange>,
        decode: impl Fn(W) -> Celsius,
        step: Celsius,
    ) -> Result<W, RecordingError> {
        let written = self.degrees()?;
        #[expect(
            clippy::as_conversions,
            clippy::cast_possible_truncation,
            reason = "what single precision cannot hold is no multiple of a step, and is refused below"
        )]
        let nearest = encode(Celsius::new(written as f32)).map_err(|range| {
            self.refused(format!(
                "{} to {} degrees Celsius",
                range.lowest, range.highest
            ))
        })?;
        let meant = f64::from(decode(nearest).get());
        // Compare bits, because the thermistor distinguishes -0 from 0.
        if meant.to_bits() == written.to_bits() {
            Ok(nearest)
        } else {
            let nearby = decode(nearest);
            Err(self.refused(format!(
                "a multiple of {step} degrees Celsius that the sensor can report, such as {nearby}"
            )))
        }
    }

    /// A plain decimal number: an optional minus sign, digits, and optionally a point and more digits.
    fn degrees(&self) -> Result<f64, RecordingError> {
        let refused = || self.refused("degrees Celsius as a plain decimal number");
        let unsigned = self.text.strip_prefix('-').unwrap_or(self.text);
        let (whole, fraction) = unsigned.split_once('.').unwrap_or((unsigned, "0"));
        let digits =
            |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
        if self.text.len() > DEGREE_CHARS_MAX || !digits(whole) || !digits(fraction) {
            return Err(refused());
        }
        self.text.parse().ok().ok_or_else(refused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cell(text: &str) -> Cell<'_> {
        Cell {
            line: 7,
            column: Column::Pixel(3),
            text,
        }
    }

    fn fault(text: &str) -> String {
        cell(text).pixel().unwrap_err().to_string()
    }

    #[test]
    fn the_datasheet_rows_are_read_as_printed() {
        // AMG88 spec §4-11-11.
        let rows = [
            ("125", 0x1F4),
            ("25", 0x064),
            ("0.25", 0x001),
            ("0", 0),
            ("-0.25", 0xFFF),
            ("-25", 0xF9C),
            ("-55", 0xF24),
        ];
        for (text, word) in rows {
            assert_eq!(cell(text).pixel().unwrap(), PixelWord(word), "{text}");
        }
        // AMG88 spec §4-11-9, and the sign bit alone.
        let rows = [
            ("127.9375", 0x7FF),
            ("-59.6875", 0xBBB),
            ("25", 0x190),
            ("-0.25", 0x804),
            ("0", 0x000),
            ("-0", 0x800),
        ];
        for (text, word) in rows {
            let found = cell(text).thermistor().unwrap();
            assert_eq!(found, ThermistorWord(word), "{text}");
        }
    }

    #[test]
    fn trailing_zeros_of_a_spreadsheet_are_accepted() {
        assert_eq!(cell("18.0").pixel().unwrap(), cell("18").pixel().unwrap());
        assert_eq!(cell("-0.250000").pixel().unwrap(), PixelWord(0xFFF));
    }

    #[test]
    fn an_impossible_temperature_is_rejected_with_its_place() {
        let plain =
            "line 7, column pixel3: expected degrees Celsius as a plain decimal number, found";
        for text in
            "NaN|nan|inf|-inf|1e1|+1|1.|.5|-|--1|0x10| 1|1 |1,5|23.2500000000000000001".split('|')
        {
            assert_eq!(fault(text), format!("{plain} {}", quoted(text)));
        }
        assert_eq!(fault(""), format!("{plain} an empty cell"));
        let range = "line 7, column pixel3: expected -512 to 511.75 degrees Celsius, found";
        for text in ["512", "-512.25", "999999999999999"] {
            assert_eq!(fault(text), format!("{range} \"{text}\""));
        }
        let step = "line 7, column pixel3: expected a multiple of 0.25 degrees Celsius that the sensor can report, such as";
        for (text, nearby) in [
            ("23.3", "23.25"),
            ("23.0625", "23"),
            ("23.250000000001", "23.25"),
            ("-0", "0"),
            ("511.75000000001", "511.75"),
        ] {
            assert_eq!(fault(text), format!("{step} {nearby}, found \"{text}\""));
        }
    }

    #[test]
    fn integers_are_digits_within_64_bits_with_sign() {
        assert_eq!(cell("9223372036854775807").count().unwrap(), COUNT_MAX);
        let least = cell("-9223372036854775808").nanoseconds();
        assert_eq!(least.unwrap(), i64::MIN);
        for text in "|+1|-1|1.0|9223372036854775808|99999999999999999999|١".split('|') {
            assert!(cell(text).count().is_err(), "{text}");
        }
        for text in ["", "+1", "1.0", "9223372036854775808", "-", "--1"] {
            assert!(cell(text).nanoseconds().is_err(), "{text}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_taken_or_refused_without_a_panic(text in ".{0,24}") {
            let _ = (cell(&text).pixel(), cell(&text).thermistor(), cell(&text).count(), cell(&text).nanoseconds(), cell(&text).name());
        }

        #[test]
        fn every_word_comes_back_from_its_shortest_decimal(word in 0_u16..=0xFFF) {
            let pixel = PixelWord(word);
            prop_assert_eq!(cell(&word::pixel_celsius(pixel).to_string()).pixel().unwrap(), pixel);
            let thermistor = ThermistorWord(word);
            prop_assert_eq!(cell(&word::thermistor_celsius(thermistor).to_string()).thermistor().unwrap(), thermistor);
        }
    }
}
