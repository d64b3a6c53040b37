//! The same batch as bytes: about a quarter as long as JSON, and read without a parser.
//!
//! `README.md` of this crate specifies the layout.

use crate::packed;
use crate::record::{ClockState, Record, Stamp};
use crate::text::quoted;
use crate::wire::error::WireError;
use crate::wire::types::{Account, Batch, Limits, SensorBatch};
use grideye_frame::NAME_CHARS_MAX;
use grideye_frame::{NoData, PIXELS, PixelWord, RawFrame, Reading, ThermistorWord};
use std::collections::BTreeMap;

/// What a body begins with: a mark, and the version of the layout.
const MAGIC: [u8; 3] = *b"GEB";
const VERSION: u8 = 2;
/// The layout before, which is read and no longer written: its 64 words are not packed.
const VERSION_PLAIN: u8 = 1;
/// The bytes of a frame's 64 words in the plain layout.
const PIXELS_BYTES: usize = 2 * PIXELS;
/// Bytes of a frame with pixels, without these, and with them at the most.
const FRAME_HEAD_BYTES: usize = 3 * 8 + 1 + 2;
const FRAME_BYTES_MAX: usize = FRAME_HEAD_BYTES + packed::BYTES_MAX;
/// A count of 64 bits in groups of 7.
const COUNT_BYTES_MAX: usize = 10;

const KIND_FRAME: u8 = 0;
const KIND_MISSING: u8 = 1;

const ACCOUNT_NONE: u8 = 0;
const ACCOUNT_OF_RUN: u8 = 1;
const ACCOUNT_OF_ENDED_RUN: u8 = 2;

pub(super) fn encode(batch: &Batch, body: &mut Vec<u8>) {
    let frames: usize = batch.sensors.iter().map(|sensor| sensor.frames.len()).sum();
    body.reserve(256 * (1 + batch.sensors.len()) + FRAME_BYTES_MAX * frames);
    body.extend_from_slice(&MAGIC);
    body.push(VERSION);
    put_name(body, &batch.device);
    put_name(body, &batch.boot);
    body.push(u8::from(batch.t_sent_boot_ns.is_some()));
    if let Some(sent) = batch.t_sent_boot_ns {
        body.extend_from_slice(&sent.to_le_bytes());
    }
    put_length(body, batch.sensors.len());
    for sensor in &batch.sensors {
        put_name(body, &sensor.sensor);
        body.push(match &sensor.account {
            None => ACCOUNT_NONE,
            Some(account) if account.ended => ACCOUNT_OF_ENDED_RUN,
            Some(_) => ACCOUNT_OF_RUN,
        });
        if let Some(account) = &sensor.account {
            put_account(body, account);
        }
        put_length(body, sensor.frames.len());
        for record in &sensor.frames {
            put_record(body, record);
        }
    }
}

fn put_account(body: &mut Vec<u8>, account: &Account) {
    put_count(body, account.read);
    put_count(body, account.missing);
    put_count(body, account.spooled);
    for counts in [&account.dropped, &account.errors] {
        put_length(body, counts.len());
        for (name, count) in counts {
            put_name(body, name);
            put_count(body, *count);
        }
    }
}

fn put_record(body: &mut Vec<u8>, record: &Record) {
    body.extend_from_slice(&record.seq.to_le_bytes());
    body.extend_from_slice(&record.stamp.t_boot_ns.to_le_bytes());
    body.extend_from_slice(&record.stamp.t_utc_ns.to_le_bytes());
    let clock = record.stamp.clock.code();
    match &record.reading {
        Reading::Frame(raw) => {
            body.push(clock << 4 | KIND_FRAME);
            body.extend_from_slice(&raw.thermistor.0.to_le_bytes());
            packed::put(body, &raw.pixels);
        }
        Reading::NoData(reason) => {
            body.push(clock << 4 | KIND_MISSING);
            put_name(body, reason.name());
        }
    }
}

