//! What a file is packed in, and what it is where it is no recording.

use crate::allowance::Allowance;
use crate::error::ImportError;
use flate2::read::MultiGzDecoder;
use std::io::{Cursor, ErrorKind, Read};
use zip::ZipArchive;

/// Bytes by which the container is told.
pub(crate) const HEAD_BYTES: u64 = 1 << 16;
/// Bytes of a file that is read at once: arrays, Parquet and JSON.
const HELD_BYTES_MAX: u64 = 1 << 32;
/// As often a file may be packed within another.
const PACKED_MAX: usize = 4;
/// Files of an archive that are named in an error.
const NAMED_MAX: usize = 8;
/// In the head of a zip archive that is a workbook, and of no other: where its parts are.
const WORKBOOK: &[u8] = b"xl/";
const ZIP: &[u8] = b"PK\x03\x04";
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
const GZIP: &[u8] = b"\x1f\x8b";

pub(crate) type Input = Box<dyn Read + Send>;

/// Files that are no recording, by their first bytes: what they are, and what to do.
const FOREIGN: [(&[u8], &str, &str); 30] = [
    (b"TDSm", "a file of LabVIEW (TDMS)", "export it as CSV"),
    (
        b"SQLite format 3\0",
        "a SQLite database",
        "export its table: sqlite3 -header -csv FILE 'select * from TABLE' > frames.csv",
    ),
    (
        b"MATLAB 5.0",
        "a file of MATLAB",
        "export it: writematrix(frames, 'frames.csv'), a frame in a line, or numpy.save(\"frames.npy\", scipy.io.loadmat(FILE)[NAME])",
    ),
    (b"\x89HDF", "a file of HDF5, or of MATLAB 7.3", HDF5_HINT),
    (b"\x80\x02", PICKLE, PICKLE_HINT),
    (b"\x80\x03", PICKLE, PICKLE_HINT),
    (b"\x80\x04", PICKLE, PICKLE_HINT),
    (b"\x80\x05", PICKLE, PICKLE_HINT),
    (b"(lp0", PICKLE, PICKLE_HINT),
    (b"\x89PNG", "an image (PNG)", IMAGE_HINT),
    (b"\xff\xd8\xff", "an image (JPEG)", IMAGE_HINT),
    (b"GIF8", "an image (GIF)", IMAGE_HINT),
    (b"P2\n", "an image (PGM)", IMAGE_HINT),
    (b"P5\n", "an image (PGM)", IMAGE_HINT),
    (b"RIFF", "a video (AVI)", IMAGE_HINT),
    (b"\0\0\0\x18ftyp", "a video (MP4)", IMAGE_HINT),
    (b"\0\0\0\x1cftyp", "a video (MP4)", IMAGE_HINT),
    (b"\0\0\0\x20ftyp", "a video (MP4)", IMAGE_HINT),
    (
        b"\xd4\xc3\xb2\xa1",
        "a capture of a network (pcap)",
        "record what it carried",
    ),
    (
        b"MATLAB 7.3",
        "a file of MATLAB 7.3, which is HDF5",
        HDF5_HINT,
    ),
    (b"%PDF", "a PDF", "record the numbers themselves"),
    (
        b"#ROSBAG",
        "a ROS bag",
        "export its topic as CSV: rostopic echo -b FILE -p TOPIC > frames.csv",
    ),
    (
        b"\x89MCAP",
        "a file of MCAP",
        "convert the recording that it was made from",
    ),
    (
        b"ARROW1",
        "a file of Arrow (Feather)",
        "save it as Parquet: pandas.read_feather(FILE).to_parquet(\"frames.parquet\")",
    ),
    (
        b"\xd0\xcf\x11\xe0",
        "a workbook of Excel 97 (.xls)",
        "save it as .xlsx or as CSV",
    ),
    (b"7z\xbc\xaf", "a packed file (7-Zip)", PACKED_HINT),
    (b"Rar!", "a packed file (RAR)", PACKED_HINT),
    (b"\xfd7zXZ", "a packed file (xz)", PACKED_HINT),
    (b"BZh", "a packed file (bzip2)", PACKED_HINT),
    (b"\x28\xb5\x2f\xfd", "a packed file (zstd)", PACKED_HINT),
];
const HDF5_HINT: &str =
    "export it from Python: numpy.save(\"frames.npy\", h5py.File(FILE)[NAME][:])";
const PICKLE: &str = "a pickle of Python";
const PICKLE_HINT: &str = "only Python reads it, and it may run code: numpy.save(\"frames.npy\", frames) or frames.to_csv(\"frames.csv\")";
const IMAGE_HINT: &str = "its colors are no temperatures: record the numbers themselves";
const PACKED_HINT: &str = "unpack it first; .gz and .zip are read as they are";

