//! The rows of `recordings/golden/two-sensors.csv`, shared by the test that checks the file and the example that writes
//! it.

use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::{ClockState, Record, Row, Stamp, StreamId};

/// Pixel words of the datasheet's table (AMG88 spec §4-11-11), and both extremes of the format.
pub(crate) const PIXEL_WORDS: [u16; 9] = [
    0x064, 0x001, 0x000, 0xFFF, 0x1F4, 0xF9C, 0xF24, 0x7FF, 0x800,
];

/// Two sensors on one device at 10 Hz: values of every sign, each clock state, a missing frame, a gap.
pub(crate) fn rows() -> Vec<Row> {
    let first = |seq, thermistor, turn| {
        let frame = RecordedFrame {
            thermistor: Some(ThermistorWord(thermistor)),
            pixels: pixels(turn),
        };
        row("i2c-1:0x68", seq, Reading::Frame(frame))
    };
    let second = |seq, reading| row("i2c-1:0x69", seq, reading);
    let warm = RecordedFrame {
        thermistor: Some(ThermistorWord(0x191)),
        pixels: [PixelWord(0x05D); PIXELS],
    };
    let mut rows = vec![
        first(0, 0x190, 0),
        second(0, Reading::Frame(warm)),
        first(1, 0x804, 1),
        second(1, Reading::NoData(NoData::Nack)),
        first(2, 0x800, 2),
        // Number 2 of the second sensor is a gap.
        second(3, Reading::Frame(warm)),
    ];
    rows[0].record.stamp.clock = ClockState::Unsynced;
    rows[0].record.stamp.t_utc_ns = -1;
    rows[1].record.stamp.clock = ClockState::Unsynced;
    rows[1].t_arrival_ns = None;
    rows[2].record.stamp.clock = ClockState::Stepped;
    rows
}

fn row(sensor: &str, seq: u64, reading: Reading<RecordedFrame>) -> Row {
    let since_first_ns = 100_000_000 * seq;
    let t_utc_ns = 1_625_163_247_000_000_000 + i64::try_from(since_first_ns).unwrap_or_default();
    Row {
        stream: StreamId {
            device: "pi-1".to_owned(),
            sensor: sensor.to_owned(),
            boot: "5f0c".to_owned(),
        },
        record: Record {
            seq,
            stamp: Stamp {
                t_boot_ns: 81_000_000_000 + since_first_ns,
                t_utc_ns,
                clock: ClockState::Synced,
            },
            reading,
        },
        t_arrival_ns: Some(t_utc_ns + 250_000_000),
        labels: Vec::new(),
    }
}

fn pixels(turn: usize) -> [PixelWord; PIXELS] {
    core::array::from_fn(|index| PixelWord(PIXEL_WORDS[(index + turn) % PIXEL_WORDS.len()]))
}
