//! Frames and batches for the tests.

use grideye_frame::{NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::{Account, Batch, SensorBatch};
use grideye_recording::{ClockState, Record, Stamp};
use std::collections::BTreeMap;

/// A tenth of a second.
pub(crate) const PERIOD_NS: u64 = 100_000_000;

/// A frame with words that all differ and depend on `seq`.
pub(crate) fn frame(seq: u64) -> Record {
    let low = u16::try_from(seq % 1000).unwrap();
    Record {
        seq,
        stamp: stamp(seq),
        reading: Reading::Frame(RecordedFrame {
            thermistor: Some(ThermistorWord(0x0100 + low)),
            pixels: std::array::from_fn(|index| {
                PixelWord(low * 64 + u16::try_from(index).unwrap())
            }),
        }),
    }
}

/// A frame with the same word in every pixel and in the thermistor.
pub(crate) fn flat(seq: u64, pixel: u16, thermistor: u16) -> Record {
    let mut record = frame(seq);
    record.reading = Reading::Frame(RecordedFrame {
        thermistor: Some(ThermistorWord(thermistor)),
        pixels: [PixelWord(pixel); 64],
    });
    record
}

/// The same without its thermistor.
pub(crate) fn bare(mut record: Record) -> Record {
    record.reading = record.reading.map(|mut frame| {
        frame.thermistor = None;
        frame
    });
    record
}

pub(crate) fn missing(seq: u64, reason: NoData) -> Record {
    Record {
        seq,
        stamp: stamp(seq),
        reading: Reading::NoData(reason),
    }
}

fn stamp(seq: u64) -> Stamp {
    Stamp {
        t_boot_ns: 1_000_000_000 + seq * PERIOD_NS,
        t_utc_ns: 1_625_163_247_000_000_000 + i64::try_from(seq * PERIOD_NS).unwrap(),
        clock: ClockState::Synced,
    }
}

pub(crate) fn part(sensor: &str, frames: Vec<Record>) -> SensorBatch {
    SensorBatch {
        sensor: sensor.to_owned(),
        account: None,
        frames,
    }
}

pub(crate) fn batch(device: &str, boot: &str, sensors: Vec<SensorBatch>) -> Batch {
    Batch {
        device: device.to_owned(),
        boot: boot.to_owned(),
        t_sent_boot_ns: None,
        sensors,
    }
}

/// One sensor's frames by their numbers.
pub(crate) fn numbered(seqs: impl IntoIterator<Item = u64>) -> Batch {
    batch(
        "pi-1",
        "b1",
        vec![part("s1", seqs.into_iter().map(frame).collect())],
    )
}

pub(crate) fn account(read: u64, dropped: u64, spooled: u64) -> Account {
    let reasons = [("spool-full".to_owned(), dropped)];
    Account {
        read,
        missing: 0,
        dropped: reasons
            .into_iter()
            .filter(|(_, count)| *count > 0)
            .collect(),
        spooled,
        errors: BTreeMap::from([("nack".to_owned(), 2)]),
        ended: false,
    }
}

/// One sensor's frames with the agent's account.
pub(crate) fn counted(seqs: impl IntoIterator<Item = u64>, account: Account) -> Batch {
    let mut batch = numbered(seqs);
    batch.sensors[0].account = Some(account);
    batch
}
