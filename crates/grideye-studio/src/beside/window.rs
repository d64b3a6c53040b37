//! Selects the frames of a sensor to compare with a scene: the last seconds that the scene covers.

use grideye_recording::Record;
use grideye_validator::Timeline;
use std::time::Duration;

/// The frames of a time window.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Window {
    /// In order of measurement; the first has pixels.
    pub(super) records: Vec<Record>,
    /// The scene's time at the first frame.
    pub(super) start: Duration,
    /// From the first frame to the last.
    pub(super) length: Duration,
}

/// Where a scene lies on the sensor's time axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Laid {
    /// Static: any time fits.
    Anywhere,
    /// It lies on this timeline, and lasts this long.
    At { timeline: Timeline, takes: Duration },
}

/// The frames within `length` before the last one that the scene covers; `None` if it covers none.
pub(super) fn window(records: &[Record], laid: Laid, length: Duration) -> Option<Window> {
    let spoken_of = |record: &&Record| match laid {
        Laid::Anywhere => true,
        Laid::At { timeline, takes } => {
            let time = timeline.time(record.stamp.t_boot_ns);
            time.is_some_and(|time| time <= takes)
        }
    };
    let within: Vec<&Record> = records.iter().filter(spoken_of).collect();
    let last_ns = within.last()?.stamp.t_boot_ns;
    let first_ns = last_ns.saturating_sub(u64::try_from(length.as_nanos()).unwrap_or(u64::MAX));
    let records: Vec<Record> = within
        .into_iter()
        .skip_while(|record| record.stamp.t_boot_ns < first_ns || record.reading.frame().is_none())
        .copied()
        .collect();
    let first_ns = records.first()?.stamp.t_boot_ns;
    let start = match laid {
        Laid::Anywhere => Duration::ZERO,
        Laid::At { timeline, .. } => timeline.time(first_ns).unwrap_or_default(),
    };
    Some(Window {
        records,
        start,
        length: Duration::from_nanos(last_ns.saturating_sub(first_ns)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
    use grideye_recording::{ClockState, Stamp};

    const SECOND_NS: u64 = 1_000_000_000;

    /// One frame per second from boot clock 100 s on; those in `missing` were not read.
    fn records(count: u64, missing: &[u64]) -> Vec<Record> {
        let record = |seq| Record {
            seq,
            stamp: Stamp {
                t_boot_ns: (100 + seq) * SECOND_NS,
                t_utc_ns: 0,
                clock: ClockState::Synced,
            },
            reading: if missing.contains(&seq) {
                Reading::NoData(NoData::Nack)
            } else {
                Reading::Frame(RecordedFrame {
                    thermistor: Some(ThermistorWord(400)),
                    pixels: [PixelWord(80); PIXELS],
                })
            },
        };
        (0..count).map(record).collect()
    }

    fn seqs(window: &Option<Window>) -> Option<(Vec<u64>, u64, u64)> {
        let window = window.as_ref()?;
        let seqs = window.records.iter().map(|record| record.seq).collect();
        Some((seqs, window.start.as_secs(), window.length.as_secs()))
    }

    fn at(origin_s: u64, takes_s: u64) -> Laid {
        Laid::At {
            timeline: Timeline::from_boot(origin_s * SECOND_NS),
            takes: Duration::from_secs(takes_s),
        }
    }

    #[test]
    fn of_a_still_scene_the_last_seconds_count_from_its_beginning() {
        let found = window(&records(9, &[]), Laid::Anywhere, Duration::from_secs(3));
        assert_eq!(seqs(&found), Some((vec![5, 6, 7, 8], 0, 3)));
        assert_eq!(window(&[], Laid::Anywhere, Duration::from_secs(3)), None);
    }

    #[test]
    fn a_moving_scene_speaks_of_its_own_seconds_alone() {
        // It begins with frame 2 and ends with frame 6.
        let found = window(&records(9, &[]), at(102, 4), Duration::from_secs(2));
        assert_eq!(seqs(&found), Some((vec![4, 5, 6], 2, 2)));
        let found = window(&records(9, &[]), at(102, 4), Duration::from_secs(60));
        assert_eq!(seqs(&found), Some((vec![2, 3, 4, 5, 6], 0, 4)));
        let before = window(&records(9, &[]), at(10, 20), Duration::from_secs(3));
        assert_eq!(before, None);
        let to_come = window(&records(9, &[]), at(500, 20), Duration::from_secs(3));
        assert_eq!(to_come, None);
    }

    #[test]
    fn it_begins_with_a_frame_that_was_read() {
        let found = window(&records(9, &[5, 7]), at(100, 60), Duration::from_secs(3));
        assert_eq!(seqs(&found), Some((vec![6, 7, 8], 6, 2)));
        let all = window(&records(3, &[0, 1, 2]), at(100, 60), Duration::from_secs(3));
        assert_eq!(all, None);
    }
}