/// Texts that are no recording, by words in their beginning.
const FOREIGN_TEXTS: [(&str, &str, &str); 4] = [
    ("<?xml", "a file of XML", "save the frames as CSV or JSON"),
    (
        "<html",
        "a web page (HTML)",
        "download the file itself, not the page that shows it",
    ),
    (
        "git-lfs.github.com",
        "a pointer of Git LFS",
        "fetch the file that it stands for: git lfs pull",
    ),
    (
        "\"cell_type\"",
        "a notebook of Jupyter",
        "save the frames from it: numpy.save(\"frames.npy\", frames)",
    ),
];

/// A file without what it is packed in, with its first bytes and its name.
pub(crate) struct Unpacked {
    pub(crate) head: Vec<u8>,
    pub(crate) rest: Input,
    pub(crate) name: String,
    /// The arrays of numpy's archive.
    pub(crate) arrays: Option<Vec<(String, Vec<u8>)>>,
    pub(crate) is_workbook: bool,
}

/// Takes a file out of gzip, zip and UTF-16.
///
/// # Errors
/// [`ImportError`] for what is no recording, or several.
pub(crate) fn unpack(
    input: impl Read + Send + 'static,
    name: &str,
    allowance: &Allowance,
) -> Result<Unpacked, ImportError> {
    let input = Box::new(allowance.of_file(input));
    unpack_within(input, name, (PACKED_MAX, allowance))
}

fn unpack_within(
    mut input: Input,
    name: &str,
    (depth, allowance): (usize, &Allowance),
) -> Result<Unpacked, ImportError> {
    let deeper = || {
        let what = "this is a file that is packed several times";
        let less = depth.checked_sub(1);
        let less = less.ok_or_else(|| ImportError::refused(what, PACKED_HINT));
        less.map(|less| (less, allowance))
    };
    let mut head = head_of(&mut input)?;
    if let Some(text) = head.strip_prefix(BYTE_ORDER_MARK) {
        head = text.to_vec();
    }
    if head.starts_with(GZIP) {
        let name = name.strip_suffix(".gz").unwrap_or(name);
        let unpacked = MultiGzDecoder::new(Cursor::new(head).chain(input));
        let unpacked = allowance.of_unpacked(unpacked);
        return unpack_within(Box::new(unpacked), name, deeper()?);
    }
    if let Some((found, hint)) = foreign(&head) {
        return Err(ImportError::refused(format!("this is {found}"), hint));
    }
    let is_workbook = head.starts_with(ZIP)
        && head
            .windows(WORKBOOK.len())
            .any(|window| window == WORKBOOK);
    if head.starts_with(ZIP) && !is_workbook {
        return unzip(held(Cursor::new(head).chain(input))?, name, deeper()?);
    }
    let has = |byte: u8| head.contains(&byte);
    if has(b'\r') && !has(b'\n') && !has(0) {
        // Old programs, and terminals, end lines so.
        let mut bytes = held(Cursor::new(head).chain(input))?;
        bytes
            .iter_mut()
            .filter(|byte| **byte == b'\r')
            .for_each(|byte| *byte = b'\n');
        return unpack_within(Box::new(Cursor::new(bytes)), name, deeper()?);
    }
    if let Some(is_big) = utf16(&head) {
        let text = decoded(&held(Cursor::new(head).chain(input))?, is_big);
        return unpack_within(Box::new(Cursor::new(text.into_bytes())), name, deeper()?);
    }
    Ok(Unpacked {
        head,
        rest: input,
        name: name.to_owned(),
        arrays: None,
        is_workbook,
    })
}

/// What a file is that is no recording, and what to do.
fn foreign(head: &[u8]) -> Option<(&'static str, &'static str)> {
    if head.is_empty() {
        return Some(("an empty file", "nothing was recorded into it"));
    }
    if head.get(257..262) == Some(b"ustar") {
        return Some(("an archive (tar)", PACKED_HINT));
    }
    let beginning = String::from_utf8_lossy(&head[..head.len().min(1_024)]);
    if beginning
        .split(['"', '\'', ' ', ',', '\n', '\t'])
        .any(is_base64)
    {
        return Some((
            "numbers packed as base64",
            "decode them first: numpy.frombuffer(base64.b64decode(text), \"<i2\")",
        ));
    }
    let bytes = FOREIGN
        .iter()
        .find(|(magic, ..)| head.starts_with(magic))
        .map(|(_, found, hint)| (*found, *hint));
    let words = || {
        FOREIGN_TEXTS
            .iter()
            .find(|(words, ..)| beginning.contains(words))
            .map(|(_, found, hint)| (*found, *hint))
    };
    bytes.or_else(words)
}

/// Whether a word is the bytes of a frame, packed as text.
fn is_base64(word: &str) -> bool {
    let has = |is: fn(&u8) -> bool| word.bytes().any(|byte| is(&byte));
    let is_letter = |letter: char| letter.is_ascii_alphanumeric() || "+/=".contains(letter);
    word.len() >= 160
        && word.chars().all(is_letter)
        && has(u8::is_ascii_uppercase)
        && has(|byte| (b'g'..=b'z').contains(byte))
}

