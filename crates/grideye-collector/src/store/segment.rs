//! Sealed segments: many rows of one stream as one blob, restored bit for bit.
//!
//! ```text
//!   "GES" 1 · rows (u32) · bytes of the columns (u32) · the columns, compressed by zstd with its checksum
//! ```
//!
//! The columns follow one another, each as planes of bytes (all lowest bytes first): number, boot time, wall time,
//! arrival time and arrival order, each as the change of its change; clock and kind; thermistor as its change; the 64
//! words minus the mean of the four frames before. Differences wrap around, so every 16-bit word is restored.

use crate::store::error::{Result, StoreError};
use crate::store::row::{damaged, unsigned};
use grideye_frame::{NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord};
use grideye_recording::record::layout::{ByteReader, Fault, put_name};
use grideye_recording::{ClockState, Record, Stamp};

/// Maximum rows in a segment: an hour of a sensor at 10 Hz.
pub const ROWS_MAX: usize = 36_000;

const MAGIC: [u8; 4] = *b"GES\x01";
const HEAD_BYTES: usize = 12;
/// Takes twice the time of zstd's default and saves a twentieth; higher levels save little more.
const LEVEL: i32 = 6;
/// Bytes of a row before compression: five columns of 8, one of 1, one of 2, 64 of 2.
const ROW_BYTES: usize = 5 * 8 + 1 + 2 + 2 * PIXELS;
/// The number of earlier frames that predict a frame's words.
const MEAN_OF: usize = 4;
/// The kind of a row with pixels; a missing frame has 1 or more, an index into the names at the head of the columns.
const KIND_FRAME: u8 = 0;
/// The kind of a row with pixels and no thermistor, which repeats the one before in its column.
const KIND_WITHOUT_THERMISTOR: u8 = 0x3F;

/// One row of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SealedRow {
    /// The record.
    pub record: Record,
    /// Wall clock of the collector when it arrived, in nanoseconds since 1970-01-01 UTC.
    pub t_arrival_ns: i64,
    /// Its position in the order of arrivals.
    pub arrival: i64,
}

/// Seals 1 to [`ROWS_MAX`] rows.
///
/// # Errors
/// [`StoreError::Failed`] for no rows or too many, or if memory runs out.
pub fn seal(rows: &[SealedRow]) -> Result<Vec<u8>> {
    if rows.is_empty() || rows.len() > ROWS_MAX {
        let what = format!("a segment of {} rows", rows.len());
        return Err(StoreError::Failed(what));
    }
    let columns = columns_of(rows)?;
    let length = |length: usize| u32::try_from(length).map_err(|error| failed(&error));
    let mut segment = Vec::with_capacity(HEAD_BYTES + 40 * rows.len());
    segment.extend(MAGIC);
    segment.extend(length(rows.len())?.to_le_bytes());
    segment.extend(length(columns.len())?.to_le_bytes());
    let mut compressor = zstd::bulk::Compressor::new(LEVEL).map_err(|error| failed(&error))?;
    compressor
        .include_checksum(true)
        .map_err(|error| failed(&error))?;
    let compressed = compressor.compress(&columns);
    segment.extend(compressed.map_err(|error| failed(&error))?);
    Ok(segment)
}

/// The rows of a segment.
///
/// # Errors
/// [`StoreError::Failed`] for bytes that are not a whole segment.
pub fn open(segment: &[u8]) -> Result<Vec<SealedRow>> {
    let (head, compressed) = segment
        .split_at_checked(HEAD_BYTES)
        .ok_or_else(|| damaged("a truncated segment"))?;
    let number = |at: usize| {
        let bytes = [head[at], head[at + 1], head[at + 2], head[at + 3]];
        usize::try_from(u32::from_le_bytes(bytes)).unwrap_or(usize::MAX)
    };
    let (rows, length) = (number(4), number(8));
    if head[..4] != MAGIC || rows == 0 || rows > ROWS_MAX {
        return Err(damaged("a segment of another kind"));
    }
    if length > rows * ROW_BYTES + names_bytes_max() {
        return Err(damaged("a segment that is longer than its rows"));
    }
    let columns = zstd::bulk::decompress(compressed, length)
        .map_err(|error| damaged(&format!("a segment that cannot be read: {error}")))?;
    if columns.len() != length {
        return Err(damaged("a segment of another length"));
    }
    rows_of(&columns, rows)
}

fn failed(error: &dyn std::fmt::Display) -> StoreError {
    StoreError::Failed(format!("a segment cannot be sealed: {error}"))
}

/// The names of the reasons: a count, then each name after its length.
fn names_bytes_max() -> usize {
    1 + NoData::ALL
        .iter()
        .map(|reason| 1 + reason.name().len())
        .sum::<usize>()
}

