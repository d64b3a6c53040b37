//! The one binary layout of a record, for wire, spool and store; little-endian.
//!
//! | part | bytes |
//! |---|---|
//! | number | 8; absent in a chunk, whose rows are numbered consecutively |
//! | `t_boot_ns`, `t_utc_ns` | 8 each, the last one signed |
//! | clock, kind | 1: the clock in the upper 4 bits, the kind in the lower; 1 each in a spool |
//! | a frame | thermistor, 2, unless the kind is 3; its 64 words packed (`packed.rs`), or 2 each in a spool |
//! | a missing one | the reason as a name: 1 for its length, then its text |
//!
//! A played recording also starts with the first two parts; old rows of a store are columns (`grideye-collector`'s
//! segments).

use super::packed;
pub use super::packed::BYTES_MAX as PACKED_BYTES_MAX;
use super::types::{ClockState, Record, Stamp};
use crate::text::quoted;
use grideye_frame::{
    NAME_CHARS_MAX, NoData, PIXELS, PixelWord, Reading, RecordedFrame, ThermistorWord,
};

/// Bytes of 64 unpacked words.
pub const WORDS_BYTES: usize = 2 * PIXELS;

const MISSING: u8 = 1;
/// A frame whose thermistor is not known.
const WITHOUT_THERMISTOR: u8 = 3;

/// The container of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A batch on the wire.
    Wire,
    /// A segment of the agent's spool.
    Spool,
    /// A chunk of the collector's store.
    Chunk,
}

impl Form {
    const fn frame(self) -> u8 {
        match self {
            Self::Wire | Self::Spool => 0,
            Self::Chunk => 2,
        }
    }
}

/// Appends a record.
pub fn put(bytes: &mut Vec<u8>, record: &Record, form: Form) {
    match form {
        Form::Wire | Form::Spool => put_number_and_times(bytes, record),
        Form::Chunk => put_times(bytes, &record.stamp),
    }
    let kind = match &record.reading {
        Reading::Frame(raw) if raw.thermistor.is_none() => WITHOUT_THERMISTOR,
        Reading::Frame(_) => form.frame(),
        Reading::NoData(_) => MISSING,
    };
    let clock = record.stamp.clock.code();
    match form {
        Form::Spool => bytes.extend_from_slice(&[clock, kind]),
        Form::Wire | Form::Chunk => bytes.push(clock << 4 | kind),
    }
    match &record.reading {
        Reading::NoData(reason) => put_name(bytes, reason.name()),
        Reading::Frame(raw) => {
            if let Some(thermistor) = raw.thermistor {
                bytes.extend_from_slice(&thermistor.0.to_le_bytes());
            }
            match form {
                Form::Spool => bytes.extend_from_slice(&words_to_bytes(&raw.pixels)),
                Form::Wire | Form::Chunk => packed::put(bytes, &raw.pixels),
            }
        }
    }
}

/// Appends a record's number, boot time and wall time.
pub fn put_number_and_times(bytes: &mut Vec<u8>, record: &Record) {
    bytes.extend_from_slice(&record.seq.to_le_bytes());
    put_times(bytes, &record.stamp);
}

fn put_times(bytes: &mut Vec<u8>, stamp: &Stamp) {
    bytes.extend_from_slice(&stamp.t_boot_ns.to_le_bytes());
    bytes.extend_from_slice(&stamp.t_utc_ns.to_le_bytes());
}

/// Appends a name, cut at 255 bytes.
pub fn put_name(bytes: &mut Vec<u8>, name: &str) {
    let length = u8::try_from(name.len()).unwrap_or(u8::MAX);
    bytes.push(length);
    bytes.extend_from_slice(&name.as_bytes()[..length.into()]);
}

/// 64 words as 2 bytes each.
#[must_use]
pub fn words_to_bytes(words: &[PixelWord; PIXELS]) -> [u8; WORDS_BYTES] {
    let mut bytes = [0; WORDS_BYTES];
    for (pair, word) in bytes.chunks_exact_mut(2).zip(words) {
        pair.copy_from_slice(&word.0.to_le_bytes());
    }
    bytes
}

/// The inverse of [`words_to_bytes`].
#[must_use]
pub fn words_of(bytes: &[u8; WORDS_BYTES]) -> [PixelWord; PIXELS] {
    let word = |pixel: usize| u16::from_le_bytes([bytes[2 * pixel], bytes[2 * pixel + 1]]);
    std::array::from_fn(|pixel| PixelWord(word(pixel)))
}

/// A fault in some bytes.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{field}: expected {expected}, found {found}")]
pub struct Fault {
    /// The record's field, as named in JSON; empty if it is not a field.
    pub field: &'static str,
    /// Its offset from 0; `None` if the bytes are well-formed but their value is wrong.
    pub offset: Option<usize>,
    /// What belongs there.
    pub expected: String,
    /// What is there.
    pub found: String,
}

impl Fault {
    /// A fault at an offset: what belongs there, and the byte found.
    pub fn byte(offset: usize, expected: impl Into<String>, byte: u8) -> Self {
        Self {
            field: "",
            offset: Some(offset),
            expected: expected.into(),
            found: format!("the byte 0x{byte:02X}"),
        }
    }

