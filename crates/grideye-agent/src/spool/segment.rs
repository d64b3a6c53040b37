//! The format of a segment: a header, then records, each with its length and checksum.
//!
//! ```text
//!   header  magic 8 | version u32 | number u64 | crc32c u32 of what stands before it
//!   record  length u32 of the payload | crc32c u32 of number, length and payload | payload
//!   payload 1  stream:  index u16, device, boot, sensor (each a length u8 and its bytes)
//!           2  frame:   index u16, seq u64, t_boot_ns u64, t_utc_ns i64, clock u8,
//!                       then 0 u8, thermistor u16, 64 pixels u16  or  1 u8, a reason (length u8 and its bytes)
//!           3  account: index u16, read u64, missing u64, spooled u64, dropped and errors (each a count u8, then name, u64)
//! ```
//!
//! All numbers are little-endian. A stream is declared before it is used, in each segment anew, so that a segment can be
//! read alone. The checksum takes in the segment's number: blocks of another file that show after a loss of power do
//! not pass. A file ends where its first record ends that is not whole; what stands behind it is not guessed at.

use grideye_frame::{PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use grideye_recording::wire::Account;
use grideye_recording::{ClockState, Record, Stamp, StreamId, check_name};
use std::collections::BTreeMap;
use std::sync::Arc;

/// How every segment begins. The line break shows what took it for text.
pub const MAGIC: [u8; 8] = *b"GEYESPL\n";
/// The version of the format that is written, and the only one that is read.
pub const VERSION: u32 = 1;
/// Bytes of the header.
pub const HEADER_BYTES: usize = 24;
/// The same, as an offset in a file.
pub(super) const HEADER_BYTES_U64: u64 = 24;
/// Bytes of a record's length and checksum.
const PREFIX_BYTES: usize = 8;
/// The longest payload: an account with 64 reasons and as many errors, all names of full length.
pub const PAYLOAD_BYTES_MAX: usize = 16 * 1024;
/// Bytes that one frame takes in a segment.
pub const FRAME_BYTES: usize = PREFIX_BYTES + 1 + 2 + 8 + 8 + 8 + 1 + 1 + 2 + 2 * PIXELS;
/// Reasons, and errors, of one account that are kept.
const COUNTS_MAX: usize = 64;

const STREAM: u8 = 1;
const FRAME: u8 = 2;
const ACCOUNT: u8 = 3;

/// What one record of a segment says.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// From here on, records of this index are of this stream.
    Stream {
        /// The index.
        index: u16,
        /// Whose.
        id: Arc<StreamId>,
    },
    /// A frame, or the reason why there is none.
    Record {
        /// The stream's index.
        stream: u16,
        /// The record.
        record: Record,
    },
    /// The agent's count of a stream as it was when the records behind it were written.
    Account {
        /// The stream's index.
        stream: u16,
        /// The count.
        account: Account,
    },
}

/// Why a segment, or the rest of it, cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The file is no segment, or its header is damaged.
    #[error("no header of a segment")]
    NoHeader,
    /// The file is a segment in another format.
    #[error("format {found}, and this version reads format {VERSION}")]
    OtherVersion {
        /// Its version.
        found: u32,
    },
    /// The file's name says another number than its header.
    #[error("the header says segment {found}")]
    OtherNumber {
        /// The header's number.
        found: u64,
    },
    /// The record at this offset is cut off.
    #[error("a record at byte {offset} is cut off")]
    Cut {
        /// Where it begins.
        offset: usize,
    },
    /// The record at this offset is not what was written.
    #[error("a record at byte {offset} is damaged")]
    Damaged {
        /// Where it begins.
        offset: usize,
    },
}

/// Writes the bytes of one segment.
#[derive(Debug, Clone)]
pub struct Encoder {
    number: u64,
    streams: Vec<Arc<StreamId>>,
}

impl Encoder {
    /// For the segment of this number; its streams are yet to be declared.
    #[must_use]
    pub fn new(number: u64) -> Self {
        Self {
            number,
            streams: Vec::new(),
        }
    }

