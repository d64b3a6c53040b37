//! Way 3 where FUSE is not allowed: a preloaded library that answers for `/dev/i2c-N`.

use std::process::Command;

use crate::fuse::Ended;
use crate::ioctl::AdapterMode;
use crate::rack::Rack;

/// Why a program cannot be run with a preloaded library.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// This program was built without the library.
    #[error("this build carries no library to preload\nhint: use FUSE")]
    NoLibrary,
}

/// Tells whether preloading can reach this program, without starting it.
///
/// # Errors
/// What stands in the way.
pub fn check(_command: &Command) -> Result<(), RunError> {
    Err(RunError::NoLibrary)
}

pub(crate) fn run_rack(
    _rack: &Rack,
    _mode: AdapterMode,
    _command: &mut Command,
    _started: &(dyn Fn(u32) + Sync),
) -> Result<Ended, RunError> {
    Err(RunError::NoLibrary)
}