    const fn of(mut self, field: &'static str) -> Self {
        self.field = field;
        self
    }
}

/// Reads bytes from the front.
#[derive(Debug, Clone)]
pub struct ByteReader<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl<'b> ByteReader<'b> {
    /// From the first byte.
    #[must_use]
    pub const fn new(bytes: &'b [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Bytes read.
    #[must_use]
    pub const fn at(&self) -> usize {
        self.at
    }

    /// Bytes left.
    #[must_use]
    pub const fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Takes this many bytes.
    ///
    /// # Errors
    /// [`Fault`] if there are fewer.
    #[inline]
    pub fn take(&mut self, length: usize) -> Result<&'b [u8], Fault> {
        let end = self.at.checked_add(length);
        let Some(taken) = end.and_then(|end| self.bytes.get(self.at..end)) else {
            let found = format!("{} before the end", self.left());
            return Err(self.fault(format!("{length} bytes"), found));
        };
        self.at += length;
        Ok(taken)
    }

    /// Takes the next bytes as an array.
    ///
    /// # Errors
    /// [`Fault`] if there are fewer.
    #[inline]
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    /// Takes a name written by [`put_name`], without checking its characters.
    ///
    /// # Errors
    /// [`Fault`] if it is too long, cut, or not text.
    pub fn name(&mut self) -> Result<&'b str, Fault> {
        let at = self.at;
        let [length] = self.array()?;
        if usize::from(length) > NAME_CHARS_MAX {
            let expected = format!("a length of at most {NAME_CHARS_MAX}");
            return Err(Fault::byte(at, expected, length));
        }
        let name = std::str::from_utf8(self.take(length.into())?);
        name.map_err(|_not_text| Fault {
            offset: Some(at),
            ..self.fault("a name", "bytes that are no text")
        })
    }

    /// Takes a record written by [`put`]; in a chunk its number is 0.
    ///
    /// # Errors
    /// [`Fault`] with the field.
    #[inline]
    pub fn record(&mut self, form: Form) -> Result<Record, Fault> {
        let seq = match form {
            Form::Wire | Form::Spool => self.array().map_err(|fault| fault.of("seq"))?,
            Form::Chunk => [0; 8],
        };
        let t_boot = self.array().map_err(|fault| fault.of("t_boot_ns"))?;
        let t_utc = self.array().map_err(|fault| fault.of("t_utc_ns"))?;
        let at = self.at;
        let [byte] = self.array().map_err(|fault| fault.of("clock"))?;
        let (clock, kind) = match form {
            Form::Spool => (byte, self.array::<1>()?[0]),
            Form::Wire | Form::Chunk => (byte >> 4, byte & 0x0F),
        };
        let clock = ClockState::from_code(clock)
            .ok_or_else(|| Fault::byte(at, "a clock of 0 to 2", byte).of("clock"))?;
        let reading = if kind == form.frame() || kind == WITHOUT_THERMISTOR {
            Reading::Frame(self.frame(form, kind)?)
        } else if kind == MISSING {
            Reading::NoData(self.reason().map_err(|fault| fault.of("missing"))?)
        } else {
            let expected = format!(
                "a kind of {}, {MISSING} or {WITHOUT_THERMISTOR}",
                form.frame()
            );
            return Err(Fault::byte(self.at - 1, expected, byte));
        };
        Ok(Record {
            seq: u64::from_le_bytes(seq),
            stamp: Stamp {
                t_boot_ns: u64::from_le_bytes(t_boot),
                t_utc_ns: i64::from_le_bytes(t_utc),
                clock,
            },
            reading,
        })
    }

    #[inline]
    fn frame(&mut self, form: Form, kind: u8) -> Result<RecordedFrame, Fault> {
        let thermistor = match kind {
            WITHOUT_THERMISTOR => None,
            _ => Some(self.array().map_err(|fault| fault.of("thermistor_raw"))?),
        };
        let pixels = match form {
            Form::Spool => self.array().map(|bytes| words_of(&bytes)),
            Form::Wire | Form::Chunk => self.packed(),
        };
        Ok(RecordedFrame {
            thermistor: thermistor.map(|bytes| ThermistorWord(u16::from_le_bytes(bytes))),
            pixels: pixels.map_err(|fault| fault.of("pixels_raw"))?,
        })
    }

    #[inline]
    fn packed(&mut self) -> Result<[PixelWord; PIXELS], Fault> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let Some((pixels, length)) = packed::take(rest) else {
            let expected = "64 words, as the lowest, a width of at most 16 bits and no wider than needed, and 8 bytes for each bit";
            let found = format!("something else, {} bytes before the end", rest.len());
            return Err(self.fault(expected, found));
        };
        self.at += length;
        Ok(pixels)
    }

    fn reason(&mut self) -> Result<NoData, Fault> {
        let name = self.name()?;
        name.parse().map_err(|_unknown| Fault {
            offset: None,
            ..self.fault("the name of a reason why there is no frame", quoted(name))
        })
    }

    /// A fault at the current offset.
    pub fn fault(&self, expected: impl Into<String>, found: impl Into<String>) -> Fault {
        Fault {
            field: "",
            offset: Some(self.at),
            expected: expected.into(),
            found: found.into(),
        }
    }
}