fn columns_of(rows: &[SealedRow]) -> Result<Vec<u8>> {
    let mut columns = Vec::with_capacity(names_bytes_max() + rows.len() * ROW_BYTES);
    let reasons = reasons_of(rows);
    columns.push(u8::try_from(reasons.len()).map_err(|error| failed(&error))?);
    for reason in &reasons {
        put_name(&mut columns, reason.name());
    }
    let of_each: [fn(&SealedRow) -> i64; 5] = [
        |row| i64::from_le_bytes(row.record.seq.to_le_bytes()),
        |row| i64::from_le_bytes(row.record.stamp.t_boot_ns.to_le_bytes()),
        |row| row.record.stamp.t_utc_ns,
        |row| row.t_arrival_ns,
        |row| row.arrival,
    ];
    for value in of_each {
        put_i64(&mut columns, rows.iter().map(value));
    }
    for row in rows {
        columns.push(kind_of(&row.record, &reasons));
    }
    let frames: Vec<&RecordedFrame> = rows
        .iter()
        .filter_map(|row| row.record.reading.frame())
        .collect();
    put_u16(&mut columns, &changes(&frames));
    put_u16(&mut columns, &residuals(&frames));
    Ok(columns)
}

fn reasons_of(rows: &[SealedRow]) -> Vec<NoData> {
    let mut reasons = Vec::new();
    for row in rows {
        if let Reading::NoData(reason) = row.record.reading {
            if !reasons.contains(&reason) {
                reasons.push(reason);
            }
        }
    }
    reasons
}

/// The clock state in the upper two bits; below, 0 for a frame, otherwise the index of the reason, from 1.
fn kind_of(record: &Record, reasons: &[NoData]) -> u8 {
    let kind = match record.reading {
        Reading::Frame(raw) if raw.thermistor.is_none() => KIND_WITHOUT_THERMISTOR,
        Reading::Frame(_) => KIND_FRAME,
        Reading::NoData(reason) => {
            let place = reasons.iter().position(|known| *known == reason);
            u8::try_from(place.unwrap_or(0) + 1).unwrap_or(u8::MAX)
        }
    };
    record.stamp.clock.code() << 6 | kind
}

fn changes(frames: &[&RecordedFrame]) -> Vec<u16> {
    let mut before = 0;
    let changes = frames.iter().map(|frame| {
        let thermistor = frame.thermistor.map_or(before, |word| word.0);
        let change = thermistor.wrapping_sub(before);
        before = thermistor;
        fold_u16(change)
    });
    changes.collect()
}

fn residuals(frames: &[&RecordedFrame]) -> Vec<u16> {
    let mut residuals = Vec::with_capacity(frames.len() * PIXELS);
    for (index, frame) in frames.iter().enumerate() {
        let before = &frames[index.saturating_sub(MEAN_OF)..index];
        for (pixel, word) in frame.pixels.iter().enumerate() {
            let predicted = mean(before.iter().map(|frame| frame.pixels[pixel]));
            residuals.push(fold_u16(word.0.wrapping_sub(predicted)));
        }
    }
    residuals
}

/// The rounded mean of a few words; 0 for none.
fn mean(words: impl ExactSizeIterator<Item = PixelWord>) -> u16 {
    let count = u32::try_from(words.len()).unwrap_or(u32::MAX);
    let sum: u32 = words.map(|word| u32::from(word.0)).sum();
    let rounded = (sum + count / 2).checked_div(count).unwrap_or(0);
    u16::try_from(rounded).unwrap_or(u16::MAX)
}

/// Maps small differences of either sign to small numbers.
fn fold_u16(difference: u16) -> u16 {
    let sign = if difference & 0x8000 == 0 { 0 } else { 0xFFFF };
    (difference << 1) ^ sign
}

fn unfold_u16(folded: u16) -> u16 {
    let sign = if folded & 1 == 0 { 0 } else { 0xFFFF };
    (folded >> 1) ^ sign
}

fn fold_u64(difference: u64) -> u64 {
    let sign = if difference >> 63 == 0 { 0 } else { u64::MAX };
    (difference << 1) ^ sign
}

fn unfold_u64(folded: u64) -> u64 {
    let sign = if folded & 1 == 0 { 0 } else { u64::MAX };
    (folded >> 1) ^ sign
}

/// Adds the change of the change of a column, in 8 planes.
fn put_i64(columns: &mut Vec<u8>, values: impl Iterator<Item = i64>) {
    let (mut before, mut change_before) = (0_u64, 0_u64);
    let folded: Vec<[u8; 8]> = values
        .map(|value| {
            let value = u64::from_le_bytes(value.to_le_bytes());
            let change = value.wrapping_sub(before);
            let folded = fold_u64(change.wrapping_sub(change_before));
            (before, change_before) = (value, change);
            folded.to_le_bytes()
        })
        .collect();
    for plane in 0..8 {
        columns.extend(folded.iter().map(|bytes| bytes[plane]));
    }
}

