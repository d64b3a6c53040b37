//! numpy's arrays: `.npy` (NEP 1: a text heading, then numbers) and `.npz`, a zip archive of them.

use crate::allowance::{Allowance, ROW_VALUES_MAX, VALUE_BYTES, too_wide};
use crate::cell::{Cell, Field, RawRow};
use crate::columns::{CELSIUS, Columns, Place, Role};
use crate::error::ImportError;
use crate::source::Made;
use grideye_frame::{COLUMNS, PIXELS, ROWS};
use grideye_recording::is_known_size;

pub(crate) const NPY_MAGIC: &[u8] = b"\x93NUMPY";
/// As many as numpy has.
const AXES_MAX: usize = 64;
/// Arrays named in an error.
const NAMED_MAX: usize = 8;
const HINT: &str = "numpy.save(file, frames) writes what is read here: numbers of shape (N, 8, 8) or (N, 64), in C order";

struct Array {
    /// Without axes of length 1 behind the first.
    shape: Vec<usize>,
    /// The kind's letter, and bytes per value.
    kind: (char, usize),
    is_big: bool,
    is_fortran: bool,
    /// Whether the frames lie along the last axis, which `shape` has first.
    has_frames_last: bool,
    /// The file, and where its numbers begin.
    bytes: Vec<u8>,
    from: usize,
}

/// The rows of a `.npy`.
pub(crate) fn npy(bytes: Vec<u8>, allowance: &Allowance) -> Result<Made, ImportError> {
    let array = Array::of(bytes)?;
    let (rows, cells) = array.rows();
    let is_image = matches!(array.shape[..], [_, _] | [_, 4..=9_999, 4..=9_999]);
    if is_image && is_known_size(cells) {
        return Err(ImportError::other_sensor(cells));
    }
    if cells < PIXELS || array.shape.len() > 3 && cells > PIXELS {
        return Err(wrong(
            "the shape (N, 8, 8) or (N, 64)",
            format!("{:?}", array.shape),
        ));
    }
    made(
        vec![("frames".to_owned(), array)],
        rows,
        ("numpy's .npy", allowance),
    )
}

/// The rows of a `.npz`: of the array with frames, with all that have one entry for each of them.
pub(crate) fn npz(
    files: Vec<(String, Vec<u8>)>,
    said: &Columns,
    allowance: &Allowance,
) -> Result<Made, ImportError> {
    let mut arrays = Vec::new();
    for (name, bytes) in files {
        let name = name.trim_end_matches(".npy").to_owned();
        // What is no array of numbers or texts is not needed.
        if let Ok(array) = Array::of(bytes) {
            arrays.push((name, array));
        }
    }
    let asked = said.said.iter().find_map(|(role, place)| match place {
        Place::Named(name) if *role == Role::Pixels => Some(name.as_str()),
        _ => None,
    });
    let has_frames = |array: &Array| array.rows().1 >= PIXELS;
    let is_asked = |name: &str| asked.is_none_or(|asked| asked == name);
    let mut with_frames: Vec<&(String, Array)> = arrays
        .iter()
        .filter(|(name, array)| has_frames(array) && is_asked(name))
        .collect();
    if with_frames.iter().any(|(name, _)| name == CELSIUS) {
        with_frames.retain(|(name, _)| name == CELSIUS);
    }
    let rows = match with_frames[..] {
        [] => {
            return Err(wrong(
                "an array of shape (N, 8, 8) or (N, 64)",
                "none in the archive",
            ));
        }
        [(_, array)] => array.rows().0,
        _ => {
            let few = || with_frames.iter().take(NAMED_MAX);
            let told: Vec<String> = few()
                .map(|(name, array)| format!("{name} {:?}", array.shape))
                .collect();
            let choices: Vec<String> = few()
                .map(|(name, _)| format!("--columns pixels={name}"))
                .collect();
            return Err(ImportError::refused(
                format!("several arrays may have frames: {}", told.join(", ")),
                format!("convert one after the other: {}", choices.join(", ")),
            ));
        }
    };
    let taken = with_frames[0].0.clone();
    arrays.retain(|(name, array)| {
        array.shape.first() == Some(&rows) && (!has_frames(array) || *name == taken)
    });
    made(arrays, rows, ("numpy's .npz", allowance))
}

/// The rows, each made when it is asked for.
fn made(
    arrays: Vec<(String, Array)>,
    rows: usize,
    (container, allowance): (&str, &Allowance),
) -> Result<Made, ImportError> {
    let whole = arrays
        .iter()
        .map(|(_, array)| array.whole_rows())
        .min()
        .unwrap_or(0);
    let width = arrays.iter().map(|(_, array)| array.rows().1);
    let width = width.fold(0, usize::saturating_add);
    if width > ROW_VALUES_MAX {
        return Err(too_wide(width, "in the shape"));
    }
    let broken = (whole < rows).then(|| {
        let found = format!("the file ends, where its heading says {rows} frames");
        ImportError::broken(format!("after {whole} frames"), found)
    });
    let names = match &arrays[..] {
        // A bare array has no name of its own.
        [_] => Vec::new(),
        _ => arrays.iter().map(|(name, _)| name.clone()).collect(),
    };
    let allowance = allowance.clone();
    let row = move |row: usize| {
        allowance.take_values(width, VALUE_BYTES, || format!("row {}", row + 1))?;
        Ok(RawRow {
            number: u64::try_from(row).unwrap_or(u64::MAX) + 1,
            fields: arrays.iter().map(|(_, array)| array.field(row)).collect(),
            is_whole: true,
            is_torn: false,
        })
    };
    Ok(Made {
        container: container.to_owned(),
        names,
        rows: Box::new((0..whole.min(rows)).map(row).chain(broken.map(Err))),
        skipped: 0,
    })
}

