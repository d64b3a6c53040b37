//! The library embedded in this program, as an unnamed file.

use crate::run::{PRELOAD_NEEDS, RunError, setup_failed};
use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, memfd_create};
use rustix::io::fcntl_dupfd_cloexec;
use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsRawFd, OwnedFd};

#[cfg(preload_library)]
const BYTES: Option<&[u8]> = Some(include_bytes!(env!("I2C_EMULATION_LIBRARY")));
#[cfg(not(preload_library))]
const BYTES: Option<&[u8]> = None;
/// Why this build has no library, if so.
const REASON: &str = env!("I2C_EMULATION_NO_LIBRARY");

/// The lowest descriptor number: if another process later gets this process's number, it is unlikely to have a file
/// open there.
const DESCRIPTOR_MIN: i32 = 700;

pub(super) fn bytes() -> Result<&'static [u8], RunError> {
    BYTES.ok_or(RunError::NoLibrary(REASON))
}

/// The library in memory, with a path for as long as this lives. A killed process leaves nothing behind.
pub(super) struct Library(OwnedFd);

impl Library {
    pub(super) fn new() -> Result<Self, RunError> {
        let bytes = bytes()?;
        memory_file(bytes).map(Self).map_err(|source| {
            setup_failed("writing the library into memory", source, PRELOAD_NEEDS)
        })
    }

    /// The path for the program loader.
    pub(super) fn path(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.0.as_raw_fd())
    }
}

/// A file in memory with these bytes, sealed against changes.
fn memory_file(bytes: &[u8]) -> io::Result<OwnedFd> {
    let flags = MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING;
    let mut file = File::from(memfd_create(c"i2c-emulation-preload", flags)?);
    file.write_all(bytes)?;
    let no_change = SealFlags::WRITE | SealFlags::SHRINK | SealFlags::GROW;
    fcntl_add_seals(&file, no_change | SealFlags::SEAL)?;
    // If such a high number is not allowed, keep the original.
    Ok(fcntl_dupfd_cloexec(&file, DESCRIPTOR_MIN).unwrap_or_else(|_| file.into()))
}
