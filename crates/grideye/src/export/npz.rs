//! Arrays for numpy: a zip archive, stored and not deflated, of `.npy` files (NEP 1, version 1.0 of the format;
//! APPNOTE 6.3.10 for the archive). Equal frames give equal bytes: the archive's dates are all 1980-01-01.
//!
//! | array | type | shape | holds |
//! |---|---|---|---|
//! | `frames` | float32 | (N, rows, columns) | °C, row 0 at the top, without the sensor's steps |
//! | `time_s` | float64 | (N) | seconds since the scene's start |
//! | `thermistor_c` | float32 | (N) | °C, the room's temperature |
//! | `metadata` | str | () | JSON: scene, sensor, seed, sampling_hz, program |

use super::Film;
use crate::exit::bad_input;
use anyhow::{Result, anyhow};
use std::io::Write;

/// Bytes of an archive without the 64-bit extension.
const ARCHIVE_BYTES_MAX: u64 = 0xffff_0000;

/// Writes the archive frame by frame.
pub(super) fn write(film: &Film<'_>, out: &mut dyn Write, tick: &dyn Fn()) -> Result<String> {
    let (columns, rows) = (size(film.columns)?, size(film.rows)?);
    let count = u64::from(film.frames);
    check_size(count, columns * rows)?;
    let mut archive = Archive::new(out);
    let shape = format!("({count}, {rows}, {columns})");
    archive.begin("frames.npy", &header("<f4", &shape))?;
    let mut times_s = Vec::new();
    for index in 0..film.frames {
        let (time, image) = (film.frame)(index);
        times_s.push(time.as_secs_f64());
        for celsius in image.celsius {
            archive.add(&single(celsius).to_le_bytes())?;
        }
        tick();
    }
    archive.end()?;
    archive.begin("time_s.npy", &header("<f8", &format!("({count},)")))?;
    for time_s in times_s {
        archive.add(&time_s.to_le_bytes())?;
    }
    archive.end()?;
    archive.begin("thermistor_c.npy", &header("<f4", &format!("({count},)")))?;
    for _ in 0..film.frames {
        archive.add(&film.ambient.get().to_le_bytes())?;
    }
    archive.end()?;
    let metadata = metadata(film);
    let characters = metadata.chars().count();
    archive.begin("metadata.npy", &header(&format!("<U{characters}"), "()"))?;
    for character in metadata.chars() {
        archive.add(&u32::from(character).to_le_bytes())?;
    }
    archive.end()?;
    archive.finish()?;
    Ok(format!("{count} frames"))
}

fn size(pixels: usize) -> Result<u64> {
    Ok(u64::try_from(pixels)?)
}

fn check_size(frames: u64, pixels: u64) -> Result<()> {
    let per_frame = pixels * 4 + 8 + 4;
    let frames_max = (ARCHIVE_BYTES_MAX - ARCHIVE_EXTRA) / per_frame;
    if frames <= frames_max {
        return Ok(());
    }
    Err(bad_input(anyhow!(
        "{frames} frames of {pixels} pixels are more than an .npz archive of 4 GB holds\nhint: write at most {frames_max} with --frames"
    )))
}

fn metadata(film: &Film<'_>) -> String {
    serde_json::json!({
        "scene": film.scene,
        "sensor": film.sensor,
        "seed": film.seed,
        "sampling_hz": film.sampling_hz,
        "program": concat!("grideye ", env!("CARGO_PKG_VERSION")),
    })
    .to_string()
}

/// Magic, version 1.0, and a dictionary that is padded so that the numbers begin at a multiple of 64.
pub(crate) fn header(dtype: &str, shape: &str) -> Vec<u8> {
    let mut dictionary =
        format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': {shape}, }}");
    let prefix = 10;
    let whole = (prefix + dictionary.len() + 1).next_multiple_of(64);
    while prefix + dictionary.len() + 1 < whole {
        dictionary.push(' ');
    }
    dictionary.push('\n');
    let length = u16::try_from(dictionary.len()).unwrap_or(u16::MAX);
    [
        b"\x93NUMPY\x01\x00".as_slice(),
        &length.to_le_bytes(),
        dictionary.as_bytes(),
    ]
    .concat()
}

#[expect(
    clippy::as_conversions,
    clippy::cast_possible_truncation,
    reason = "single precision is what the format has, 2 µK at 20 °C"
)]
pub(crate) const fn single(celsius: f64) -> f32 {
    celsius as f32
}

/// A zip archive of stored files whose length is known only at their end.
pub(crate) struct Archive<W> {
    out: W,
    written: u64,
    entries: Vec<Entry>,
}

struct Entry {
    name: &'static str,
    offset: u64,
    length: u64,
    /// CRC-32 of ISO 3309, which zip and PNG share.
    crc: crc32fast::Hasher,
}

impl Entry {
    fn checksum(&self) -> [u8; 4] {
        self.crc.clone().finalize().to_le_bytes()
    }
}

impl<W: Write> Archive<W> {
    /// An archive without files.
    pub(crate) const fn new(out: W) -> Self {
        Self {
            out,
            written: 0,
            entries: Vec::new(),
        }
    }

    /// Begins a file of that name with these bytes.
    pub(crate) fn begin(&mut self, name: &'static str, head: &[u8]) -> Result<()> {
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

    /// More of the file that was begun last.
    pub(crate) fn add(&mut self, bytes: &[u8]) -> Result<()> {
        if let Some(entry) = self.entries.last_mut() {
            entry.crc.update(bytes);
            entry.length += u64::try_from(bytes.len())?;
        }
        self.put(bytes)
    }

    /// Ends the file that was begun last.
    pub(crate) fn end(&mut self) -> Result<()> {
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

    /// Ends the archive.
    pub(crate) fn finish(mut self) -> Result<()> {
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

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
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
/// Headers, names and metadata, generously.
const ARCHIVE_EXTRA: u64 = 1 << 20;

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
        // numpy.save of numpy.zeros((3, 8, 8), numpy.float32): 128 bytes before the numbers.
        let head = header("<f4", "(3, 8, 8)");
        assert_eq!(head.len(), 128);
        assert!(head.starts_with(
            b"\x93NUMPY\x01\x00v\x00{'descr': '<f4', 'fortran_order': False, 'shape': (3, 8, 8), }"
        ));
        assert!(head.ends_with(b" \n"));
    }

    #[test]
    fn more_than_an_archive_holds_is_refused_with_the_number_that_fits() {
        assert!(check_size(16_100_000, 64).is_err());
        let error = format!("{:#}", check_size(u64::from(u32::MAX), 64).unwrap_err());
        let fits: u64 = error
            .rsplit("at most ")
            .next()
            .unwrap()
            .split(' ')
            .next()
            .unwrap()
            .parse()
            .unwrap();
        check_size(fits, 64).unwrap();
        check_size(fits + 1, 64).unwrap_err();
        assert!(fits * (64 * 4 + 12) < 1 << 32);
    }
}
