//! Compares a replay's output with its input: every word of every frame.

use grideye_frame::{PIXELS, RecordedFrame};
use grideye_recording::Row;
use std::fmt;

/// Counts of both sides, and of the differences.
#[derive(Debug, Clone, Copy)]
pub struct Replayed {
    sent: usize,
    read: usize,
    missing: usize,
    pixels: usize,
    /// Thermistor values that are known, and those that differ.
    known: usize,
    thermistors: usize,
}

impl Replayed {
    /// Compares the frames one by one, in order.
    #[must_use]
    pub fn new(source: &[RecordedFrame], rows: &[Row]) -> Self {
        let read: Vec<&RecordedFrame> = rows
            .iter()
            .filter_map(|row| row.record.reading.frame())
            .collect();
        let pairs = || source.iter().zip(&read);
        let words = pairs().flat_map(|(sent, got)| sent.pixels.iter().zip(&got.pixels));
        let known = || pairs().filter(|(sent, _)| sent.thermistor.is_some());
        let thermistors = known().filter(|(sent, got)| sent.thermistor != got.thermistor);
        Self {
            sent: source.len(),
            read: read.len(),
            missing: rows.len() - read.len(),
            pixels: words.filter(|(sent, got)| sent != got).count(),
            known: known().count(),
            thermistors: thermistors.count(),
        }
    }

    /// Whether exactly the input came out, word for word.
    #[must_use]
    pub const fn is_equal(&self) -> bool {
        self.read == self.sent && self.missing + self.pixels + self.thermistors == 0
    }
}

impl fmt::Display for Replayed {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (sent, pixels, thermistors) = (self.sent, self.pixels, self.thermistors);
        let (read, missing, of) = (self.read, self.missing, sent * PIXELS);
        let known = self.known;
        write!(
            formatter,
            "{sent} frames in, {read} out, {missing} missing; compared one by one in order: {pixels} of {of} pixels and {thermistors} of {known} thermistor values differ"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{NoData, PixelWord, Reading, ThermistorWord};
    use grideye_recording::{ClockState, Record, Stamp, StreamId};

    fn frame(first: u16) -> RecordedFrame {
        let mut pixels = [PixelWord(80); PIXELS];
        pixels[0] = PixelWord(first);
        RecordedFrame {
            thermistor: Some(ThermistorWord(400)),
            pixels,
        }
    }

    fn row((seq, reading): (u64, Reading<RecordedFrame>)) -> Row {
        let [device, sensor, boot] = ["demo", "s", "b"].map(str::to_owned);
        let stream = StreamId {
            device,
            sensor,
            boot,
        };
        let stamp = Stamp {
            t_boot_ns: 0,
            t_utc_ns: 0,
            clock: ClockState::Synced,
        };
        let record = Record {
            seq,
            stamp,
            reading,
        };
        Row {
            stream,
            record,
            t_arrival_ns: None,
            labels: Vec::new(),
        }
    }

    #[test]
    fn a_replay_is_equal_only_if_every_word_of_every_frame_is() {
        let source = [frame(1), frame(2), frame(3)];
        let judge = |readings: &[Reading<RecordedFrame>]| {
            let rows: Vec<Row> = (0..).zip(readings.iter().copied()).map(row).collect();
            Replayed::new(&source, &rows)
        };
        let [first, second, third] = source.map(Reading::Frame);
        assert!(judge(&[first, second, third]).is_equal());
        let swapped = judge(&[second, first, third]).to_string();
        assert!(swapped.contains("2 of 192 pixels"), "{swapped}");
        let warmer = Reading::Frame(RecordedFrame {
            thermistor: Some(ThermistorWord(401)),
            ..frame(3)
        });
        let missing = Reading::NoData(NoData::Nack);
        for (readings, fault) in [
            (&[first, second][..], "one frame short"),
            (&[first, second, second, third], "one twice"),
            (&[first, missing, second, third], "a missing row"),
            (&[second, first, third], "out of order"),
            (&[first, second, warmer], "another thermistor"),
        ] {
            assert!(!judge(readings).is_equal(), "{fault}");
        }
    }
    #[test]
    fn a_thermistor_that_was_not_recorded_is_not_compared() {
        let mut source = [frame(1), frame(2)];
        source[0].thermistor = None;
        let rows: Vec<Row> = (0..)
            .zip([frame(1), frame(2)].map(Reading::Frame))
            .map(row)
            .collect();
        let replayed = Replayed::new(&source, &rows);
        assert!(replayed.is_equal());
        let told = replayed.to_string();
        assert!(told.ends_with("0 of 1 thermistor values differ"), "{told}");
    }
}
