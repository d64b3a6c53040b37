//! How much a file may become, in proportion to its own bytes: a small file must not take the memory and the time of a large one.

use crate::error::ImportError;
use grideye_recording::is_known_size;
use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that even the smallest file may become.
const FREE_BYTES: u64 = 64 << 20;
/// Bytes that each byte of a file may become besides.
const BYTES_PER_BYTE: u64 = 32;
/// What a value counts that is read and forgotten: as much as its text.
pub(crate) const VALUE_BYTES: u64 = 4;
/// What a value counts that stays until the file has been read.
pub(crate) const HELD_VALUE_BYTES: u64 = 16;
/// Values of a row. The largest sensor that is known by its size has more only as an image.
pub(crate) const ROW_VALUES_MAX: usize = 4_096;
const MIB: u64 = 1 << 20;

/// What was read of a file itself, and what that became; clones count together.
#[derive(Debug, Clone, Default)]
pub(crate) struct Allowance {
    read: Arc<AtomicU64>,
    became: Arc<AtomicU64>,
}

/// The file became more than it may.
#[derive(Debug, thiserror::Error)]
#[error("more than {most_bytes} bytes, which are {} MiB and {BYTES_PER_BYTE} for each of the file's own {read_bytes}", FREE_BYTES / MIB)]
struct Exceeded {
    most_bytes: u64,
    read_bytes: u64,
}

impl Allowance {
    /// The file itself, whose bytes are counted as they are read.
    pub(crate) fn of_file<R: Read>(&self, input: R) -> Counted<R> {
        Counted {
            input,
            allowance: self.clone(),
            is_file: true,
        }
    }

    /// What is unpacked of it. No heading is believed: the bytes are counted as they come.
    pub(crate) fn of_unpacked<R: Read>(&self, input: R) -> Counted<R> {
        Counted {
            is_file: false,
            ..self.of_file(input)
        }
    }

    /// Counts what the file becomes.
    ///
    /// # Errors
    /// [`io::ErrorKind::FileTooLarge`] if it is more than it may be.
    pub(crate) fn take(&self, bytes: u64) -> io::Result<()> {
        let read_bytes = self.read.load(Ordering::Relaxed);
        let most_bytes = FREE_BYTES.saturating_add(BYTES_PER_BYTE.saturating_mul(read_bytes));
        let before = self
            .became
            .fetch_add(bytes.min(most_bytes + 1), Ordering::Relaxed);
        if before.saturating_add(bytes) <= most_bytes {
            return Ok(());
        }
        let exceeded = Exceeded {
            most_bytes,
            read_bytes,
        };
        Err(io::Error::new(io::ErrorKind::FileTooLarge, exceeded))
    }

    /// Counts values, and says where they are too many.
    pub(crate) fn take_values(
        &self,
        values: usize,
        bytes: u64,
        place: impl FnOnce() -> String,
    ) -> Result<(), ImportError> {
        let values = u64::try_from(values).unwrap_or(u64::MAX);
        let taken = self.take(values.saturating_mul(bytes));
        taken.map_err(|error| ImportError::unread(place(), &error))
    }
}

/// A reader that counts.
pub(crate) struct Counted<R> {
    input: R,
    allowance: Allowance,
    is_file: bool,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.input.read(buffer)?;
        let bytes = u64::try_from(count).unwrap_or(u64::MAX);
        if self.is_file {
            self.allowance.read.fetch_add(bytes, Ordering::Relaxed);
        } else {
            self.allowance.take(bytes)?;
        }
        Ok(count)
    }
}

/// A row of more values than one has.
pub(crate) fn too_wide(found: usize, place: &str) -> ImportError {
    // A few numbers may stand beside the pixels of another sensor.
    let mut sizes = (0..4).map(|beside| found.saturating_sub(beside));
    match sizes.find(|pixels| is_known_size(*pixels)) {
        Some(found) => ImportError::other_sensor(found),
        None => ImportError::unlike(
            &format!("at most {ROW_VALUES_MAX} values in a row"),
            format!("{found} {place}"),
            "keep the columns of the time, of the 64 pixels and whatever else is needed",
        ),
    }
}
