//! The errors of the folder of tokens.

use crate::auth::limits::{DEVICES_PER_TOKEN_MAX, TOKEN_NAME_CHARS_MAX, TOKENS_MAX};
use std::io;
use std::path::{Path, PathBuf};

pub(super) type Result<T, E = AccessError> = core::result::Result<T, E>;

/// Why the folder of tokens cannot be used, or a change was rejected.
#[derive(Debug, thiserror::Error)]
pub enum AccessError {
    /// A file operation failed.
    #[error(
        "{}: {reason}\nhint: the folder of tokens must belong to the user that runs the collector", .path.display()
    )]
    File {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        reason: io::Error,
    },
    /// A file does not hold what this program wrote.
    #[error(
        "{}: {what}\nhint: restore a copy of the file, or move the folder away and enroll again", .path.display()
    )]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// No randomness, or the key could not be created.
    #[error("cannot create a key: {0}\nhint: check that the system has a source of random numbers")]
    NoKey(String),
    /// The limit on tokens is reached.
    #[error(
        "the folder already holds the maximum of {TOKENS_MAX} tokens\nhint: `grideye token list` shows them; use a separate folder for another site"
    )]
    TooManyTokens,
    /// Too few or too many devices for a token.
    #[error(
        "a token speaks for 1 to {DEVICES_PER_TOKEN_MAX} devices, found {0}\nhint: enroll the others with another token"
    )]
    DevicesPerToken(usize),
    /// An invalid name for a device or a token.
    #[error(
        "{name:?} cannot be the name of a {of}: expected 1 to {TOKEN_NAME_CHARS_MAX} letters, digits, and - _ . :, beginning with a letter or a digit\nhint: for example pi-1"
    )]
    BadName {
        /// What was named: device or token.
        of: &'static str,
        /// The name.
        name: String,
    },
    /// No valid token has this number or name.
    #[error("no token {0:?} is in use\nhint: `grideye token list` shows them")]
    NoSuchToken(String),
}

impl AccessError {
    pub(super) fn file(path: &Path) -> impl FnOnce(io::Error) -> Self + '_ {
        move |reason| Self::File {
            path: path.to_owned(),
            reason,
        }
    }

    pub(super) fn malformed(path: &Path, what: impl Into<String>) -> Self {
        Self::Malformed {
            path: path.to_owned(),
            what: what.into(),
        }
    }
}
