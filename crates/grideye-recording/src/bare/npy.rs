//! Reads numpy's `.npy` (NEP 1): a text heading, then numbers.

use crate::bare::assumed::{Assumed, no_word, word_of};
use crate::error::RecordingError;
use crate::lines::rows_until_error;
use crate::record::Row;
use grideye_frame::{PIXELS, PixelWord};
use std::io::{BufReader, Read};

pub(crate) const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Maximum heading in bytes; numpy writes 118.
const HEADING_BYTES_MAX: usize = 4096;

/// Reads an array (N, 8, 8) or (N, 64) of float32 or float64 in °C as rows, up to the first error. Skips frames of NaN.
#[derive(Debug)]
pub struct NpyReader<R> {
    input: BufReader<R>,
    assumed: Assumed,
    bytes_each: usize,
    frames: u64,
    next: u64,
    ended: bool,
}

impl<R: Read> NpyReader<R> {
    /// Reads the heading at once.
    ///
    /// # Errors
    /// [`RecordingError::Array`] if it is no such array, or cut.
    pub fn new(input: R, assumed: Assumed) -> Result<Self, RecordingError> {
        let mut input = BufReader::new(input);
        let heading = heading(&mut input)?;
        let bytes_each = match entry(&heading, "descr") {
            Some("'<f4'") => 4,
            Some("'<f8'") => 8,
            found => return Err(wrong("numbers of kind '<f4' or '<f8', in °C", found)),
        };
        let order = entry(&heading, "fortran_order");
        if order != Some("False") {
            return Err(wrong("the order of C (fortran_order False)", order));
        }
        let shape = entry(&heading, "shape");
        let frames = shape
            .and_then(frames_of)
            .ok_or_else(|| wrong("the shape (N, 8, 8) or (N, 64)", shape))?;
        Ok(Self {
            input,
            assumed,
            bytes_each,
            frames,
            next: 0,
            ended: false,
        })
    }

    fn row(&mut self) -> Result<Option<Row>, RecordingError> {
        while self.next < self.frames {
            let seq = self.next;
            self.next += 1;
            let celsius = self.frame(seq)?;
            if celsius.iter().all(|celsius| celsius.is_nan()) {
                continue;
            }
            let mut pixels = [PixelWord(0); PIXELS];
            for (index, (word, celsius)) in pixels.iter_mut().zip(celsius).enumerate() {
                let place = || format!("frame {seq}, pixel {}", index + 1);
                *word = word_of(celsius).ok_or_else(|| no_word(place(), &celsius.to_string()))?;
            }
            return Ok(Some(self.assumed.row(seq, self.assumed.stamp(seq), pixels)));
        }
        Ok(None)
    }

    fn frame(&mut self, seq: u64) -> Result<[f64; PIXELS], RecordingError> {
        let mut bytes = [0; PIXELS * 8];
        let wanted = &mut bytes[..PIXELS * self.bytes_each];
        self.input
            .read_exact(wanted)
            .map_err(|error| RecordingError::Array {
                expected: format!("{} frames, as the heading says", self.frames),
                found: format!("{seq} whole ones, then {error}"),
            })?;
        let mut celsius = [0.0; PIXELS];
        for (value, bytes) in celsius.iter_mut().zip(wanted.chunks_exact(self.bytes_each)) {
            *value = match *bytes {
                [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
                [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
                _ => f64::NAN,
            };
        }
        Ok(celsius)
    }
}

rows_until_error!(NpyReader, Row);

fn heading(input: &mut impl Read) -> Result<String, RecordingError> {
    let cut = |error: std::io::Error| wrong("a whole heading", Some(&error.to_string()));
    let mut start = [0; 8];
    input.read_exact(&mut start).map_err(cut)?;
    if !start.starts_with(MAGIC) {
        return Err(wrong("the heading of a .npy file", None));
    }
    let mut length = [0; 4];
    let length_bytes = if start[6] == 1 { 2 } else { 4 };
    input.read_exact(&mut length[..length_bytes]).map_err(cut)?;
    let length = usize::try_from(u32::from_le_bytes(length)).unwrap_or(usize::MAX);
    if length > HEADING_BYTES_MAX {
        let found = format!("one of {length} bytes");
        return Err(wrong("a heading of at most 4096 bytes", Some(&found)));
    }
    let mut text = vec![0; length];
    input.read_exact(&mut text).map_err(cut)?;
    String::from_utf8(text).map_err(|_not_text| wrong("a heading of text", None))
}

/// The value of a key in the heading's dictionary, which numpy always writes the same way.
fn entry<'h>(heading: &'h str, key: &str) -> Option<&'h str> {
    let (_, rest) = heading.split_once(&format!("'{key}':"))?;
    let rest = rest.trim_start();
    let end = if rest.starts_with('(') {
        rest.find(')')? + 1
    } else {
        rest.find([',', '}'])?
    };
    Some(rest[..end].trim_end())
}

fn frames_of(shape: &str) -> Option<u64> {
    let inner = shape.strip_prefix('(')?.strip_suffix(')')?;
    let sides: Vec<u64> = inner
        .split(',')
        .map(str::trim)
        .filter(|side| !side.is_empty())
        .map(|side| side.parse().ok())
        .collect::<Option<_>>()?;
    match *sides.as_slice() {
        [frames, 8, 8] | [frames, 64] => Some(frames),
        _ => None,
    }
}

fn wrong(expected: &str, found: Option<&str>) -> RecordingError {
    RecordingError::Array {
        expected: expected.to_owned(),
        found: found.unwrap_or("something else").to_owned(),
    }
}
