//! Reads a segment, whatever it contains.

use super::layout::{
    ACCOUNT, Entry, FRAME, Fault, HEADER_BYTES, MAGIC, PAYLOAD_BYTES_MAX, PREFIX_BYTES, STREAM,
    VERSION, crc32c,
};
use grideye_recording::record::layout::{ByteReader, Form};
use grideye_recording::wire::Account;
use grideye_recording::{StreamId, check_name};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Checks the header of the segment with this number.
///
/// # Errors
/// [`Fault`] if it is no segment, has another format, or is another segment.
pub fn check_header(number: u64, bytes: &[u8]) -> Result<(), Fault> {
    let mut reader = ByteReader::new(bytes);
    let no_header = |_cut| Fault::NoHeader;
    if reader.array::<8>().map_err(no_header)? != MAGIC {
        return Err(Fault::NoHeader);
    }
    let version = u32::from_le_bytes(reader.array().map_err(no_header)?);
    let found = u64::from_le_bytes(reader.array().map_err(no_header)?);
    let crc = u32::from_le_bytes(reader.array().map_err(no_header)?);
    // The header has the same form and checksum in every version, which distinguishes a later version from a damaged
    // one.
    if crc32c(&[&bytes[..HEADER_BYTES - 4]]) != crc {
        return Err(Fault::NoHeader);
    }
    if version != VERSION {
        return Err(Fault::OtherVersion(version));
    }
    if found != number {
        return Err(Fault::OtherNumber(found));
    }
    Ok(())
}

/// The entries in a segment's bytes, from the start of any record.
#[derive(Debug)]
pub struct Entries<'b> {
    number: u64,
    bytes: &'b [u8],
    at: usize,
    streams_declared: u16,
    has_failed: bool,
}

impl<'b> Entries<'b> {
    /// All entries of the segment with this number; `bytes` start with its header.
    ///
    /// # Errors
    /// [`Fault`] if the header is not that of this segment.
    pub fn of_segment(number: u64, bytes: &'b [u8]) -> Result<Self, Fault> {
        check_header(number, bytes)?;
        Ok(Self::within(number, bytes, HEADER_BYTES, 0))
    }

    /// The entries from byte `at`, after `streams_declared` declarations.
    #[must_use]
    pub fn within(number: u64, bytes: &'b [u8], at: usize, streams_declared: u16) -> Self {
        Self {
            number,
            bytes,
            at,
            streams_declared,
            has_failed: false,
        }
    }

    fn entry(&mut self) -> Result<(usize, Entry), Fault> {
        let offset = self.at;
        let damaged = Fault::Damaged(offset);
        let mut reader = ByteReader::new(self.bytes.get(offset..).unwrap_or_default());
        let length_bytes = reader.array().map_err(|_cut| Fault::Cut(offset))?;
        let crc = u32::from_le_bytes(reader.array().map_err(|_cut| Fault::Cut(offset))?);
        let length = usize::try_from(u32::from_le_bytes(length_bytes)).unwrap_or(usize::MAX);
        if length > PAYLOAD_BYTES_MAX {
            return Err(damaged);
        }
        let payload = reader.take(length).map_err(|_cut| Fault::Cut(offset))?;
        if crc32c(&[&self.number.to_le_bytes(), &length_bytes, payload]) != crc {
            return Err(damaged);
        }
        let entry = decode(payload, self.streams_declared).ok_or(damaged)?;
        if matches!(entry, Entry::Stream(index, _) if index == self.streams_declared) {
            self.streams_declared += 1;
        }
        self.at = offset + PREFIX_BYTES + length;
        Ok((self.at, entry))
    }
}

impl Iterator for Entries<'_> {
    /// The end of the entry, and the entry.
    type Item = Result<(usize, Entry), Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.has_failed || self.at >= self.bytes.len() {
            return None;
        }
        let entry = self.entry();
        self.has_failed = entry.is_err();
        Some(entry)
    }
}

/// Decodes a payload; `None` for content that this program does not write, despite its right checksum.
fn decode(payload: &[u8], streams_declared: u16) -> Option<Entry> {
    let mut reader = ByteReader::new(payload);
    let [kind] = reader.array().ok()?;
    let stream = u16::from_le_bytes(reader.array().ok()?);
    let is_declared = stream < streams_declared;
    let entry = match kind {
        // A reader that starts in the middle may meet a declaration it already knows.
        STREAM if stream <= streams_declared => {
            let id = StreamId {
                device: name(&mut reader)?,
                boot: name(&mut reader)?,
                sensor: name(&mut reader)?,
            };
            Entry::Stream(stream, Arc::new(id))
        }
        FRAME if is_declared => Entry::Record(stream, reader.record(Form::Spool).ok()?),
        ACCOUNT if is_declared => Entry::Account(stream, account(&mut reader)?),
        _ => return None,
    };
    (reader.left() == 0).then_some(entry)
}

fn name(reader: &mut ByteReader<'_>) -> Option<String> {
    let name = reader.name().ok()?;
    check_name(name).ok()?;
    Some(name.to_owned())
}

fn number(reader: &mut ByteReader<'_>) -> Option<u64> {
    reader.array().ok().map(u64::from_le_bytes)
}

fn account(reader: &mut ByteReader<'_>) -> Option<Account> {
    Some(Account {
        read: number(reader)?,
        missing: number(reader)?,
        spooled: number(reader)?,
        dropped: counts(reader)?,
        errors: counts(reader)?,
        ended: false,
    })
}

fn counts(reader: &mut ByteReader<'_>) -> Option<BTreeMap<String, u64>> {
    let [kinds] = reader.array().ok()?;
    (0..kinds)
        .map(|_| Some((name(reader)?, number(reader)?)))
        .collect()
}
