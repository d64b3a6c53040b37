//! Arrays for numpy: an uncompressed zip archive of `.npy` files (NEP 1, version 1.0 of the format; APPNOTE 6.3.10 for
//! the archive). Equal arrays give equal bytes: every date in the archive is 1980-01-01.

use crate::error::ExportError;
use std::io::Write;

/// Maximum bytes of an archive without the 64-bit extension.
pub(crate) const ARCHIVE_BYTES_MAX: u64 = 0xffff_0000;

/// The header of an array of one type.
fn header(dtype: &str, axes: &[usize]) -> Vec<u8> {
    header_of(&format!("'{dtype}'"), axes)
}

/// A tuple in Python's notation.
pub(crate) fn tuple(axes: &[usize]) -> String {
    let shape: Vec<String> = axes.iter().map(ToString::to_string).collect();
    let comma = if axes.len() == 1 { "," } else { "" };
    format!("({}{comma})", shape.join(", "))
}

/// Magic, version 1.0, and a dictionary padded so that the data begins at a multiple of 64; `descr` in Python's notation.
pub(crate) fn header_of(descr: &str, axes: &[usize]) -> Vec<u8> {
    let shape = tuple(axes);
    let dictionary = format!("{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}");
    let width = (10 + dictionary.len() + 1).next_multiple_of(64) - 11;
    let dictionary = format!("{dictionary:width$}\n");
    let length = u16::try_from(dictionary.len()).unwrap_or(u16::MAX);
    [
        b"\x93NUMPY\x01\x00".as_slice(),
        &length.to_le_bytes(),
        dictionary.as_bytes(),
    ]
    .concat()
}

/// To single precision.
#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "single precision is what the format has, 2 µK at 20 °C"
)]
pub(crate) const fn single(celsius: f64) -> f32 {
    celsius as f32
}

/// A zip archive of stored files; lengths are written after each file.
pub(crate) struct Archive<W> {
    out: W,
    written: u64,
    entries: Vec<Entry>,
}

struct Entry {
    name: &'static str,
    offset: u64,
    length: u64,
    /// CRC-32 of ISO 3309, as in zip and PNG.
    crc: crc32fast::Hasher,
}

impl Entry {
    fn checksum(&self) -> [u8; 4] {
        self.crc.clone().finalize().to_le_bytes()
    }
}

impl<W: Write> Archive<W> {
    pub(crate) const fn new(out: W) -> Self {
        Self {
            out,
            written: 0,
            entries: Vec::new(),
        }
    }

    /// Adds an array with this type and shape.
    pub(crate) fn array<const N: usize>(
        &mut self,
        name: &'static str,
        dtype: &str,
        axes: &[usize],
        values: impl IntoIterator<Item = [u8; N]>,
    ) -> Result<(), ExportError> {
        self.begin(name, &header(dtype, axes))?;
        for value in values {
            self.add(&value)?;
        }
        self.end()
    }

    /// Adds texts as fixed-length code points, zero-padded.
    pub(crate) fn texts(
        &mut self,
        name: &'static str,
        axes: &[usize],
        texts: &[impl AsRef<str>],
    ) -> Result<(), ExportError> {
        let lengths = texts.iter().map(|text| text.as_ref().chars().count());
        let longest = lengths.max().unwrap_or(0).max(1);
        let characters = texts.iter().flat_map(|text| {
            let characters = text.as_ref().chars().map(u32::from);
            characters.chain(std::iter::repeat(0)).take(longest)
        });
        let values = characters.map(u32::to_le_bytes);
        self.array(name, &format!("<U{longest}"), axes, values)
    }

    /// Begins a file with these bytes.
    fn begin(&mut self, name: &'static str, head: &[u8]) -> Result<(), ExportError> {
        let offset = self.written;
        let local = [
            b"PK\x03\x04".as_slice(),
            &VERSION_AND_FLAGS,
            &[0; 12],
            &name_length(name),
            &[0; 2],
            name.as_bytes(),
        ];
        self.put(&local.concat())?;
        self.entries.push(Entry {
            name,
            offset,
            length: 0,
            crc: crc32fast::Hasher::new(),
        });
        self.add(head)
    }