/// Names were checked to be short.
fn put_name(body: &mut Vec<u8>, name: &str) {
    body.push(u8::try_from(name.len()).unwrap_or(u8::MAX));
    body.extend_from_slice(name.as_bytes());
}

fn put_length(body: &mut Vec<u8>, length: usize) {
    put_count(body, u64::try_from(length).unwrap_or(u64::MAX));
}

/// Groups of 7 bits, lowest first; the eighth bit says that another group follows (LEB128).
fn put_count(body: &mut Vec<u8>, mut count: u64) {
    loop {
        let group = count.to_le_bytes()[0] & 0x7F;
        count >>= 7;
        if count == 0 {
            body.push(group);
            return;
        }
        body.push(group | 0x80);
    }
}

pub(super) fn decode(body: &[u8], limits: &Limits) -> Result<Batch, WireError> {
    let mut reader = Reader::new(body);
    reader.magic()?;
    let device = reader.name(|| "device".to_owned())?;
    let boot = reader.name(|| "boot".to_owned())?;
    let t_sent_boot_ns = match reader.flag(|| "t_sent_boot_ns".to_owned())? {
        true => Some(u64::from_le_bytes(
            reader.array(|| "t_sent_boot_ns".to_owned())?,
        )),
        false => None,
    };
    let count = reader.count(|| "sensors".to_owned())?;
    let count = within(count, limits.sensors, "sensors", || "sensors".to_owned())?;
    let mut frames_left = limits.frames;
    let mut sensors = Vec::new();
    for index in 0..count {
        sensors.push(sensor(&mut reader, index, limits, &mut frames_left)?);
    }
    if reader.at != body.len() {
        let found = format!("{} more bytes", body.len() - reader.at);
        return Err(reader.malformed("body".to_owned(), "the end of the body", found));
    }
    Ok(Batch {
        device,
        boot,
        t_sent_boot_ns,
        sensors,
    })
}

fn sensor(
    reader: &mut Reader<'_>,
    index: usize,
    limits: &Limits,
    frames_left: &mut usize,
) -> Result<SensorBatch, WireError> {
    let path = |field: &str| format!("sensors[{index}].{field}");
    let sensor = reader.name(|| path("sensor"))?;
    let at = reader.at;
    let account = match reader.array(|| path("account"))? {
        [ACCOUNT_NONE] => None,
        [ACCOUNT_OF_RUN] => Some(account(reader, limits, false, || path("account"))?),
        [ACCOUNT_OF_ENDED_RUN] => Some(account(reader, limits, true, || path("account"))?),
        [other] => return Err(wrong_byte(path("account"), at, "0 to 2", other)),
    };
    let count = reader.count(|| path("frames"))?;
    let count = match usize::try_from(count) {
        Ok(count) if count <= *frames_left => count,
        _ => {
            return Err(WireError::TooMany {
                path: path("frames"),
                limit: format!("{} frames in all", limits.frames),
            });
        }
    };
    *frames_left -= count;
    let mut frames = Vec::with_capacity(count);
    for frame in 0..count {
        frames.push(record(reader, || {
            format!("sensors[{index}].frames[{frame}]")
        })?);
    }
    Ok(SensorBatch {
        sensor,
        account,
        frames,
    })
}

fn account(
    reader: &mut Reader<'_>,
    limits: &Limits,
    ended: bool,
    path: impl Fn() -> String,
) -> Result<Account, WireError> {
    let field = |name: &str| format!("{}.{name}", path());
    Ok(Account {
        read: reader.count(|| field("read"))?,
        missing: reader.count(|| field("missing"))?,
        spooled: reader.count(|| field("spooled"))?,
        dropped: counts(reader, limits, || field("dropped"))?,
        errors: counts(reader, limits, || field("errors"))?,
        ended,
    })
}