fn head_of(input: &mut Input) -> Result<Vec<u8>, ImportError> {
    let mut head = Vec::new();
    let read = input.take(HEAD_BYTES).read_to_end(&mut head);
    read.map_err(|error| ImportError::unread("at its beginning", &error))?;
    Ok(head)
}

pub(crate) fn held(input: impl Read) -> Result<Vec<u8>, ImportError> {
    let mut bytes = Vec::new();
    let read = input.take(HELD_BYTES_MAX + 1).read_to_end(&mut bytes);
    read.map_err(|error| ImportError::unread("the file as a whole", &error))?;
    match u64::try_from(bytes.len()).unwrap_or(u64::MAX) > HELD_BYTES_MAX {
        true => Err(ImportError::unlike(
            &format!("at most {HELD_BYTES_MAX} bytes of a file that is read at once"),
            "more",
            "save it in parts, or as CSV, which is read line by line",
        )),
        false => Ok(bytes),
    }
}

/// numpy's arrays, or the only file.
fn unzip(
    bytes: Vec<u8>,
    name: &str,
    (depth, allowance): (usize, &Allowance),
) -> Result<Unpacked, ImportError> {
    let damaged = |error: &dyn core::fmt::Display| {
        let hint = "copy it again, whole; numpy.savez and zip write what is read here";
        ImportError::unlike("a whole archive", error, hint)
    };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(|error| damaged(&error))?;
    let is_file =
        |name: &&str| !name.ends_with('/') && !name.starts_with("__MACOSX") && !name.contains("/.");
    let names: Vec<String> = archive
        .file_names()
        .filter(is_file)
        .map(str::to_owned)
        .collect();
    let mut content = |name: &str| -> Result<Vec<u8>, ImportError> {
        let file = archive.by_name(name).map_err(|error| damaged(&error))?;
        let mut content = Vec::new();
        let read = allowance.of_unpacked(file).read_to_end(&mut content);
        read.map_err(|error| match error.kind() {
            ErrorKind::FileTooLarge => ImportError::unread(name, &error),
            _ => damaged(&error),
        })?;
        Ok(content)
    };
    let is_array = |name: &String| name.ends_with(".npy");
    if names.iter().any(is_array) {
        let arrays = names.iter().filter(|name| is_array(name));
        let arrays: Result<Vec<_>, ImportError> = arrays
            .map(|name| Ok((name.clone(), content(name)?)))
            .collect();
        return Ok(Unpacked {
            head: Vec::new(),
            rest: Box::new(std::io::empty()),
            name: name.to_owned(),
            arrays: Some(arrays?),
            is_workbook: false,
        });
    }
    if names.iter().any(|name| name.starts_with("word/")) {
        let what = "this is a document of Word (docx)";
        return Err(ImportError::refused(what, "save the numbers as text"));
    }
    match &names[..] {
        [only] => {
            let inner = only.rsplit('/').next().unwrap_or(only);
            let content = Box::new(Cursor::new(content(only)?));
            unpack_within(content, inner, (depth, allowance))
        }
        _ => Err(ImportError::refused(
            format!("the archive has {} files", names.len()),
            match names.is_empty() {
                true => "it must have a recording".to_owned(),
                false => format!(
                    "unpack it and convert one after the other: {}",
                    names[..names.len().min(NAMED_MAX)].join(", ")
                ),
            },
        )),
    }
}

/// Whether a text is in UTF-16, and its high bytes come first: by its mark, or by the zeros of Latin letters.
fn utf16(head: &[u8]) -> Option<bool> {
    let zeros = |offset: usize| {
        head.iter()
            .take(512)
            .skip(offset)
            .step_by(2)
            .filter(|byte| **byte == 0)
            .count()
    };
    let (even, odd) = (zeros(0), zeros(1));
    let most = head.len().min(512) / 2;
    match head {
        [0xff, 0xfe, ..] if odd * 2 > most => return Some(false),
        [0xfe, 0xff, ..] if even * 2 > most => return Some(true),
        _ => {}
    }
    let is_text = head.iter().take(2).any(u8::is_ascii_graphic) && most >= 8;
    match (even * 10 >= most * 9, odd * 10 >= most * 9) {
        (true, false) if is_text => Some(true),
        (false, true) if is_text => Some(false),
        _ => None,
    }
}

fn decoded(bytes: &[u8], is_big: bool) -> String {
    let units = bytes.chunks_exact(2).filter_map(|pair| {
        let pair = [*pair.first()?, *pair.get(1)?];
        Some(if is_big {
            u16::from_be_bytes(pair)
        } else {
            u16::from_le_bytes(pair)
        })
    });
    char::decode_utf16(units)
        .map(|character| character.unwrap_or(char::REPLACEMENT_CHARACTER))
        .collect()
}
