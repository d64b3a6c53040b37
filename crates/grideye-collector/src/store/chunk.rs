//! How an engine without columns stores rows: as bytes, in chunks of consecutive numbers of one epoch. No two overlap.
//!
//! ```text
//!   plain   for each row: t_arrival_ns (8 bytes) and the record (`grideye_recording::record::layout`)
//!   sealed  a segment (`segment.rs`)
//! ```

use crate::store::error::Result;
use crate::store::plan::Arrived;
use crate::store::row::{damaged, unsigned};
use crate::store::segment::{self, SealedRow};
use grideye_recording::record::layout::{ByteReader, Fault, Form, put};

/// Maximum rows in a plain chunk, so that reading one is quick.
pub(super) const PLAIN_ROWS_MAX: usize = 256;

/// Bytes reserved for each row, a little more than a row takes.
const ROW_BYTES: usize = 112;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Plain {
    pub(super) first_seq: u64,
    pub(super) last_seq: u64,
    pub(super) frames: i64,
    pub(super) rows: Vec<u8>,
}

/// Cuts the new rows of a stream, in ascending order, at gaps in the numbers and at [`PLAIN_ROWS_MAX`].
pub(super) fn cut<'f>(fresh: impl Iterator<Item = &'f Arrived>) -> Vec<Plain> {
    let mut chunks: Vec<Plain> = Vec::new();
    let mut rows_in_last = 0;
    for (record, t_arrival_ns) in fresh {
        let seq = record.seq;
        let fits = chunks.last().is_some_and(|last| {
            last.last_seq.checked_add(1) == Some(seq) && rows_in_last < PLAIN_ROWS_MAX
        });
        if !fits {
            rows_in_last = 0;
            chunks.push(Plain {
                first_seq: seq,
                last_seq: seq,
                frames: 0,
                rows: Vec::with_capacity(64 * ROW_BYTES),
            });
        }
        if let Some(chunk) = chunks.last_mut() {
            chunk.last_seq = seq;
            chunk.frames += i64::from(record.reading.frame().is_some());
            chunk.rows.extend_from_slice(&t_arrival_ns.to_le_bytes());
            put(&mut chunk.rows, record, Form::Chunk);
            rows_in_last += 1;
        }
    }
    chunks
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Kept<'r> {
    pub(super) first_seq: i64,
    pub(super) last_seq: i64,
    pub(super) epoch: i64,
    pub(super) is_sealed: bool,
    pub(super) rows: &'r [u8],
}

impl Kept<'_> {
    pub(super) fn open(&self) -> Result<Vec<SealedRow>> {
        let rows = if self.is_sealed {
            segment::open(self.rows)?
        } else {
            self.open_plain()?
        };
        let first = unsigned("first_seq", self.first_seq)?;
        let last = unsigned("last_seq", self.last_seq)?;
        let is_whole = (first..=last).eq(rows.iter().map(|row| row.record.seq));
        if is_whole {
            Ok(rows)
        } else {
            Err(damaged("a chunk with other rows than it declares"))
        }
    }

    fn open_plain(&self) -> Result<Vec<SealedRow>> {
        let unreadable = |fault: Fault| damaged(&format!("a chunk that cannot be read: {fault}"));
        let mut bytes = ByteReader::new(self.rows);
        let mut rows = Vec::with_capacity(8);
        let mut seq = unsigned("first_seq", self.first_seq)?;
        while bytes.left() > 0 {
            let t_arrival_ns = bytes.array().map_err(unreadable)?;
            let mut record = bytes.record(Form::Chunk).map_err(unreadable)?;
            record.seq = seq;
            rows.push(SealedRow {
                record,
                t_arrival_ns: i64::from_le_bytes(t_arrival_ns),
                arrival: self.epoch,
            });
            seq = seq.saturating_add(1);
        }
        Ok(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::{NoData, PixelWord, Reading, RecordedFrame, ThermistorWord};
    use grideye_recording::{ClockState, Record, Stamp};
    use std::collections::BTreeMap;

    fn record(seq: u64) -> Record {
        let word = |pixel: usize| u16::try_from(pixel * 997 % 65_536).unwrap() ^ 0xF00F;
        let reading = match seq % 7 {
            3 => Reading::NoData(NoData::ALL[usize::try_from(seq).unwrap() % NoData::ALL.len()]),
            _ => Reading::Frame(RecordedFrame {
                thermistor: (seq % 5 > 0).then_some(ThermistorWord(u16::MAX - 3)),
                pixels: std::array::from_fn(|pixel| PixelWord(word(pixel))),
            }),
        };
        Record {
            seq,
            stamp: Stamp {
                t_boot_ns: u64::MAX / 2 - seq,
                t_utc_ns: -5,
                clock: ClockState::ALL[usize::try_from(seq % 3).unwrap()],
            },
            reading,
        }
    }

    fn fresh(seqs: impl Iterator<Item = (u64, i64)>) -> BTreeMap<u64, Arrived> {
        seqs.map(|(seq, t_arrival_ns)| (seq, (record(seq), t_arrival_ns)))
            .collect()
    }

    fn kept(chunk: &Plain) -> Kept<'_> {
        Kept {
            first_seq: i64::try_from(chunk.first_seq).unwrap(),
            last_seq: i64::try_from(chunk.last_seq).unwrap(),
            epoch: 5,
            is_sealed: false,
            rows: &chunk.rows,
        }
    }

    #[test]
    fn rows_are_cut_at_gaps_and_at_the_limit_and_come_back() {
        let seqs = (0..10)
            .chain(12..13)
            .chain(14..600)
            .map(|seq| (seq, -i64::try_from(seq).unwrap()));
        let fresh = fresh(seqs);
        let chunks = cut(fresh.values());
        let spans: Vec<(u64, u64)> = chunks.iter().map(|c| (c.first_seq, c.last_seq)).collect();
        assert_eq!(spans, [(0, 9), (12, 12), (14, 269), (270, 525), (526, 599)]);
        let mut back = BTreeMap::new();
        for chunk in &chunks {
            let rows = kept(chunk).open().unwrap();
            let frames = rows
                .iter()
                .filter(|row| row.record.reading.frame().is_some());
            assert_eq!(i64::try_from(frames.count()).unwrap(), chunk.frames);
            for row in rows {
                assert_eq!(row.arrival, 5);
                back.insert(row.record.seq, (row.record, row.t_arrival_ns));
            }
        }
        assert_eq!(back, fresh);
    }

    #[test]
    fn a_truncated_or_mislabeled_chunk_is_rejected() {
        let chunk = cut(fresh((0..6).map(|seq| (seq, 1))).values()).remove(0);
        for length in 0..chunk.rows.len() {
            let mut cut = kept(&chunk);
            cut.rows = &chunk.rows[..length];
            cut.open().unwrap_err();
        }
        for last_seq in [4, 6] {
            let other = Kept {
                last_seq,
                ..kept(&chunk)
            };
            other.open().unwrap_err();
        }
    }
}