fn counts(
    reader: &mut Reader<'_>,
    limits: &Limits,
    path: impl Fn() -> String,
) -> Result<BTreeMap<String, u64>, WireError> {
    let length = reader.count(&path)?;
    let length = within(length, limits.reasons, "reasons", &path)?;
    let mut counts = BTreeMap::new();
    for _ in 0..length {
        let name = reader.name(|| format!("{}, a key", path()))?;
        let count = reader.count(|| format!("{}.{name}", path()))?;
        if counts.contains_key(&name) {
            return Err(WireError::Repeated {
                path: format!("{}.{name}", path()),
            });
        }
        counts.insert(name, count);
    }
    Ok(counts)
}

#[inline]
fn record(reader: &mut Reader<'_>, path: impl Fn() -> String) -> Result<Record, WireError> {
    let field = |name: &str| format!("{}.{name}", path());
    let seq = u64::from_le_bytes(reader.array(|| field("seq"))?);
    let t_boot_ns = u64::from_le_bytes(reader.array(|| field("t_boot_ns"))?);
    let t_utc_ns = i64::from_le_bytes(reader.array(|| field("t_utc_ns"))?);
    let at = reader.at;
    let [kind] = reader.array(|| field("clock"))?;
    let Some(clock) = ClockState::from_code(kind >> 4) else {
        return Err(wrong_byte(field("clock"), at, "a clock of 0 to 2", kind));
    };
    let reading = match kind & 0x0F {
        KIND_FRAME => {
            let thermistor = reader.array(|| field("thermistor_raw"))?;
            Reading::Frame(RawFrame {
                thermistor: ThermistorWord(u16::from_le_bytes(thermistor)),
                pixels: reader.pixels(|| field("pixels_raw"))?,
            })
        }
        KIND_MISSING => {
            let name = reader.name(|| field("missing"))?;
            let reason = name.parse::<NoData>();
            Reading::NoData(reason.map_err(|_unknown| WireError::WrongValue {
                path: field("missing"),
                expected: "the name of a reason why there is no frame".to_owned(),
                found: quoted(&name),
            })?)
        }
        _ => return Err(wrong_byte(path(), at, "a kind of 0 or 1", kind)),
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

fn within(
    count: u64,
    limit: usize,
    of: &str,
    path: impl Fn() -> String,
) -> Result<usize, WireError> {
    usize::try_from(count)
        .ok()
        .filter(|count| *count <= limit)
        .ok_or_else(|| WireError::TooMany {
            path: path(),
            limit: format!("{limit} {of}"),
        })
}

fn wrong_byte(path: String, offset: usize, expected: &str, byte: u8) -> WireError {
    WireError::Malformed {
        path,
        offset,
        expected: expected.to_owned(),
        found: format!("the byte 0x{byte:02X}"),
    }
}

/// The body, and how far it is read.
struct Reader<'b> {
    body: &'b [u8],
    at: usize,
    is_plain: bool,
}

impl<'b> Reader<'b> {
    const fn new(body: &'b [u8]) -> Self {
        Self {
            body,
            at: 0,
            is_plain: false,
        }
    }

    fn magic(&mut self) -> Result<(), WireError> {
        let found: [u8; 3] = self.array(|| "body".to_owned())?;
        if found != MAGIC {
            self.at = 0;
            let found = format!("{:02X} {:02X} {:02X}", found[0], found[1], found[2]);
            return Err(self.malformed("body".to_owned(), "the bytes 47 45 42", found));
        }
        match self.array(|| "version".to_owned())? {
            [VERSION] => Ok(()),
            [VERSION_PLAIN] => {
                self.is_plain = true;
                Ok(())
            }
            [other] => Err(WireError::WrongValue {
                path: "version".to_owned(),
                expected: format!("{VERSION_PLAIN} or {VERSION}"),
                found: other.to_string(),
            }),
        }
    }

    #[inline]
    fn pixels(&mut self, path: impl Fn() -> String) -> Result<[PixelWord; PIXELS], WireError> {
        if self.is_plain {
            let bytes: [u8; PIXELS_BYTES] = self.array(path)?;
            let mut pixels = [PixelWord(0); PIXELS];
            for (word, pair) in pixels.iter_mut().zip(bytes.chunks_exact(2)) {
                *word = PixelWord(u16::from_le_bytes([pair[0], pair[1]]));
            }
            return Ok(pixels);
        }
        let rest = self.body.get(self.at..).unwrap_or_default();
        let Some((pixels, length)) = packed::take(rest) else {
            let expected = "64 words, as the lowest, a width of at most 16 bits and no wider than needed, and 8 bytes for each bit";
            let found = format!("something else, {} bytes before the end", rest.len());
            return Err(self.malformed(path(), expected, found));
        };
        self.at += length;
        Ok(pixels)
    }

    #[inline]
    fn take(&mut self, length: usize, path: impl Fn() -> String) -> Result<&'b [u8], WireError> {
        let end = self.at.checked_add(length);
        if let Some(taken) = end.and_then(|end| self.body.get(self.at..end)) {
            self.at += length;
            return Ok(taken);
        }
        let found = format!("{} before the end", self.body.len() - self.at);
        Err(self.malformed(path(), &format!("{length} bytes"), found))
    }

    #[inline]
    fn array<const N: usize>(&mut self, path: impl Fn() -> String) -> Result<[u8; N], WireError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, path)?);
        Ok(array)
    }

    fn flag(&mut self, path: impl Fn() -> String) -> Result<bool, WireError> {
        let at = self.at;
        match self.array(&path)? {
            [0] => Ok(false),
            [1] => Ok(true),
            [other] => Err(wrong_byte(path(), at, "0 or 1", other)),
        }
    }

    fn count(&mut self, path: impl Fn() -> String) -> Result<u64, WireError> {
        let from = self.at;
        let mut count = 0_u64;
        for group in 0..COUNT_BYTES_MAX {
            let [byte] = self.array(&path)?;
            let bits = u64::from(byte & 0x7F);
            let shifted = bits << (7 * group);
            if shifted >> (7 * group) != bits {
                break;
            }
            count |= shifted;
            if byte & 0x80 == 0 {
                // One way to write a number: no empty last group.
                if byte == 0 && group > 0 {
                    break;
                }
                return Ok(count);
            }
        }
        self.at = from;
        let found = "a longer one, or one with an empty last group".to_owned();
        Err(self.malformed(path(), "a count of 64 bits", found))
    }

    fn name(&mut self, path: impl Fn() -> String) -> Result<String, WireError> {
        let at = self.at;
        let [length] = self.array(&path)?;
        if usize::from(length) > NAME_CHARS_MAX {
            let expected = format!("a length of at most {NAME_CHARS_MAX}");
            return Err(wrong_byte(path(), at, &expected, length));
        }
        let bytes = self.take(length.into(), &path)?;
        match std::str::from_utf8(bytes) {
            Ok(name) => Ok(name.to_owned()),
            Err(_not_text) => {
                self.at = at;
                Err(self.malformed(path(), "a name", "bytes that are no text".to_owned()))
            }
        }
    }

    fn malformed(&self, path: String, expected: &str, found: String) -> WireError {
        WireError::Malformed {
            path,
            offset: self.at,
            expected: expected.to_owned(),
            found,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_written_in_one_way_only() {
        for count in [0, 1, 127, 128, 16_383, 16_384, u64::MAX - 1, u64::MAX] {
            let mut body = Vec::new();
            put_count(&mut body, count);
            let mut reader = Reader::new(&body);
            assert_eq!(reader.count(String::new), Ok(count));
            assert_eq!(reader.at, body.len());
        }
        let too_long: &[&[u8]] = &[
            &[0x80, 0x00],
            &[0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x02],
            &[0x80; 11],
        ];
        for body in too_long {
            let mut reader = Reader::new(body);
            reader.count(String::new).unwrap_err();
        }
    }

    #[test]
    fn a_frame_has_as_many_bytes_as_stated() {
        let of_width = |width: usize| FRAME_HEAD_BYTES + 3 + 8 * width;
        assert_eq!((of_width(4), of_width(6)), (62, 78));
        assert_eq!((of_width(16), FRAME_BYTES_MAX), (158, 158));
    }
}
