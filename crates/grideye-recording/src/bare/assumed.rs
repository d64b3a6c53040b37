//! The facts missing in a bare file, and the conversion of its numbers to words.

use crate::error::RecordingError;
use crate::record::{COUNT_MAX, ClockState, Record, Row, Stamp, StreamId};
use amg8833::word;
use core::time::Duration;
use grideye_frame::{Celsius, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};

/// The facts missing in a bare file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assumed {
    /// The stream of its frames.
    pub stream: StreamId,
    /// The thermistor's word in every frame.
    pub thermistor: Option<ThermistorWord>,
    /// Time from frame to frame, if the file has no times.
    pub period: Duration,
}

impl Assumed {
    pub(super) fn row(&self, seq: u64, stamp: Stamp, pixels: [PixelWord; PIXELS]) -> Row {
        let frame = RecordedFrame {
            thermistor: self.thermistor,
            pixels,
        };
        Row {
            stream: self.stream.clone(),
            record: Record {
                seq,
                stamp,
                reading: Reading::Frame(frame),
            },
            t_arrival_ns: None,
        }
    }

    pub(super) fn stamp(&self, seq: u64) -> Stamp {
        let period_ns = u64::try_from(self.period.as_nanos()).unwrap_or(u64::MAX);
        Stamp {
            t_boot_ns: seq.saturating_mul(period_ns).min(COUNT_MAX),
            t_utc_ns: 0,
            clock: ClockState::Unsynced,
        }
    }
}

/// How far a printed temperature may be from a word's: numbers with six decimals.
const ROUNDED_CELSIUS: f64 = 1e-6;

/// The word for this temperature, if there is one.
pub(super) fn word_of(celsius: f64) -> Option<PixelWord> {
    #[expect(
        clippy::as_conversions,
        clippy::cast_possible_truncation,
        reason = "what single precision cannot hold is no multiple of a step, and is refused below"
    )]
    let word = word::pixel_word(Celsius::new(celsius as f32)).ok()?;
    let meant = f64::from(word::pixel_celsius(word).get());
    ((meant - celsius).abs() <= ROUNDED_CELSIUS).then_some(word)
}

pub(super) fn no_word(place: String, found: &str) -> RecordingError {
    RecordingError::BareValue {
        place,
        found: found.to_owned(),
    }
}
