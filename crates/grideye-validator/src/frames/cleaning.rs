//! Finds frames that show nothing of their own moment and leaves them out, each with a reason.

use crate::constants::{BY_CHANCE_MAX, STALL_FRAMES};
use crate::frames::faults::{FaultFinder, Standing};
use crate::frames::types::{Pixels, decoded};
use grideye_frame::NoData;
use grideye_recording::Record;
use std::collections::BTreeMap;
use std::fmt;

/// Why a row of the recording is not compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the words below say it")]
pub enum LeftOut {
    Missing(NoData),
    Torn,
    Duplicate,
    Stalled,
    Burst,
    OutsideScene,
}

/// How many rows were left out for one reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names say it")]
pub struct LeftOutCount {
    pub reason: LeftOut,
    pub rows: usize,
    /// Sequence number of the first of them.
    pub first_seq: u64,
}

impl LeftOut {
    /// The stable name in files and JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Missing(_) => "missing",
            Self::Torn => "torn",
            Self::Duplicate => "duplicate",
            Self::Stalled => "stalled",
            Self::Burst => "burst",
            Self::OutsideScene => "outside_scene",
        }
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing(reason) => write!(formatter, "not read: {reason}"),
            Self::Torn => formatter.pad("torn: part of the frame before"),
            Self::Duplicate => formatter.pad("duplicates of the frame before"),
            Self::Stalled => formatter.pad("the sensor stood still: many duplicates in a row"),
            Self::Burst => {
                formatter.pad("read in a burst after a stall: their times are not known")
            }
            Self::OutsideScene => formatter.pad("before the scene's start or after its end"),
        }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Read {
    pub(crate) seq: u64,
    /// Boot clock of the device, nanoseconds.
    pub(crate) boot_ns: u64,
    pub(crate) celsius: Pixels,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Counts(BTreeMap<LeftOut, (usize, u64)>);

impl Counts {
    pub(crate) fn add(&mut self, reason: LeftOut, seq: u64) {
        self.0.entry(reason).or_insert((0, seq)).0 += 1;
    }

    pub(crate) fn list(&self) -> Vec<LeftOutCount> {
        let entry = |(&reason, &(rows, first_seq)): (&LeftOut, &(usize, u64))| LeftOutCount {
            reason,
            rows,
            first_seq,
        };
        self.0.iter().map(entry).collect()
    }
}

/// The frames of a recording, each once and whole, glitched pixels mended; and what was left out.
pub(crate) fn clean(records: &[Record], times_matter: bool) -> (Vec<Read>, Counts) {
    let mut counts = Counts::default();
    let mut frames = read(records, &mut counts);
    let standings = standings(&mut frames);
    let bursts = if times_matter {
        bursts(&frames)
    } else {
        vec![false; frames.len()]
    };
    let mut kept = Vec::with_capacity(frames.len());
    for ((frame, standing), burst) in frames.into_iter().zip(standings).zip(bursts) {
        match standing.or(burst.then_some(LeftOut::Burst)) {
            Some(reason) => counts.add(reason, frame.seq),
            None => kept.push(frame),
        }
    }
    (kept, counts)
}

fn read(records: &[Record], counts: &mut Counts) -> Vec<Read> {
    let mut frames = Vec::with_capacity(records.len());
    for record in records {
        match &record.reading {
            grideye_frame::Reading::Frame(raw) => frames.push(Read {
                seq: record.seq,
                boot_ns: record.stamp.t_boot_ns,
                celsius: decoded(raw),
            }),
            grideye_frame::Reading::NoData(reason) => {
                counts.add(LeftOut::Missing(*reason), record.seq);
            }
        }
    }
    frames
}

fn standings(frames: &mut [Read]) -> Vec<Option<LeftOut>> {
    let mut finder = FaultFinder::default();
    let mut before: Option<(u64, Pixels)> = None;
    let mut found = Vec::with_capacity(frames.len());
    for frame in frames {
        let follows = before.filter(|(seq, _)| seq.checked_add(1) == Some(frame.seq));
        let follows = follows.map(|(_, celsius)| celsius);
        let (mended, standing) = finder.push(&frame.celsius, follows.as_ref());
        found.push(standing);
        frame.celsius = mended;
        before = Some((frame.seq, mended));
    }
    let torn_from = finder.torn_from();
    let faults = finder.finish();
    let own = faults.own();
    // Without noise every frame looks like the one before, and with few frames of its own chance is unknown.
    let known = own > 0 && faults.torn_by_chance <= BY_CHANCE_MAX && own * 20 > faults.compared;
    let mut reasons: Vec<Option<LeftOut>> = found
        .into_iter()
        .map(|standing| match standing {
            Standing::Torn(run) if known && torn_from.is_some_and(|from| run >= from) => {
                Some(LeftOut::Torn)
            }
            Standing::Duplicate if known => Some(LeftOut::Duplicate),
            _ => None,
        })
        .collect();
    let is_duplicate = |reason: &Option<LeftOut>| *reason == Some(LeftOut::Duplicate);
    for run in reasons.chunk_by_mut(|left, right| is_duplicate(left) == is_duplicate(right)) {
        if run.len() >= STALL_FRAMES && run.first().is_some_and(is_duplicate) {
            run.fill(Some(LeftOut::Stalled));
        }
    }
    reasons
}

/// Frames delayed by a stall: within a quarter of the median interval, after one of more than 2.5 medians.
fn bursts(frames: &[Read]) -> Vec<bool> {
    let interval = |pair: &[Read]| u128::from(pair[1].boot_ns.saturating_sub(pair[0].boot_ns));
    let mut intervals: Vec<u128> = frames.windows(2).map(interval).collect();
    if intervals.is_empty() {
        return vec![false; frames.len()];
    }
    let middle = intervals.len() / 2;
    let typical = *intervals.select_nth_unstable(middle).1;
    let mut held_up = false;
    let follows = frames.windows(2).map(|pair| {
        let gap = interval(pair);
        let burst = held_up && 4 * gap < typical;
        held_up = burst || 2 * gap > 5 * typical;
        burst
    });
    std::iter::once(false).chain(follows).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::types;
    use grideye_frame::PIXELS;

    /// A frame of a noisy sensor, so that none repeats the one before.
    fn record(seq: u64, seed: u64) -> Record {
        let pixels = std::array::from_fn(|pixel| {
            let pixel = u64::try_from(pixel).unwrap();
            let step = (seed * 7919 + pixel * 104_729 + seed * pixel * 31) % 97 % 5;
            80 + u16::try_from(step).unwrap()
        });
        types::record(seq, seq * 100_000_000, pixels)
    }

    /// Runs of a thinned recording, 31,000 rows apart.
    #[test]
    fn borders_of_runs_are_no_faults() {
        let run = |first: u64| (0..200).map(move |index| record(first + index, first + index));
        let mut records: Vec<Record> = run(0).chain(run(32_000)).chain(run(64_000)).collect();
        records[200].reading = records[199].reading;
        let (kept, counts) = clean(&records, true);
        assert_eq!(kept.len(), 600, "{:?}", counts.list());
        // Without a border between, it is a duplicate.
        records[101].reading = records[100].reading;
        let (kept, counts) = clean(&records, true);
        assert_eq!(kept.len(), 599);
        assert_eq!(reasons(&counts), [(LeftOut::Duplicate, 1)]);
    }

    fn reasons(counts: &Counts) -> Vec<(LeftOut, usize)> {
        let counts = counts.list().into_iter();
        counts.map(|count| (count.reason, count.rows)).collect()
    }

    /// Four duplicates in a row come from reading too often; with five the sensor stalled.
    #[test]
    fn five_duplicates_in_a_row_are_a_stall() {
        for (repeats, reason) in [(4, LeftOut::Duplicate), (5, LeftOut::Stalled)] {
            let mut records: Vec<Record> = (0..200).map(|index| record(index, index)).collect();
            let shown = records[50].reading;
            for record in &mut records[51..51 + repeats] {
                record.reading = shown;
            }
            let (_, counts) = clean(&records, true);
            assert_eq!(reasons(&counts), [(reason, repeats)]);
        }
    }

    /// After a stall the first frame is late and counts; those delayed with it do not; one that is a little early does.
    #[test]
    fn bursts_after_a_stall_are_told_from_jitter() {
        let burst_ms = |after: &[u64]| -> Vec<bool> {
            let steady = (0..10).map(|index| index * 100);
            let frames: Vec<Read> = steady
                .chain(after.iter().copied())
                .map(|ms| Read {
                    seq: ms,
                    boot_ns: ms * 1_000_000,
                    celsius: [20.0; PIXELS],
                })
                .collect();
            bursts(&frames).split_off(10)
        };
        assert_eq!(burst_ms(&[1900, 1960, 2060]), [false; 3]);
        let burst = burst_ms(&[1900, 1902, 1926, 2026]);
        assert_eq!(burst, [false, true, true, false]);
        assert_eq!(burst_ms(&[1000, 1010]), [false; 2]);
    }
}
