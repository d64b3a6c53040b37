//! Which records of a long recording are kept.

use grideye_frame::{NoData, Reading};
use grideye_recording::{ClockState, Record, Stamp};
use grideye_validator::{RECORDS_MAX, Thinning};

fn record(seq: u64) -> Record {
    Record {
        seq,
        stamp: Stamp {
            t_boot_ns: seq,
            t_utc_ns: 0,
            clock: ClockState::Synced,
        },
        reading: Reading::NoData(NoData::ALL[0]),
    }
}

fn kept(rows: u64) -> Vec<u64> {
    let mut thinning = Thinning::default();
    thinning.extend((0..rows).map(record));
    let thinned = thinning.finish();
    assert_eq!(u64::try_from(thinned.rows), Ok(rows));
    assert!(thinned.records.len() <= RECORDS_MAX);
    assert_eq!(thinned.note().is_some(), rows > 20_000);
    thinned.records.iter().map(|record| record.seq).collect()
}

#[test]
fn a_recording_within_the_limit_is_kept_whole() {
    for rows in [0, 1, 999, 1_000, 20_000] {
        assert_eq!(kept(rows), (0..rows).collect::<Vec<_>>());
    }
}

/// By hand: of runs 0 to 20 every second one, the last as far as it goes; of 100 runs every eighth.
#[test]
fn beyond_the_limit_every_nth_run_is_kept() {
    let runs = |every: u64, rows: u64| -> Vec<u64> {
        (0..rows).filter(|row| (row / 1_000) % every == 0).collect()
    };
    assert_eq!(kept(20_001), runs(2, 20_001));
    assert_eq!(kept(39_999), runs(2, 39_999));
    assert_eq!(kept(40_001), runs(4, 40_001));
    assert_eq!(kept(100_500), runs(8, 100_500));
    assert_eq!(kept(1_000_000), runs(64, 1_000_000));
}