    /// The header.
    #[must_use]
    pub fn header(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_BYTES);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(self.number.to_le_bytes());
        bytes.extend(crc32c(&[&bytes]).to_le_bytes());
        bytes
    }

    /// The streams declared so far, by index.
    #[must_use]
    pub fn streams(&self) -> &[Arc<StreamId>] {
        &self.streams
    }

    /// Appends a record, behind the declaration of its stream if that is new. Returns where the record itself begins in
    /// `bytes`, and its stream's index.
    pub fn record(
        &mut self,
        bytes: &mut Vec<u8>,
        id: &Arc<StreamId>,
        record: &Record,
    ) -> (usize, u16) {
        let stream = self.declare(bytes, id);
        let begin = bytes.len();
        self.push(bytes, &record_payload(stream, record));
        (begin, stream)
    }

    /// Appends an account, behind the declaration of its stream if that is new.
    pub fn account(&mut self, bytes: &mut Vec<u8>, id: &Arc<StreamId>, account: &Account) {
        let stream = self.declare(bytes, id);
        self.push(bytes, &account_payload(stream, account));
    }

    fn declare(&mut self, bytes: &mut Vec<u8>, id: &Arc<StreamId>) -> u16 {
        let known = self.streams.iter().position(|known| known == id);
        let index = known.unwrap_or(self.streams.len());
        let short = u16::try_from(index).unwrap_or(u16::MAX);
        if known.is_none() {
            self.streams.push(Arc::clone(id));
            let mut payload = vec![STREAM];
            payload.extend(short.to_le_bytes());
            for name in [&id.device, &id.boot, &id.sensor] {
                push_name(&mut payload, name);
            }
            self.push(bytes, &payload);
        }
        short
    }

    fn push(&self, bytes: &mut Vec<u8>, payload: &[u8]) {
        let length = u32::try_from(payload.len())
            .unwrap_or(u32::MAX)
            .to_le_bytes();
        let crc = crc32c(&[&self.number.to_le_bytes(), &length, payload]);
        bytes.extend(length);
        bytes.extend(crc.to_le_bytes());
        bytes.extend(payload);
    }
}

