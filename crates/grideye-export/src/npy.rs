//! Arrays for numpy: `.npy` (NEP 1, version 1.0 of the format), and an uncompressed zip archive of them, `.npz`. Equal arrays
//! give equal bytes: every date in the archive is 1980-01-01.

use crate::error::ExportError;
use std::io::Write;
use zip::write::{SimpleFileOptions, StreamWriter};
use zip::{CompressionMethod, ZipWriter};

/// A tuple in Python's notation.
pub(crate) fn tuple(axes: &[usize]) -> String {
    let shape: Vec<String> = axes.iter().map(ToString::to_string).collect();
    let comma = if axes.len() == 1 { "," } else { "" };
    format!("({}{comma})", shape.join(", "))
}

/// Magic, version 1.0, and a dictionary padded so that the data begins at a multiple of 64; `descr` in Python's notation.
///
/// # Errors
/// If it is longer than version 1.0 can say.
pub(crate) fn header(descr: &str, axes: &[usize]) -> Result<Vec<u8>, ExportError> {
    let shape = tuple(axes);
    let dictionary = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    let width = (10 + dictionary.len() + 1).next_multiple_of(64) - 11;
    // Before the text is padded: a longer one cannot be.
    let length = u16::try_from(width + 1)?.to_le_bytes();
    let dictionary = format!("{dictionary:width$}\n");
    let magic = b"\x93NUMPY\x01\x00".as_slice();
    Ok([magic, &length, dictionary.as_bytes()].concat())
}

/// Text as code points, padded with zeros to this length.
pub(crate) fn text(text: &str, length: usize) -> impl Iterator<Item = u8> {
    let characters = text.chars().map(u32::from).chain(std::iter::repeat(0));
    characters.take(length).flat_map(u32::to_le_bytes)
}

/// An archive of arrays.
pub(crate) struct Archive<W: Write> {
    zip: ZipWriter<StreamWriter<W>>,
}

impl<W: Write> Archive<W> {
    pub(crate) fn new(out: W) -> Self {
        let zip = ZipWriter::new_stream(out);
        Self { zip }
    }

    /// Adds an array of this type and shape.
    pub(crate) fn array(
        &mut self,
        name: &str,
        dtype: &str,
        axes: &[usize],
        bytes: &[u8],
    ) -> Result<(), ExportError> {
        let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.zip.start_file(format!("{name}.npy"), stored)?;
        self.zip.write_all(&header(&format!("'{dtype}'"), axes)?)?;
        Ok(self.zip.write_all(bytes)?)
    }

    /// Adds texts, as long as the longest.
    pub(crate) fn texts(
        &mut self,
        name: &str,
        axes: &[usize],
        texts: &[impl AsRef<str>],
    ) -> Result<(), ExportError> {
        let lengths = texts.iter().map(|text| text.as_ref().chars().count());
        let longest = lengths.max().unwrap_or(0).max(1);
        let bytes = texts.iter().flat_map(|one| text(one.as_ref(), longest));
        let bytes: Vec<u8> = bytes.collect();
        self.array(name, &format!("<U{longest}"), axes, &bytes)
    }

    pub(crate) fn finish(self) -> Result<(), ExportError> {
        self.zip.finish()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_one_of_zip() {
        let mut written = Vec::new();
        let mut archive = Archive::new(&mut written);
        archive.array("a", "<u1", &[9], b"123456789").unwrap();
        archive.finish().unwrap();
        // CRC-32/ISO-HDLC by its definition: polynomial 0xedb88320, reflected.
        let file = [header("'<u1'", &[9]).unwrap(), b"123456789".to_vec()].concat();
        let crc = file.iter().fold(!0_u32, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
                (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
            })
        });
        let checksums = written.windows(4);
        let checksums = checksums.filter(|bytes| *bytes == (!crc).to_le_bytes());
        assert_eq!(
            checksums.count(),
            2,
            "behind the file, and in the directory"
        );
    }

    #[test]
    fn a_header_is_the_one_that_numpy_writes() {
        // numpy.save of numpy.zeros((3, 8, 8), numpy.float32): 128 bytes before the data.
        let head = header("'<f4'", &[3, 8, 8]).unwrap();
        assert_eq!(head.len(), 128);
        assert!(head.starts_with(
            b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (3, 8, 8), }"
        ));
        assert!(head.ends_with(b" \n"));
        for (axes, shape) in [(&[][..], "()"), (&[3], "(3,)"), (&[3, 0], "(3, 0)")] {
            let head = header("'<f4'", axes).unwrap();
            let head = String::from_utf8_lossy(&head).into_owned();
            assert!(head.contains(&format!("'shape': {shape}, }}")), "{head}");
        }
        header(&"x".repeat(1 << 16), &[]).unwrap_err();
    }
}