    /// Adds bytes to the open file.
    fn add(&mut self, bytes: &[u8]) -> Result<(), ExportError> {
        if let Some(entry) = self.entries.last_mut() {
            entry.crc.update(bytes);
            entry.length += u64::try_from(bytes.len())?;
        }
        self.put(bytes)
    }

    fn end(&mut self) -> Result<(), ExportError> {
        let Some(entry) = self.entries.last_mut() else {
            return Ok(());
        };
        let length = u32::try_from(entry.length)?.to_le_bytes();
        let descriptor = [
            b"PK\x07\x08".as_slice(),
            &entry.checksum(),
            &length,
            &length,
        ];
        self.put(&descriptor.concat())
    }

    pub(crate) fn finish(mut self) -> Result<(), ExportError> {
        let directory = self.written;
        let mut records = Vec::new();
        for entry in &self.entries {
            let length = u32::try_from(entry.length)?.to_le_bytes();
            let parts = [
                b"PK\x01\x02".as_slice(),
                &VERSION_AND_FLAGS[..2],
                &VERSION_AND_FLAGS,
                &entry.checksum(),
                &length,
                &length,
                &name_length(entry.name),
                &[0; 12],
                &u32::try_from(entry.offset)?.to_le_bytes(),
                entry.name.as_bytes(),
            ];
            records.extend(parts.concat());
        }
        let count = u16::try_from(self.entries.len())?.to_le_bytes();
        let tail = [
            b"PK\x05\x06".as_slice(),
            &[0; 4],
            &count,
            &count,
            &u32::try_from(records.len())?.to_le_bytes(),
            &u32::try_from(directory)?.to_le_bytes(),
            &[0; 2],
        ];
        self.put(&records)?;
        self.put(&tail.concat())
    }

    fn put(&mut self, bytes: &[u8]) -> Result<(), ExportError> {
        self.out.write_all(bytes)?;
        self.written += u64::try_from(bytes.len())?;
        Ok(())
    }
}

fn name_length(name: &str) -> [u8; 2] {
    u16::try_from(name.len()).unwrap_or(u16::MAX).to_le_bytes()
}

/// Version 2.0; bit 3: lengths and checksum follow the file; method 0: stored; 00:00 on 1980-01-01.
const VERSION_AND_FLAGS: [u8; 10] = [20, 0, 8, 0, 0, 0, 0, 0, 0x21, 0];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_one_of_zip() {
        // The check value of CRC-32/ISO-HDLC in the catalogue of parametrised CRC algorithms.
        let mut written = Vec::new();
        let mut archive = Archive::new(&mut written);
        archive.begin("a", b"1234").unwrap();
        archive.add(b"56789").unwrap();
        archive.end().unwrap();
        archive.finish().unwrap();
        let checksums = written
            .windows(4)
            .filter(|bytes| *bytes == 0xcbf4_3926_u32.to_le_bytes());
        assert_eq!(
            checksums.count(),
            2,
            "behind the file, and in the directory"
        );
    }

    #[test]
    fn a_header_is_the_one_that_numpy_writes() {
        // numpy.save of numpy.zeros((3, 8, 8), numpy.float32): 128 bytes before the data.
        let head = header("<f4", &[3, 8, 8]);
        assert_eq!(head.len(), 128);
        assert!(head.starts_with(
            b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (3, 8, 8), }"
        ));
        assert!(head.ends_with(b" \n"));
        for (axes, shape) in [(&[][..], "()"), (&[3], "(3,)"), (&[3, 0], "(3, 0)")] {
            let head = String::from_utf8_lossy(&header("<f4", axes)).into_owned();
            assert!(head.contains(&format!("'shape': {shape}, }}")), "{head}");
        }
    }
}
