//! numpy's arrays: `.npy` (NEP 1: a text heading, then numbers) and `.npz`, a zip archive of them.

use crate::cell::{Cell, Field, RawRow};
use crate::error::ImportError;
use crate::source::Held;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use std::io::Read;

pub(crate) const NPY_MAGIC: &[u8] = b"\x93NUMPY";
pub(crate) const ZIP_MAGIC: &[u8] = b"PK\x03\x04";
/// Bytes of one array after decompression.
const ARRAY_BYTES_MAX: u64 = 1 << 31;
const HINT: &str = "numpy.save(file, frames) writes what is read here: numbers of shape (N, 8, 8) or (N, 64), in C order";

struct Array<'b> {
    /// Without axes of length 1 behind the first.
    shape: Vec<usize>,
    /// The kind's letter, and bytes per value.
    kind: (char, usize),
    is_big: bool,
    data: &'b [u8],
}

/// The rows of a `.npy`.
pub(crate) fn npy(bytes: &[u8]) -> Result<Held, ImportError> {
    let array = Array::of(bytes)?;
    let (rows, cells) = array.rows();
    if cells < PIXELS {
        return Err(wrong(
            "the shape (N, 8, 8) or (N, 64)",
            format!("{:?}", array.shape),
        ));
    }
    held(&[("frames".to_owned(), array)], rows, "numpy's .npy")
}

/// The rows of a `.npz`: its arrays with one entry for each frame.
pub(crate) fn npz(bytes: &[u8]) -> Result<Held, ImportError> {
    let entries =
        entries(bytes).ok_or_else(|| wrong("a whole .npz", "a zip archive without its end"))?;
    let mut files = Vec::new();
    for entry in &entries {
        let array = entry.content(bytes);
        files.push((
            entry.name.clone(),
            array.ok_or_else(|| {
                wrong(
                    "a whole .npz",
                    format!("{} cut or compressed in another way", entry.name),
                )
            })?,
        ));
    }
    let mut arrays = Vec::new();
    for (name, bytes) in &files {
        // What is no array of numbers or texts is not needed.
        if let Ok(array) = Array::of(bytes) {
            arrays.push((name.trim_end_matches(".npy").to_owned(), array));
        }
    }
    let frames = arrays.iter().map(|(_, array)| array.rows());
    let Some((rows, _)) = frames.filter(|(_, cells)| *cells >= PIXELS).max() else {
        return Err(wrong(
            "an array of shape (N, 8, 8) or (N, 64)",
            "none in the archive",
        ));
    };
    arrays.retain(|(_, array)| array.shape.first() == Some(&rows));
    held(&arrays, rows, "numpy's .npz")
}

