//! Why a profile is refused.

use crate::text::place::Place;

/// Why a profile was refused: each names the place, what was found there, what was expected and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("{place}: {message}\nhint: {hint}")]
    Malformed {
        /// Where.
        place: Place,
        /// What the TOML reader says of it.
        message: String,
        /// What to do.
        hint: &'static str,
    },
    /// A value that a sensor cannot have: out of range, or not a number.
    #[error("{place}: `{key}` is {found}, expected {expected}\nhint: {hint}")]
    Value {
        /// Where.
        place: Place,
        /// The key, with its table.
        key: &'static str,
        /// The value in the file.
        found: String,
        /// The values there may be.
        expected: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// A list that has not one number for each pixel.
    #[error("{place}: `{key}` has {found} numbers, expected 64\nhint: {hint}")]
    Length {
        /// Where the list begins.
        place: Place,
        /// The key, with its table.
        key: &'static str,
        /// How many numbers there are.
        found: usize,
        /// What to do.
        hint: &'static str,
    },
    /// A key that another key needs.
    #[error("{place}: `{key}` needs `{missing}` beside it\nhint: {hint}")]
    MissingKey {
        /// The place of the key that needs the other.
        place: Place,
        /// That key, with its table.
        key: &'static str,
        /// The key that is missing.
        missing: &'static str,
        /// What to do.
        hint: &'static str,
    },
    /// More text than any profile has.
    #[error(
        "{file}: {found} bytes of text, expected at most {limit}\nhint: is it a sensor profile at all?"
    )]
    TooLong {
        /// The file, as the caller named it.
        file: String,
        /// Bytes found.
        found: usize,
        /// The limit, [`TEXT_BYTES_MAX`](super::TEXT_BYTES_MAX).
        limit: usize,
    },
}
