//! How a segment is read, whatever is in it.

use super::layout::{
    ACCOUNT, Entry, FRAME, Fault, HEADER_BYTES, MAGIC, PAYLOAD_BYTES_MAX, PREFIX_BYTES, STREAM,
    VERSION, crc32c,
};
use grideye_frame::{PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::wire::Account;
use grideye_recording::{ClockState, Record, Stamp, StreamId, check_name};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Checks the header of the segment that is named by this number.
///
/// # Errors
/// [`Fault`] if it is no segment, one of another format, or another segment.
pub fn check_header(number: u64, bytes: &[u8]) -> Result<(), Fault> {
    let mut reader = Reader(bytes);
    if reader.take::<8>() != Some(MAGIC) {
        return Err(Fault::NoHeader);
    }
    let version = reader.u32().ok_or(Fault::NoHeader)?;
    let found = reader.u64().ok_or(Fault::NoHeader)?;
    let crc = reader.u32().ok_or(Fault::NoHeader)?;
    // The header keeps its form and its checksum in every version: so a later version is told from a damaged one.
    if crc32c(&[&bytes[..HEADER_BYTES - 4]]) != crc {
        return Err(Fault::NoHeader);
    }
    if version != VERSION {
        return Err(Fault::OtherVersion { found: version });
    }
    if found != number {
        return Err(Fault::OtherNumber { found });
    }
    Ok(())
}

/// The entries in the bytes of a segment, from a place where a record begins.
#[derive(Debug)]
pub struct Entries<'b> {
    number: u64,
    bytes: &'b [u8],
    at: usize,
    streams_declared: u16,
    has_failed: bool,
}

impl<'b> Entries<'b> {
    /// All entries of the segment of this number; `bytes` begin with its header.
    ///
    /// # Errors
    /// [`Fault`] if the header is not that of this segment.
    pub fn of_segment(number: u64, bytes: &'b [u8]) -> Result<Self, Fault> {
        check_header(number, bytes)?;
        Ok(Self::within(number, bytes, HEADER_BYTES, 0))
    }

    /// The entries from byte `at` on, where `streams_declared` streams have been declared before.
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
        let cut = Fault::Cut { offset };
        let damaged = Fault::Damaged { offset };
        let mut reader = Reader(self.bytes.get(offset..).unwrap_or_default());
        let length_bytes = reader.take::<4>().ok_or(cut.clone())?;
        let crc = reader.u32().ok_or(cut.clone())?;
        let length = usize::try_from(u32::from_le_bytes(length_bytes)).unwrap_or(usize::MAX);
        if length > PAYLOAD_BYTES_MAX {
            return Err(damaged);
        }
        let payload = reader.slice(length).ok_or(cut)?;
        if crc32c(&[&self.number.to_le_bytes(), &length_bytes, payload]) != crc {
            return Err(damaged);
        }
        let entry = decode(payload, self.streams_declared).ok_or(damaged)?;
        if matches!(entry, Entry::Stream { index, .. } if index == self.streams_declared) {
            self.streams_declared += 1;
        }
        self.at = offset + PREFIX_BYTES + length;
        Ok((self.at, entry))
    }
}

impl Iterator for Entries<'_> {
    /// Where the entry ends, and the entry.
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

/// What a payload says; `None` if it is none of ours, though its checksum is right.
fn decode(payload: &[u8], streams_declared: u16) -> Option<Entry> {
    let mut reader = Reader(payload);
    let [kind] = reader.take()?;
    let stream = reader.u16()?;
    let is_declared = stream < streams_declared;
    let entry = match kind {
        // Read from the middle, a segment may declare what its reader knows already.
        STREAM if stream <= streams_declared => {
            let (device, boot, sensor) = (reader.name()?, reader.name()?, reader.name()?);
            let id = StreamId {
                device,
                sensor,
                boot,
            };
            Entry::Stream {
                index: stream,
                id: Arc::new(id),
            }
        }
        FRAME if is_declared => Entry::Record {
            stream,
            record: reader.record()?,
        },
        ACCOUNT if is_declared => Entry::Account {
            stream,
            account: reader.account()?,
        },
        _ => return None,
    };
    reader.0.is_empty().then_some(entry)
}

struct Reader<'b>(&'b [u8]);

impl<'b> Reader<'b> {
    fn slice(&mut self, length: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(taken)
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.slice(N)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<&'b str> {
        let [length] = self.take()?;
        std::str::from_utf8(self.slice(length.into())?).ok()
    }

    fn name(&mut self) -> Option<String> {
        let name = self.text()?;
        check_name(name).ok()?;
        Some(name.to_owned())
    }

    fn record(&mut self) -> Option<Record> {
        let seq = self.u64()?;
        let stamp = Stamp {
            t_boot_ns: self.u64()?,
            t_utc_ns: self.take().map(i64::from_le_bytes)?,
            clock: self.take().and_then(|[code]| ClockState::from_code(code))?,
        };
        let reading = match self.take()? {
            [0] => Reading::Frame(self.frame()?),
            [1] => Reading::NoData(self.text()?.parse().ok()?),
            _ => return None,
        };
        Some(Record {
            seq,
            stamp,
            reading,
        })
    }

    fn frame(&mut self) -> Option<RawFrame> {
        let thermistor = ThermistorWord(self.u16()?);
        let mut pixels = [PixelWord(0); PIXELS];
        for pixel in &mut pixels {
            *pixel = PixelWord(self.u16()?);
        }
        Some(RawFrame { thermistor, pixels })
    }

    fn account(&mut self) -> Option<Account> {
        let (read, missing, spooled) = (self.u64()?, self.u64()?, self.u64()?);
        let (dropped, errors) = (self.counts()?, self.counts()?);
        Some(Account {
            read,
            missing,
            dropped,
            spooled,
            errors,
            ended: false,
        })
    }

    fn counts(&mut self) -> Option<BTreeMap<String, u64>> {
        let [kinds] = self.take()?;
        (0..kinds)
            .map(|_| Some((self.name()?, self.u64()?)))
            .collect()
    }
}
