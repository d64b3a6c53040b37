//! How an engine without columns keeps rows: chunks of consecutive numbers, as bytes.
//!
//! ```text
//! plain   of each row: t_arrival_ns · t_boot_ns · t_utc_ns (8 bytes each) · clock and kind (1) · thermistor (2) and the
//!         64 words, packed (`grideye_recording::packed`) or, in files of before, 2 bytes each; or the reason why there is
//!         no frame (its length, 1, and its name)
//! sealed  a segment (`segment.rs`)
//! ```
//!
//! All rows of a chunk have one epoch. Chunks of one stream never overlap, because their numbers are consecutive and no
//! number is kept twice.

use crate::store::error::StoreError;
use crate::store::fresh::Arrived;
use crate::store::row::{damaged, unsigned};
use crate::store::segment::{self, SealedRow};
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::{ClockState, Record, Stamp, packed};

/// Rows in a plain chunk at most, so that one is read quickly.
const PLAIN_ROWS_MAX: usize = 256;

/// Its words are not packed: read, and no longer written.
const KIND_FRAME: u8 = 0;
const KIND_MISSING: u8 = 1;
const KIND_PACKED: u8 = 2;
/// A row of a room, with some to spare.
const ROW_BYTES: usize = 112;

/// Rows that came together, in the plain form.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Plain {
    pub(super) first_seq: u64,
    pub(super) last_seq: u64,
    /// How many carry pixels.
    pub(super) frames: i64,
    pub(super) rows: Vec<u8>,
}

/// Cuts what is new of a stream where numbers are left out.
///
/// `fresh` is in ascending number.
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
            put(&mut chunk.rows, record);
            rows_in_last += 1;
        }
    }
    chunks
}

fn put(rows: &mut Vec<u8>, record: &Record) {
    rows.extend_from_slice(&record.stamp.t_boot_ns.to_le_bytes());
    rows.extend_from_slice(&record.stamp.t_utc_ns.to_le_bytes());
    let clock = record.stamp.clock.code();
    match &record.reading {
        Reading::Frame(raw) => {
            rows.push(clock << 4 | KIND_PACKED);
            rows.extend_from_slice(&raw.thermistor.0.to_le_bytes());
            packed::put(rows, &raw.pixels);
        }
        Reading::NoData(reason) => {
            rows.push(clock << 4 | KIND_MISSING);
            // The names of reasons are short.
            rows.push(u8::try_from(reason.name().len()).unwrap_or(u8::MAX));
            rows.extend(reason.name().bytes());
        }
    }
}

/// A chunk as an engine keeps it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept<'r> {
    pub(super) first_seq: i64,
    pub(super) last_seq: i64,
    pub(super) epoch: i64,
    pub(super) is_sealed: bool,
    pub(super) rows: &'r [u8],
}

impl Kept<'_> {
    /// The rows, in ascending order.
    pub(super) fn open(&self) -> Result<Vec<SealedRow>, StoreError> {
        let rows = if self.is_sealed {
            segment::open(self.rows)?
        } else {
            self.open_plain()?
        };
        let (first, last) = (
            unsigned("first_seq", self.first_seq)?,
            unsigned("last_seq", self.last_seq)?,
        );
        let is_whole = (first..=last).eq(rows.iter().map(|row| row.record.seq));
        if is_whole {
            Ok(rows)
        } else {
            Err(damaged("a chunk of other rows than it says"))
        }
    }

    fn open_plain(&self) -> Result<Vec<SealedRow>, StoreError> {
        let mut bytes = Bytes(self.rows);
        let mut rows = Vec::with_capacity(8);
        let mut seq = unsigned("first_seq", self.first_seq)?;
        while !bytes.0.is_empty() {
            rows.push(SealedRow {
                t_arrival_ns: i64::from_le_bytes(bytes.array()?),
                record: bytes.record(seq)?,
                arrival: self.epoch,
            });
            seq = seq.saturating_add(1);
        }
        Ok(rows)
    }
}

/// What is left of a plain chunk to be read.
struct Bytes<'r>(&'r [u8]);

