//! The latest frames of a few sensors in memory: of the first ones that sent, and of those requested.

use crate::limits::Limits;
use crate::live::by_sensor::BySensor;
use crate::lock::lock;
use grideye_recording::{Record, StreamId};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// The newest frames of the first sensors that sent, and of others from their first request on; a new one displaces the
/// sensor requested longest ago. Frames from an agent's spool are not included.
#[derive(Clone)]
pub struct RecentFrames(Arc<Shared>);

struct Shared {
    sensors: Mutex<BySensor<Kept>>,
    sensors_max: usize,
    frames_max: usize,
}

#[derive(Default)]
struct Kept {
    run: Option<Run>,
    /// The number of the last request for it; 0 for never.
    asked: u64,
}

struct Run {
    stream: StreamId,
    records: VecDeque<Record>,
}

impl RecentFrames {
    pub(super) fn new(limits: &Limits) -> Self {
        Self(Arc::new(Shared {
            sensors: Mutex::default(),
            sensors_max: limits.recent_sensors_max.max(1),
            frames_max: limits.recent_frames_max.max(1),
        }))
    }

    /// The stream and its frames, oldest first, including missing ones; `None` if none are held.
    #[must_use]
    pub fn of(&self, device: &str, sensor: &str) -> Option<(StreamId, Vec<Record>)> {
        let mut sensors = lock(&self.0.sensors);
        let asked = 1 + sensors.values().map(|kept| kept.asked).max().unwrap_or(0);
        sensors.make_room(device, sensor, self.0.sensors_max, |kept| kept.asked);
        let kept = sensors.get_or_make(device, sensor, usize::MAX, Kept::default)?;
        kept.asked = asked;
        let run = kept.run.as_ref()?;
        Some((run.stream.clone(), run.records.iter().copied().collect()))
    }

    /// Takes the records shown of a stream. Another boot of the sensor starts over.
    pub(super) fn take<'r>(
        &self,
        stream: &StreamId,
        records: impl IntoIterator<Item = &'r Record>,
    ) {
        let mut sensors = lock(&self.0.sensors);
        let (device, sensor, most) = (&stream.device, &stream.sensor, self.0.sensors_max);
        let Some(kept) = sensors.get_or_make(device, sensor, most, Kept::default) else {
            return;
        };
        if kept.run.as_ref().is_none_or(|run| run.stream != *stream) {
            kept.run = Some(Run {
                stream: stream.clone(),
                // Allocated at once, because growing would copy. Until filled it takes only address space.
                records: VecDeque::with_capacity(self.0.frames_max),
            });
        }
        let Some(run) = &mut kept.run else { return };
        for record in records {
            if run.records.len() >= self.0.frames_max {
                run.records.pop_front();
            }
            run.records.push_back(*record);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{NoData, Reading};
    use grideye_recording::{ClockState, Stamp};

    fn stream(sensor: &str, boot: &str) -> StreamId {
        StreamId {
            device: "pi".into(),
            sensor: sensor.into(),
            boot: boot.into(),
        }
    }

    fn records(seqs: std::ops::Range<u64>) -> Vec<Record> {
        let stamp = Stamp {
            t_boot_ns: 0,
            t_utc_ns: 0,
            clock: ClockState::Synced,
        };
        let record = |seq| Record {
            seq,
            stamp,
            reading: Reading::NoData(NoData::Nack),
        };
        seqs.map(record).collect()
    }

    fn seqs(recent: &RecentFrames, sensor: &str) -> Option<Vec<u64>> {
        let (_, records) = recent.of("pi", sensor)?;
        Some(records.iter().map(|record| record.seq).collect())
    }

    fn recent(sensors_max: usize, frames_max: usize) -> RecentFrames {
        RecentFrames::new(&Limits {
            recent_sensors_max: sensors_max,
            recent_frames_max: frames_max,
            ..Limits::default()
        })
    }

    #[test]
    fn the_newest_frames_of_the_first_sensors_are_kept_and_no_more_than_the_limits() {
        let recent = recent(1, 3);
        recent.take(&stream("a", "b1"), &records(0..2));
        assert_eq!(seqs(&recent, "a"), Some(vec![0, 1]));
        recent.take(&stream("a", "b1"), &records(2..7));
        recent.take(&stream("other", "b1"), &records(0..7));
        assert_eq!(seqs(&recent, "a"), Some(vec![4, 5, 6]));
    }

    #[test]
    fn another_sensor_is_kept_from_the_first_question_on() {
        let recent = recent(1, 8);
        let late = |from: u64| recent.take(&stream("late", "b1"), &records(from..from + 2));
        recent.take(&stream("a", "b1"), &records(0..2));
        late(0);
        assert_eq!(seqs(&recent, "late"), None);
        late(2);
        assert_eq!(seqs(&recent, "late"), Some(vec![2, 3]));
    }

    #[test]
    fn another_boot_of_the_sensor_starts_over() {
        let recent = recent(4, 8);
        recent.take(&stream("a", "b1"), &records(7..9));
        recent.take(&stream("a", "b2"), &records(0..1));
        let (stream, records) = recent.of("pi", "a").unwrap();
        assert_eq!((&*stream.boot, records.len()), ("b2", 1));
    }

    #[test]
    fn the_sensor_asked_for_longest_ago_makes_room() {
        let recent = recent(2, 8);
        for sensor in ["a", "b", "a", "c"] {
            let _ = recent.of("pi", sensor);
        }
        for sensor in ["a", "b", "c"] {
            recent.take(&stream(sensor, "b1"), &records(0..1));
        }
        let kept = ["a", "c", "b"].map(|sensor| seqs(&recent, sensor));
        assert_eq!(kept, [Some(vec![0]), Some(vec![0]), None]);
    }
}
