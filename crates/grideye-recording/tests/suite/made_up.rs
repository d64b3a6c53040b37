//! Arbitrary records and batches for property tests.

use grideye_frame::{NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::wire::{Account, Acknowledgement, Batch, Gap, SensorBatch};
use grideye_recording::{COUNT_MAX, ClockState, Record, Stamp};
use proptest::prelude::*;

pub(crate) fn any_name() -> impl Strategy<Value = String> {
    "[A-Za-z0-9][A-Za-z0-9._:-]{0,63}"
}

pub(crate) fn any_counts() -> impl Strategy<Value = std::collections::BTreeMap<String, u64>> {
    prop::collection::btree_map(any_name(), 0..=COUNT_MAX, 0..4)
}

pub(crate) fn any_reading() -> impl Strategy<Value = Reading<RecordedFrame>> {
    let frame = (
        any::<Option<u16>>(),
        prop::collection::vec(any::<u16>(), 64),
    )
        .prop_map(|(thermistor, words)| {
            let mut pixels = [PixelWord(0); 64];
            for (pixel, word) in pixels.iter_mut().zip(words) {
                pixel.0 = word;
            }
            Reading::Frame(RecordedFrame {
                thermistor: thermistor.map(ThermistorWord),
                pixels,
            })
        });
    let missing = prop::sample::select(&NoData::ALL[..]).prop_map(Reading::NoData);
    prop_oneof![3 => frame, 1 => missing]
}

pub(crate) fn any_stamp() -> impl Strategy<Value = Stamp> {
    (
        0..=COUNT_MAX,
        any::<i64>(),
        prop::sample::select(&ClockState::ALL[..]),
    )
        .prop_map(|(t_boot_ns, t_utc_ns, clock)| Stamp {
            t_boot_ns,
            t_utc_ns,
            clock,
        })
}

/// Records in ascending order of seq, with gaps.
pub(crate) fn any_records() -> impl Strategy<Value = Vec<Record>> {
    let step = 1_u64..1 << 40;
    prop::collection::vec((step, any_stamp(), any_reading()), 0..6).prop_map(|parts| {
        let mut next = 0;
        parts
            .into_iter()
            .map(|(step, stamp, reading)| {
                next += step;
                Record {
                    seq: next - 1,
                    stamp,
                    reading,
                }
            })
            .collect()
    })
}

pub(crate) fn any_account() -> impl Strategy<Value = Account> {
    (
        0..=COUNT_MAX,
        0..=COUNT_MAX,
        any_counts(),
        0..=COUNT_MAX,
        any_counts(),
        any::<bool>(),
    )
        .prop_map(|(read, missing, dropped, spooled, errors, ended)| Account {
            read,
            missing,
            dropped,
            spooled,
            errors,
            ended,
        })
}

pub(crate) fn any_batch() -> impl Strategy<Value = Batch> {
    let sensor = (prop::option::of(any_account()), any_records());
    let sensors = prop::collection::btree_map(any_name(), sensor, 0..4).prop_map(|sensors| {
        sensors
            .into_iter()
            .map(|(sensor, (account, frames))| SensorBatch {
                sensor,
                account,
                frames,
            })
            .collect()
    });
    (
        any_name(),
        any_name(),
        prop::option::of(0..=COUNT_MAX),
        sensors,
    )
        .prop_map(|(device, boot, t_sent_boot_ns, sensors)| Batch {
            device,
            boot,
            t_sent_boot_ns,
            sensors,
        })
}

pub(crate) fn any_answer() -> impl Strategy<Value = Acknowledgement> {
    let gap = (any_name(), 0..=COUNT_MAX, 0..=COUNT_MAX).prop_map(|(sensor, a, b)| Gap {
        sensor,
        from: a.min(b),
        to: a.max(b),
    });
    (any_counts(), prop::collection::vec(gap, 0..4)).prop_map(|(durable_through, gaps)| {
        Acknowledgement {
            durable_through,
            gaps,
        }
    })
}