impl<'r> Bytes<'r> {
    fn take(&mut self, length: usize) -> Result<&'r [u8], StoreError> {
        let (taken, rest) = self
            .0
            .split_at_checked(length)
            .ok_or_else(|| damaged("a chunk that is cut"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], StoreError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    fn record(&mut self, seq: u64) -> Result<Record, StoreError> {
        let t_boot_ns = u64::from_le_bytes(self.array()?);
        let t_utc_ns = i64::from_le_bytes(self.array()?);
        let [kind] = self.array()?;
        let clock = ClockState::from_code(kind >> 4)
            .ok_or_else(|| damaged(&format!("clock state {}", kind >> 4)))?;
        let reading = match kind & 0x0F {
            KIND_FRAME => {
                let thermistor = ThermistorWord(u16::from_le_bytes(self.array()?));
                let mut pixels = [PixelWord(0); PIXELS];
                let words = self.take(2 * PIXELS)?.chunks_exact(2);
                for (word, pair) in pixels.iter_mut().zip(words) {
                    word.0 = u16::from_le_bytes([pair[0], pair[1]]);
                }
                Reading::Frame(RawFrame { thermistor, pixels })
            }
            KIND_PACKED => {
                let thermistor = ThermistorWord(u16::from_le_bytes(self.array()?));
                let (pixels, length) = packed::take(self.0)
                    .ok_or_else(|| damaged("a frame that is not packed well"))?;
                self.take(length)?;
                Reading::Frame(RawFrame { thermistor, pixels })
            }
            KIND_MISSING => {
                let [length] = self.array()?;
                let name = String::from_utf8_lossy(self.take(length.into())?);
                let reason = name.parse::<NoData>();
                Reading::NoData(reason.map_err(|unknown| damaged(&format!("{name:?}: {unknown}")))?)
            }
            other => return Err(damaged(&format!("a row of kind {other}"))),
        };
        Ok(Record {
            seq,
            stamp: Stamp {
                t_boot_ns,
                t_utc_ns,
                clock,
            },
            reading,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn record(seq: u64) -> Record {
        let word = |pixel: usize| u16::try_from(pixel * 997 % 65_536).unwrap() ^ 0xF00F;
        let reading = match seq % 7 {
            3 => Reading::NoData(NoData::ALL[usize::try_from(seq).unwrap() % NoData::ALL.len()]),
            _ => Reading::Frame(RawFrame {
                thermistor: ThermistorWord(u16::MAX - 3),
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

    /// A frame and a missing one as they stand in files of before, laid down by hand.
    #[test]
    fn rows_that_are_not_packed_are_read() {
        let mut rows = Vec::new();
        for (seq, kind) in [(7_u64, 0x10), (8, 0x21)] {
            rows.extend(90_i64.to_le_bytes());
            rows.extend((1000 + seq).to_le_bytes());
            rows.extend((-5_i64).to_le_bytes());
            rows.push(kind);
            if kind == 0x10 {
                rows.extend(402_u16.to_le_bytes());
                for word in 0..64_u16 {
                    rows.extend((word ^ 0xF00F).to_le_bytes());
                }
            } else {
                rows.extend(b"\x04nack");
            }
        }
        let kept = Kept {
            first_seq: 7,
            last_seq: 8,
            epoch: 5,
            is_sealed: false,
            rows: &rows,
        };
        let read = kept.open().unwrap();
        let word = |pixel: usize| PixelWord(u16::try_from(pixel).unwrap() ^ 0xF00F);
        let readings = [
            Reading::Frame(RawFrame {
                thermistor: ThermistorWord(402),
                pixels: std::array::from_fn(word),
            }),
            Reading::NoData(NoData::Nack),
        ];
        let clocks = [ClockState::Synced, ClockState::Stepped];
        for (place, row) in read.iter().enumerate() {
            let seq = 7 + u64::try_from(place).unwrap();
            assert_eq!(
                (row.record.seq, row.record.stamp.t_boot_ns),
                (seq, 1000 + seq)
            );
            assert_eq!((row.t_arrival_ns, row.record.stamp.t_utc_ns), (90, -5));
            assert_eq!(row.record.stamp.clock, clocks[place]);
            assert_eq!(row.record.reading, readings[place]);
        }
        assert_eq!(read.len(), 2);
    }

    #[test]
    fn a_chunk_that_is_cut_or_says_other_numbers_is_refused() {
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