fn held(arrays: &[(String, Array<'_>)], rows: usize, container: &str) -> Result<Held, ImportError> {
    let whole = arrays
        .iter()
        .map(|(_, array)| array.whole_rows())
        .min()
        .unwrap_or(0);
    let row = |row: usize| RawRow {
        number: u64::try_from(row).unwrap_or(u64::MAX) + 1,
        fields: arrays.iter().map(|(_, array)| array.field(row)).collect(),
        is_whole: true,
    };
    let broken = (whole < rows).then(|| {
        let found = format!("the file ends, where its heading says {rows} frames");
        ImportError::broken(format!("after {whole} frames"), found)
    });
    let names = match arrays {
        // A bare array has no name of its own.
        [_] => Vec::new(),
        _ => arrays.iter().map(|(name, _)| name.clone()).collect(),
    };
    Ok(Held {
        container: container.to_owned(),
        names,
        rows: (0..whole.min(rows))
            .map(row)
            .collect::<Vec<_>>()
            .into_iter(),
        broken,
    })
}

impl<'b> Array<'b> {
    fn of(bytes: &'b [u8]) -> Result<Self, ImportError> {
        let cut = || wrong("a whole heading", "a cut one");
        let version = *bytes
            .get(6)
            .filter(|_| bytes.starts_with(NPY_MAGIC))
            .ok_or_else(cut)?;
        let (length, from) = match (version, bytes.get(8..12).ok_or_else(cut)?) {
            (1, &[low, high, ..]) => (usize::from(u16::from_le_bytes([low, high])), 10),
            (_, &[a, b, c, d]) => (
                usize::try_from(u32::from_le_bytes([a, b, c, d])).unwrap_or(usize::MAX),
                12,
            ),
            _ => return Err(cut()),
        };
        let (heading, data) = bytes
            .get(from..)
            .and_then(|rest| rest.split_at_checked(length))
            .ok_or_else(cut)?;
        let heading = String::from_utf8_lossy(heading);
        if entry(&heading, "fortran_order") != Some("False") {
            return Err(wrong("the order of C (fortran_order False)", "Fortran's"));
        }
        let kind = entry(&heading, "descr")
            .unwrap_or_default()
            .trim_matches('\'')
            .to_owned();
        let shape = entry(&heading, "shape").unwrap_or_default().to_owned();
        let sides = shape.trim_matches(['(', ')']).split(',').map(str::trim);
        let mut shape: Vec<usize> = sides.filter_map(|side| side.parse().ok()).collect();
        if shape == [ROWS, COLUMNS] || shape == [PIXELS] {
            shape.insert(0, 1);
        }
        let mut axis = 0;
        shape.retain(|side| {
            axis += 1;
            axis == 1 || *side != 1
        });
        let mut letters = kind.chars();
        let order = letters.next().unwrap_or(' ');
        let letter = letters.next().unwrap_or(' ');
        let size: usize = letters
            .as_str()
            .split('[')
            .next()
            .and_then(|size| size.parse().ok())
            .unwrap_or(0);
        let size = if letter == 'U' { 4 * size } else { size };
        let is_known = matches!(
            (letter, size),
            ('f', 4 | 8) | ('i' | 'u', 1 | 2 | 4 | 8) | ('b', 1) | ('M', 8)
        ) || (letter == 'U' && size > 0);
        if !is_known {
            return Err(wrong(
                "an array of numbers",
                format!("numbers of kind {kind:?}"),
            ));
        }
        Ok(Self {
            shape,
            kind: (letter, size),
            is_big: order == '>',
            data,
        })
    }

    /// The rows, and the cells of each.
    fn rows(&self) -> (usize, usize) {
        let rows = self.shape.first().copied().unwrap_or(0);
        let cells = self
            .shape
            .iter()
            .skip(1)
            .try_fold(1_usize, |cells, side| cells.checked_mul(*side));
        (rows, cells.unwrap_or(0))
    }

    fn row_bytes(&self) -> usize {
        self.rows().1.saturating_mul(self.kind.1).max(1)
    }

    fn whole_rows(&self) -> usize {
        self.data.len() / self.row_bytes()
    }

    fn field(&self, row: usize) -> Field {
        let from = row.saturating_mul(self.row_bytes());
        let bytes = self
            .data
            .get(from..from.saturating_add(self.row_bytes()))
            .unwrap_or_default();
        let cells: Vec<Cell> = bytes
            .chunks_exact(self.kind.1)
            .map(|bytes| self.cell(bytes))
            .collect();
        match <[Cell; 1]>::try_from(cells) {
            Ok([one]) => Field::One(one),
            Err(many) => Field::Many(many),
        }
    }

    fn cell(&self, bytes: &[u8]) -> Cell {
        let mut ordered = bytes.to_vec();
        if self.is_big && self.kind.0 != 'U' {
            ordered.reverse();
        }
        let padded = |fill: u8| {
            let mut padded = [fill; 8];
            padded[..ordered.len().min(8)].copy_from_slice(&ordered[..ordered.len().min(8)]);
            padded
        };
        match self.kind {
            ('f', 4) => {
                let [a, b, c, d, ..] = padded(0);
                Cell::Number(f64::from(f32::from_le_bytes([a, b, c, d])))
            }
            ('f', _) => Cell::Number(f64::from_le_bytes(padded(0))),
            ('i', _) => {
                let is_negative = ordered.last().is_some_and(|high| high & 0x80 != 0);
                Cell::Integer(i64::from_le_bytes(padded(if is_negative {
                    0xFF
                } else {
                    0
                })))
            }
            ('U', _) => {
                let characters = bytes.chunks_exact(4).map(|four| match (four, self.is_big) {
                    (&[a, b, c, d], false) => u32::from_le_bytes([a, b, c, d]),
                    (&[a, b, c, d], true) => u32::from_be_bytes([a, b, c, d]),
                    _ => 0,
                });
                let text: String = characters
                    .filter(|code| *code != 0)
                    .filter_map(char::from_u32)
                    .collect();
                Cell::of_text(&text)
            }
            _ => Cell::Integer(i64::try_from(u64::from_le_bytes(padded(0))).unwrap_or(i64::MAX)),
        }
    }
}

/// The value of a key in the heading's dictionary, which numpy always writes the same way.
fn entry<'h>(heading: &'h str, key: &str) -> Option<&'h str> {
    let (_, rest) = heading.split_once(&format!("'{key}':"))?;
    let rest = rest.trim_start();
    let end = match rest.starts_with('(') {
        true => rest.find(')')? + 1,
        false => rest.find([',', '}'])?,
    };
    Some(rest[..end].trim_end())
}

/// A file in a zip archive, by its central directory (APPNOTE 4.3.12).
struct Entry {
    name: String,
    method: u16,
    compressed: usize,
    offset: usize,
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn usize_at(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?)).ok()
}

/// The archive's directory; `None` if it has none, or files beyond 4 GB.
fn entries(bytes: &[u8]) -> Option<Vec<Entry>> {
    let end = bytes.windows(4).rposition(|four| four == b"PK\x05\x06")?;
    let (count, mut at) = (u16_at(bytes, end + 10)?, usize_at(bytes, end + 16)?);
    let mut entries = Vec::new();
    for _ in 0..count {
        let name_length = usize::from(u16_at(bytes, at + 28)?);
        let others = usize::from(u16_at(bytes, at + 30)?) + usize::from(u16_at(bytes, at + 32)?);
        let name = bytes.get(at + 46..at + 46 + name_length)?;
        entries.push(Entry {
            name: String::from_utf8_lossy(name).into_owned(),
            method: u16_at(bytes, at + 10)?,
            compressed: usize_at(bytes, at + 20)?,
            offset: usize_at(bytes, at + 42)?,
        });
        at += 46 + name_length + others;
    }
    Some(entries)
}

impl Entry {
    fn content(&self, bytes: &[u8]) -> Option<Vec<u8>> {
        let lengths = usize::from(u16_at(bytes, self.offset + 26)?)
            + usize::from(u16_at(bytes, self.offset + 28)?);
        let from = self.offset + 30 + lengths;
        let stored = bytes.get(from..from.checked_add(self.compressed)?)?;
        match self.method {
            0 => Some(stored.to_vec()),
            8 => {
                let mut content = Vec::new();
                let inflated = flate2::read::DeflateDecoder::new(stored);
                inflated
                    .take(ARRAY_BYTES_MAX)
                    .read_to_end(&mut content)
                    .ok()?;
                Some(content)
            }
            _ => None,
        }
    }
}

fn wrong(expected: &str, found: impl Into<String>) -> ImportError {
    ImportError::Container {
        expected: expected.to_owned(),
        found: found.into(),
        hint: HINT,
    }
}