impl Array {
    fn of(bytes: Vec<u8>) -> Result<Self, ImportError> {
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
        let data = length.saturating_add(from);
        let heading = bytes.get(from..data).ok_or_else(cut)?;
        let heading = String::from_utf8_lossy(heading);
        let is_fortran = entry(&heading, "fortran_order") != Some("False");
        let kind = entry(&heading, "descr")
            .unwrap_or_default()
            .trim_matches('\'')
            .to_owned();
        let shape = entry(&heading, "shape").unwrap_or_default().to_owned();
        let sides = shape.trim_matches(['(', ')']).split(',').map(str::trim);
        let mut shape: Vec<usize> = sides.filter_map(|side| side.parse().ok()).collect();
        if shape.len() > AXES_MAX {
            let expected = format!("an array of at most {AXES_MAX} axes");
            return Err(wrong(&expected, shape.len().to_string()));
        }
        if shape == [ROWS, COLUMNS] || shape == [PIXELS] {
            shape.insert(0, 1);
        }
        let mut axis = 0;
        shape.retain(|side| {
            axis += 1;
            axis == 1 || *side != 1
        });
        if matches!(shape[..], [1, _, ROWS, COLUMNS]) {
            shape.remove(0);
        }
        // Frames along the last axis; of eight the first one is taken.
        let has_frames_last = matches!(shape[..], [ROWS, COLUMNS, last] if last != COLUMNS)
            || matches!(shape[..], [PIXELS, last] if last != PIXELS && last > 1);
        if has_frames_last {
            let frames = shape.pop().unwrap_or(0);
            shape.insert(0, frames);
        }
        let (kind, is_big) = kind_of(&kind)?;
        Ok(Self {
            shape,
            kind,
            is_big,
            is_fortran,
            has_frames_last,
            from: data,
            bytes,
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

    /// The place of a row's cell among the numbers, which lie with the last axis or the first one closest together.
    fn place(&self, row: usize, cell: usize) -> usize {
        let (rows, cells) = self.rows();
        let in_c_order = match (self.is_fortran, self.shape.len()) {
            (true, 3) => COLUMNS * (cell % COLUMNS) + cell / COLUMNS,
            _ => cell,
        };
        match self.is_fortran != self.has_frames_last {
            true => in_c_order.saturating_mul(rows).saturating_add(row),
            false => row.saturating_mul(cells).saturating_add(in_c_order),
        }
    }

    /// Rows of which all cells are there.
    fn whole_rows(&self) -> usize {
        let (rows, cells) = self.rows();
        let there = (self.bytes.len() - self.from) / self.kind.1;
        match self.is_fortran != self.has_frames_last {
            true if there < rows.saturating_mul(cells) => 0,
            true => rows,
            false => there / cells.max(1),
        }
    }

    fn field(&self, row: usize) -> Field {
        let size = self.kind.1;
        let cells = (0..self.rows().1).map(|cell| {
            let from = self.place(row, cell).saturating_mul(size);
            let from = from.saturating_add(self.from);
            self.bytes
                .get(from..from.saturating_add(size))
                .map_or(Cell::Empty, |bytes| self.cell(bytes))
        });
        match <[Cell; 1]>::try_from(cells.collect::<Vec<_>>()) {
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
            ('f', 2) => {
                let [low, high, ..] = padded(0);
                Cell::Number(half::f16::from_le_bytes([low, high]).to_f64())
            }
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

/// The letter and the bytes of a number, and whether the high byte comes first.
fn kind_of(kind: &str) -> Result<((char, usize), bool), ImportError> {
    let mut letters = kind.chars();
    let order = letters.next().unwrap_or(' ');
    let letter = letters.next().unwrap_or(' ');
    let size: usize = letters
        .as_str()
        .split('[')
        .next()
        .and_then(|size| size.parse().ok())
        .unwrap_or(0);
    let size = if letter == 'U' {
        size.saturating_mul(4)
    } else {
        size
    };
    let is_known = matches!(
        (letter, size),
        ('f', 2 | 4 | 8) | ('i' | 'u', 1 | 2 | 4 | 8) | ('b', 1) | ('M', 8)
    ) || (letter == 'U' && size > 0);
    if !is_known {
        return Err(wrong(
            "an array of numbers",
            match letter {
                'O' => "one of Python's objects, which is a pickle".to_owned(),
                _ => format!("numbers of kind {kind:?}"),
            },
        ));
    }
    Ok(((letter, size), order == '>'))
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

fn wrong(expected: &str, found: impl std::fmt::Display) -> ImportError {
    ImportError::unlike(expected, found, HINT)
}
