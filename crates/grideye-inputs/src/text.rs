//! Texts of files, within their limit.

use crate::error::{InputError, shown};
use grideye_scene::Place;
use grideye_scene::limits::TEXT_BYTES_MAX;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

const MIB: usize = 1 << 20;

/// The place of the first invalid byte, from 1.
#[derive(Debug, thiserror::Error)]
#[error("line {line}, column {column}: the byte {byte:#04x} is not UTF-8")]
struct NotUtf8 {
    line: usize,
    column: usize,
    byte: u8,
}

/// The text of an input that was opened, at most [`TEXT_BYTES_MAX`] bytes.
/// # Errors
/// If it cannot be read, is longer, or is not UTF-8: the error says where.
pub fn read_text(input: impl Read) -> io::Result<String> {
    let mut bytes = Vec::new();
    let limit = u64::try_from(TEXT_BYTES_MAX).unwrap_or(u64::MAX);
    input
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)?;
    if bytes.len() > TEXT_BYTES_MAX {
        let told = format!("it has more than {} MiB", TEXT_BYTES_MAX / MIB);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, told));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let (before, after) = error.as_bytes().split_at(at);
        let before = String::from_utf8_lossy(before);
        let Place { line, column, .. } = Place::of_byte("", &before, before.len());
        let place = NotUtf8 {
            line,
            column,
            byte: after.first().copied().unwrap_or_default(),
        };
        io::Error::new(io::ErrorKind::InvalidData, place)
    })
}

/// Opens a file, and nothing that stands in place of one: a pipe gives nothing until somebody writes into it, and a device may
/// have no end.
/// # Errors
/// If there is none, or it is a folder, a pipe, a socket or a device.
pub fn regular(path: &Path) -> io::Result<File> {
    let about = path.metadata()?;
    if about.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !about.is_file() {
        let told = "it is a pipe, a socket or a device, and only files are read: save into a file what comes from it";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, told));
    }
    File::open(path)
}

/// The text of a file; `what` it is stands in errors, and `hint` says what to name.
/// # Errors
/// If it cannot be read, is longer than [`TEXT_BYTES_MAX`], or is not UTF-8.
pub fn text(path: &Path, what: &str, hint: &str) -> Result<String, InputError> {
    let shown = shown(path);
    regular(path).and_then(read_text).map_err(|error| {
        let place = error.get_ref().and_then(|error| error.downcast_ref());
        match place {
            Some(NotUtf8 { line, column, byte }) => InputError::new(format!(
                "{shown}:{line}:{column}: the byte {byte:#04x} is not UTF-8\nhint: save {what} as UTF-8"
            ))
            .at(Some(*line)),
            None => InputError::new(format!("cannot read {what} {shown}: {error}\nhint: {hint}")),
        }
        .of(path)
    })
}

/// Opens a file to be read piece by piece.
/// # Errors
/// As [`regular`].
pub fn open(path: &Path) -> Result<BufReader<File>, InputError> {
    regular(path).map(BufReader::new).map_err(|error| {
        InputError::new(format!(
            "cannot open {}: {error}\nhint: name an existing file that you may read",
            shown(path)
        ))
        .of(path)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_read_to_its_limit_and_no_further() {
        let longest = vec![b'a'; TEXT_BYTES_MAX];
        assert_eq!(read_text(longest.as_slice()).unwrap().len(), TEXT_BYTES_MAX);
        let error = read_text(io::repeat(0)).unwrap_err().to_string();
        assert_eq!(error, "it has more than 16 MiB");
    }
}
