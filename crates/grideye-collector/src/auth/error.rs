//! The errors of the folder of tokens.

use std::fmt::Display;
use std::io;
use std::path::Path;

pub(super) type Result<T, E = AccessError> = core::result::Result<T, E>;

/// Why the folder of tokens cannot be used, or a change was rejected.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// A name, a number or a list of devices that was given is wrong.
    #[error("{0}")]
    Refused(String),
    /// The folder cannot be used: a file of it, randomness or room is missing.
    #[error("{0}")]
    Failed(String),
}

impl AccessError {
    /// A file operation failed.
    pub(super) fn file(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        let hint = "the folder of tokens must belong to the user that runs the collector";
        move |reason| Self::Failed(format!("{}: {reason}\nhint: {hint}", path.display()))
    }

    /// A file does not hold what this program wrote.
    pub(super) fn malformed(path: &Path, what: impl Display) -> Self {
        let hint = "restore a copy of the file, or move the folder away and enroll again";
        Self::Failed(format!("{}: {what}\nhint: {hint}", path.display()))
    }

    /// No randomness, or the key could not be created.
    pub(super) fn no_key(what: &impl Display) -> Self {
        let hint = "check that the system has a source of random numbers";
        Self::Failed(format!("cannot create a key: {what}\nhint: {hint}"))
    }
}
