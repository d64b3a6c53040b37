//! The library that this program carries inside itself, as a file without a name.

use std::io;
use std::os::fd::{AsRawFd, OwnedFd};

use super::error::RunError;
use crate::sys;

#[cfg(preload_library)]
const BYTES: Option<&[u8]> = Some(include_bytes!(env!("I2C_EMULATION_LIBRARY")));
#[cfg(not(preload_library))]
const BYTES: Option<&[u8]> = None;
/// Why there is none, if there is none.
const REASON: &str = env!("I2C_EMULATION_NO_LIBRARY");

/// The descriptor's number is at least this: should another process get this one's number later, it is unlikely to have
/// a file open there.
const DESCRIPTOR_MIN: i32 = 700;

/// The bytes of the library.
pub(super) fn bytes() -> Result<&'static [u8], RunError> {
    BYTES.ok_or(RunError::NoLibrary { reason: REASON })
}

/// The library in memory, under a path for as long as this lives: of a process that was killed nothing is left.
pub(super) struct Library(OwnedFd);

impl Library {
    pub(super) fn new() -> Result<Self, RunError> {
        let failed = |source: io::Error| RunError::Setup {
            step: "writing the library into memory",
            source,
        };
        let file = sys::memory_file(c"i2c-emulation-preload", bytes()?).map_err(failed)?;
        Ok(Self(sys::move_up(file, DESCRIPTOR_MIN)))
    }

    /// What the loader of programs finds it at.
    pub(super) fn path(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.0.as_raw_fd())
    }
}