/// Checks the header of the segment that is named by this number.
///
/// # Errors
/// [`Fault`] if it is no segment, one of another format, or another segment.
pub fn check_header(number: u64, bytes: &[u8]) -> Result<(), Fault> {
    let mut reader = Reader(bytes);
    if reader.take::<8>() != Some(MAGIC) {
        return Err(Fault::NoHeader);
    }
    // A later format may have a longer header and another checksum, so the version is looked at first.
    let version = reader.u32().ok_or(Fault::NoHeader)?;
    if version != VERSION {
        return Err(Fault::OtherVersion { found: version });
    }
    let found = reader.u64().ok_or(Fault::NoHeader)?;
    let crc = reader.u32().ok_or(Fault::NoHeader)?;
    if crc32c(&[&bytes[..HEADER_BYTES - 4]]) != crc {
        return Err(Fault::NoHeader);
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

/// CRC-32C (Castagnoli, RFC 3720 appendix B.4) of some pieces of bytes in a row.
#[must_use]
pub fn crc32c(pieces: &[&[u8]]) -> u32 {
    let mut crc = u32::MAX;
    for byte in pieces.iter().copied().flatten() {
        let [low, ..] = crc.to_le_bytes();
        crc = (crc >> 8) ^ CRC_TABLE[usize::from(low ^ byte)];
    }
    !crc
}

const CRC_TABLE: [u32; 256] = crc_table();

const fn crc_table() -> [u32; 256] {
    /// The polynomial 0x1EDC6F41 with its bits in reverse order.
    const POLYNOMIAL: u32 = 0x82F6_3B78;
    let mut table = [0; 256];
    let mut index = 0;
    let mut byte: u32 = 0;
    while index < 256 {
        let mut crc = byte;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 {
                (crc >> 1) ^ POLYNOMIAL
            } else {
                crc >> 1
            };
            bit += 1;
        }
        table[index] = crc;
        index += 1;
        byte += 1;
    }
    table
}

fn record_payload(stream: u16, record: &Record) -> Vec<u8> {
    let mut payload = Vec::with_capacity(FRAME_BYTES);
    payload.push(FRAME);
    payload.extend(stream.to_le_bytes());
    payload.extend(record.seq.to_le_bytes());
    payload.extend(record.stamp.t_boot_ns.to_le_bytes());
    payload.extend(record.stamp.t_utc_ns.to_le_bytes());
    payload.push(match record.stamp.clock {
        ClockState::Unsynced => 0,
        ClockState::Synced => 1,
        ClockState::Stepped => 2,
    });
    match &record.reading {
        Reading::Frame(raw) => {
            payload.push(0);
            payload.extend(raw.thermistor.0.to_le_bytes());
            payload.extend(raw.pixels.iter().flat_map(|pixel| pixel.0.to_le_bytes()));
        }
        Reading::NoData(reason) => {
            payload.push(1);
            push_name(&mut payload, reason.name());
        }
    }
    payload
}

fn account_payload(stream: u16, account: &Account) -> Vec<u8> {
    let mut payload = vec![ACCOUNT];
    payload.extend(stream.to_le_bytes());
    for count in [account.read, account.missing, account.spooled] {
        payload.extend(count.to_le_bytes());
    }
    for counts in [&account.dropped, &account.errors] {
        let kept = counts.len().min(COUNTS_MAX);
        payload.push(u8::try_from(kept).unwrap_or(u8::MAX));
        for (name, count) in counts.iter().take(kept) {
            push_name(&mut payload, name);
            payload.extend(count.to_le_bytes());
        }
    }
    payload
}

/// Names have at most 64 characters of ASCII.
fn push_name(payload: &mut Vec<u8>, name: &str) {
    let kept = name
        .as_bytes()
        .get(..usize::from(u8::MAX))
        .unwrap_or(name.as_bytes());
    payload.push(u8::try_from(kept.len()).unwrap_or(u8::MAX));
    payload.extend(kept);
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
            clock: match self.take()? {
                [0] => ClockState::Unsynced,
                [1] => ClockState::Synced,
                [2] => ClockState::Stepped,
                _ => return None,
            },
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

#[cfg(test)]
mod tests {
    use super::*;
    use grideye_frame::NoData;
    use proptest::prelude::*;

    fn id(boot: &str) -> Arc<StreamId> {
        Arc::new(StreamId {
            device: "pi-1".to_owned(),
            sensor: "i2c-1:0x69".to_owned(),
            boot: boot.to_owned(),
        })
    }

    fn any_record() -> impl Strategy<Value = Record> {
        let clock = prop::sample::select(ClockState::ALL.to_vec());
        let missing = prop::sample::select(NoData::ALL.to_vec());
        let pixels = prop::collection::vec(any::<u16>(), PIXELS);
        let frame = (any::<u16>(), pixels).prop_map(|(thermistor, pixels)| {
            let mut words = [PixelWord(0); PIXELS];
            words
                .iter_mut()
                .zip(pixels)
                .for_each(|(word, pixel)| *word = PixelWord(pixel));
            Reading::Frame(RawFrame {
                thermistor: ThermistorWord(thermistor),
                pixels: words,
            })
        });
        let reading = prop_oneof![frame, missing.prop_map(Reading::NoData)];
        (any::<u64>(), any::<u64>(), any::<i64>(), clock, reading).prop_map(
            |(seq, t_boot_ns, t_utc_ns, clock, reading)| Record {
                seq,
                stamp: Stamp {
                    t_boot_ns,
                    t_utc_ns,
                    clock,
                },
                reading,
            },
        )
    }

    fn any_account() -> impl Strategy<Value = Account> {
        let counts = || prop::collection::btree_map("[a-z][a-z-]{0,20}", any::<u64>(), 0..5);
        (any::<u64>(), any::<u64>(), any::<u64>(), counts(), counts()).prop_map(
            |(read, missing, spooled, dropped, errors)| Account {
                read,
                missing,
                spooled,
                dropped,
                errors,
                ended: false,
            },
        )
    }

    fn read_all(number: u64, bytes: &[u8]) -> (Vec<Entry>, Option<Fault>) {
        let mut entries = Vec::new();
        for entry in Entries::of_segment(number, bytes).unwrap() {
            match entry {
                Ok((_, entry)) => entries.push(entry),
                Err(fault) => return (entries, Some(fault)),
            }
        }
        (entries, None)
    }

    #[test]
    fn the_checksum_is_crc32c() {
        // RFC 3720 appendix B.4, and the check value of the CRC catalogue.
        assert_eq!(crc32c(&[b"123456789"]), 0xE306_9283);
        assert_eq!(crc32c(&[b"12345", b"6789"]), 0xE306_9283);
        assert_eq!(crc32c(&[&[0; 32]]), 0x8A91_36AA);
        assert_eq!(crc32c(&[&[0xFF; 32]]), 0x62A8_AB43);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_and_a_cut_loses_only_what_is_behind_it(
            records in prop::collection::vec((0..3_usize, any_record()), 1..20),
            account in any_account(),
            cut in 0.0..1.0_f64,
        ) {
            let ids = ["b1", "b2", "b3"].map(id);
            let mut encoder = Encoder::new(7);
            let mut bytes = encoder.header();
            encoder.account(&mut bytes, &ids[0], &account);
            let mut ends = Vec::new();
            for (stream, record) in &records {
                let (begin, _) = encoder.record(&mut bytes, &ids[*stream], record);
                let is_frame = record.reading.frame().is_some();
                prop_assert!(!is_frame || bytes.len() - begin == FRAME_BYTES);
                ends.push(bytes.len());
            }
            let (entries, fault) = read_all(7, &bytes);
            prop_assert_eq!(fault, None);
            let mut streams: Vec<Arc<StreamId>> = Vec::new();
            let mut read = Vec::new();
            for entry in entries {
                match entry {
                    Entry::Stream { id, .. } => streams.push(id),
                    Entry::Record { stream, record } => read.push((Arc::clone(&streams[usize::from(stream)]), record)),
                    Entry::Account { account: read, .. } => prop_assert_eq!(&read, &account),
                }
            }
            let expected: Vec<_> = records.iter().map(|(stream, record)| (Arc::clone(&ids[*stream]), *record)).collect();
            prop_assert_eq!(read, expected);

            let span = bytes.len() - HEADER_BYTES;
            #[expect(clippy::as_conversions, clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a place within a short file")]
            let cut = HEADER_BYTES + (cut * span as f64) as usize;
            let (entries, _) = read_all(7, &bytes[..cut]);
            let left = entries.iter().filter(|entry| matches!(entry, Entry::Record { .. })).count();
            prop_assert_eq!(left, ends.iter().filter(|end| **end <= cut).count());
        }

        #[test]
        fn a_flipped_bit_is_found_and_nothing_behind_it_is_believed(
            records in prop::collection::vec(any_record(), 2..8),
            place in 0.0..1.0_f64,
            bit in 0..8_u32,
        ) {
            let mut encoder = Encoder::new(1);
            let mut bytes = encoder.header();
            let mut begins = Vec::new();
            for record in &records {
                begins.push(encoder.record(&mut bytes, &id("b"), record).0);
            }
            let span = bytes.len() - HEADER_BYTES;
            #[expect(clippy::as_conversions, clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a place within a short file")]
            let place = HEADER_BYTES + (place * span as f64) as usize;
            bytes[place] ^= 1 << bit;
            let (entries, fault) = read_all(1, &bytes);
            prop_assert!(fault.is_some());
            let read: Vec<Record> = entries.iter().filter_map(|entry| match entry {
                Entry::Record { record, .. } => Some(*record),
                _ => None,
            }).collect();
            let whole = begins.iter().skip(1).filter(|begin| **begin <= place).count();
            prop_assert_eq!(read.as_slice(), &records[..whole]);
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), declared in 0..4_u16) {
            let _ = Entries::of_segment(1, &bytes).map(Iterator::count);
            let _ = Entries::within(1, &bytes, 0, declared).count();
        }
    }

    #[test]
    fn a_header_that_is_not_this_segments_is_told_apart() {
        let header = Encoder::new(5).header();
        assert_eq!(header.len(), HEADER_BYTES);
        assert_eq!(check_header(5, &header), Ok(()));
        assert_eq!(
            check_header(6, &header),
            Err(Fault::OtherNumber { found: 5 })
        );
        for cut in 0..HEADER_BYTES {
            assert_eq!(
                check_header(5, &header[..cut]),
                Err(Fault::NoHeader),
                "{cut}"
            );
        }
        let mut newer = header.clone();
        newer[8] = 2;
        assert_eq!(
            check_header(5, &newer),
            Err(Fault::OtherVersion { found: 2 })
        );
        let mut damaged = header;
        damaged[13] ^= 1;
        assert_eq!(check_header(5, &damaged), Err(Fault::NoHeader));
    }

    #[test]
    fn a_record_of_another_segment_does_not_pass() {
        let record = Record {
            seq: 1,
            stamp: Stamp {
                t_boot_ns: 1,
                t_utc_ns: 1,
                clock: ClockState::Synced,
            },
            reading: Reading::NoData(NoData::Nack),
        };
        let mut stale = Vec::new();
        Encoder::new(4).record(&mut stale, &id("b"), &record);
        let mut bytes = Encoder::new(5).header();
        bytes.extend(stale);
        assert_eq!(
            read_all(5, &bytes),
            (
                vec![],
                Some(Fault::Damaged {
                    offset: HEADER_BYTES
                })
            )
        );
    }

    #[test]
    fn a_record_of_a_stream_that_was_never_declared_or_a_length_beyond_the_limit_is_damage() {
        let mut encoder = Encoder::new(5);
        let mut bytes = encoder.header();
        encoder.push(&mut bytes, &[ACCOUNT, 0, 0]);
        assert!(matches!(read_all(5, &bytes).1, Some(Fault::Damaged { .. })));
        let mut bytes = encoder.header();
        encoder.push(&mut bytes, &vec![STREAM; PAYLOAD_BYTES_MAX + 1]);
        assert!(matches!(read_all(5, &bytes).1, Some(Fault::Damaged { .. })));
        let mut bytes = encoder.header();
        encoder.declare(&mut bytes, &id("b"));
        let declared = bytes.len();
        encoder.push(&mut bytes, &[FRAME, 0, 0, 9]);
        assert_eq!(
            read_all(5, &bytes).1,
            Some(Fault::Damaged { offset: declared })
        );
    }
}
