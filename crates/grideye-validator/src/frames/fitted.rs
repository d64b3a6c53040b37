//! Recognizes the frames that a scene was fitted to, by their pixels: cutting, renaming and converting keep those.

use crate::constants::REST_ENOUGH;
use crate::frames::timeline::Timeline;
use grideye_frame::RecordedFrame;
use grideye_frame::word::pixel_steps;
use grideye_recording::Record;
use grideye_scene::{Calibrated, Scene, fnv1a};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::time::Duration;

/// Most marks of a stretch: two per second of a minute.
const MARKS_MAX: u32 = 120;

/// Marks the frames at these times of the scene, for a table with these keys. It has no lines in a text yet.
pub(crate) fn calibrated(
    records: &[Record],
    timeline: &Timeline,
    (from, to): (Duration, Duration),
    keys: Vec<String>,
) -> Calibrated {
    let every = to.saturating_sub(from) / (MARKS_MAX - 1);
    // Rounded up, so that no frame is farther from a mark than the table says.
    let every = Duration::from_millis(u64::try_from(every.as_millis()).unwrap_or(u64::MAX) + 1);
    let mut frames: Vec<u32> = Vec::new();
    let mut next = from;
    for record in records {
        let time = timeline.time(record.stamp.t_boot_ns);
        let (Some(raw), Some(time)) = (record.reading.frame(), time) else {
            continue;
        };
        if (next..=to).contains(&time) {
            frames.push(mark(raw));
            while next <= time {
                next += every;
            }
        }
    }
    Calibrated {
        keys,
        sd: BTreeMap::new(),
        every_s: every.as_secs_f64(),
        frames,
        lines: 0..0,
    }
}

/// The boot clock's ranges in which the scene was fitted to these records.
pub(crate) fn fitted(records: &[Record], scene: &Scene) -> Vec<RangeInclusive<u64>> {
    let mut reach_ns: HashMap<u32, u64> = HashMap::new();
    for table in scene.calibrated() {
        let every = Duration::try_from_secs_f64(table.every_s).unwrap_or_default();
        let every_ns = u64::try_from(every.as_nanos()).unwrap_or(u64::MAX);
        for frame in &table.frames {
            let reach_ns = reach_ns.entry(*frame).or_default();
            *reach_ns = every_ns.max(*reach_ns);
        }
    }
    if reach_ns.is_empty() {
        return Vec::new();
    }
    let near = records.iter().filter_map(|record| {
        let reach_ns = *reach_ns.get(&mark(record.reading.frame()?))?;
        let at_ns = record.stamp.t_boot_ns;
        Some(at_ns.saturating_sub(reach_ns)..=at_ns.saturating_add(reach_ns))
    });
    let mut joined: Vec<RangeInclusive<u64>> = Vec::new();
    for range in near {
        match joined.last_mut() {
            Some(last) if last.contains(range.start()) => {
                *last = *last.start()..=*range.end().max(last.end());
            }
            _ => joined.push(range),
        }
    }
    joined
}

/// The pixels' steps, which every format of a recording keeps.
fn mark(raw: &RecordedFrame) -> u32 {
    let mut text = String::with_capacity(4 * raw.pixels.len());
    for word in raw.pixels {
        let _ = write!(text, "{} ", pixel_steps(word));
    }
    let hash = fnv1a(&text);
    u32::try_from((hash ^ hash >> 32) & u64::from(u32::MAX)).unwrap_or_default()
}

/// How much of a recording the scene was fitted to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FittedShare {
    pub(crate) fitted: usize,
    pub(crate) of: usize,
}

impl FittedShare {
    pub(crate) const fn rest(self) -> usize {
        self.of - self.fitted
    }

    /// Whether the other frames are more than the moments next to the fitted ones: half as many, or five seconds at 10 Hz.
    pub(crate) fn leaves_enough(self) -> bool {
        self.fitted == 0 || self.rest() >= (self.fitted / 2).clamp(2, REST_ENOUGH)
    }

    /// Whether the scene was fitted to some frames and is judged by the others.
    pub(crate) fn is_apart(self) -> bool {
        self.fitted > 0 && self.leaves_enough()
    }
}