fn put_u16(columns: &mut Vec<u8>, folded: &[u16]) {
    for plane in 0..2 {
        columns.extend(folded.iter().map(|word| word.to_le_bytes()[plane]));
    }
}

fn i64s(columns: &mut ByteReader<'_>, rows: usize) -> Result<Vec<i64>> {
    let planes = columns.take(8 * rows).map_err(cut)?;
    let (mut before, mut change_before) = (0_u64, 0_u64);
    let values = (0..rows).map(|row| {
        let bytes = std::array::from_fn(|plane| planes[plane * rows + row]);
        let change = unfold_u64(u64::from_le_bytes(bytes)).wrapping_add(change_before);
        let value = before.wrapping_add(change);
        (before, change_before) = (value, change);
        i64::from_le_bytes(value.to_le_bytes())
    });
    Ok(values.collect())
}

fn u16s(columns: &mut ByteReader<'_>, count: usize) -> Result<Vec<u16>> {
    let planes = columns.take(2 * count).map_err(cut)?;
    let words = (0..count).map(|at| u16::from_le_bytes([planes[at], planes[count + at]]));
    Ok(words.map(unfold_u16).collect())
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "it stands where map_err wants a function of the error"
)]
fn cut(fault: Fault) -> StoreError {
    damaged(&format!("a segment with other columns: {fault}"))
}

fn rows_of(columns: &[u8], rows: usize) -> Result<Vec<SealedRow>> {
    let mut columns = ByteReader::new(columns);
    let [reasons_count] = columns.array().map_err(cut)?;
    let mut reasons: Vec<NoData> = Vec::new();
    for _ in 0..reasons_count {
        let name = columns.name().map_err(cut)?;
        let reason = name.parse();
        reasons.push(reason.map_err(|unknown| damaged(&format!("{name:?}: {unknown}")))?);
    }
    let seqs = i64s(&mut columns, rows)?;
    let t_boots = i64s(&mut columns, rows)?;
    let t_utcs = i64s(&mut columns, rows)?;
    let t_arrivals = i64s(&mut columns, rows)?;
    let arrivals = i64s(&mut columns, rows)?;
    let kinds = columns.take(rows).map_err(cut)?;
    let kinds_of = || kinds.iter().map(|kind| kind & 0x3F);
    let is_frame = |kind: &u8| matches!(*kind, KIND_FRAME | KIND_WITHOUT_THERMISTOR);
    let count = kinds_of().filter(is_frame).count();
    let thermistors = u16s(&mut columns, count)?;
    let residuals = u16s(&mut columns, count * PIXELS)?;
    if columns.left() > 0 {
        return Err(damaged("a segment with too many bytes"));
    }
    let mut frames = frames_of(&thermistors, &residuals).into_iter();
    let mut sealed = Vec::with_capacity(rows);
    for row in 0..rows {
        let reading = match kinds[row] & 0x3F {
            kind @ (KIND_FRAME | KIND_WITHOUT_THERMISTOR) => {
                let mut frame = frames.next().ok_or_else(|| damaged("too few frames"))?;
                if kind == KIND_WITHOUT_THERMISTOR {
                    frame.thermistor = None;
                }
                Reading::Frame(frame)
            }
            number => Reading::NoData(
                *reasons
                    .get(usize::from(number) - 1)
                    .ok_or_else(|| damaged("an unknown reason"))?,
            ),
        };
        sealed.push(SealedRow {
            record: Record {
                seq: unsigned("seq", seqs[row])?,
                stamp: Stamp {
                    t_boot_ns: unsigned("t_boot_ns", t_boots[row])?,
                    t_utc_ns: t_utcs[row],
                    clock: ClockState::from_code(kinds[row] >> 6)
                        .ok_or_else(|| damaged("an unknown clock state"))?,
                },
                reading,
            },
            t_arrival_ns: t_arrivals[row],
            arrival: arrivals[row],
        });
    }
    Ok(sealed)
}

fn frames_of(thermistors: &[u16], residuals: &[u16]) -> Vec<RecordedFrame> {
    let mut frames: Vec<RecordedFrame> = Vec::with_capacity(thermistors.len());
    let mut thermistor = 0_u16;
    for (change, residuals) in thermistors.iter().zip(residuals.chunks_exact(PIXELS)) {
        thermistor = thermistor.wrapping_add(*change);
        let before = &frames[frames.len().saturating_sub(MEAN_OF)..];
        let mut pixels = [PixelWord(0); PIXELS];
        for (pixel, (word, residual)) in pixels.iter_mut().zip(residuals).enumerate() {
            let predicted = mean(before.iter().map(|frame| frame.pixels[pixel]));
            word.0 = predicted.wrapping_add(*residual);
        }
        frames.push(RecordedFrame {
            thermistor: Some(ThermistorWord(thermistor)),
            pixels,
        });
    }
    frames
}
