//! Why a script cannot be followed.

use alloc::string::String;
use core::fmt;

/// The most rules in one script.
pub const RULES_MAX: usize = 100;
/// The longest script that is read.
pub const SCRIPT_BYTES_MAX: usize = 1 << 20;

/// Where in a script something stands: what the script was called, the line, and the character in it, from 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place(pub String, pub usize, pub usize);

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(origin, line, column) = self;
        write!(formatter, "{origin}:{line}:{column}")
    }
}

/// Why a script cannot be followed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScriptError {
    /// It is no TOML, or has a key that no script has, or a value of another type: where, and what the parser says.
    Malformed(Place, String),
    /// A field of a fault cannot be what it is.
    Field {
        /// Where.
        place: Place,
        /// Which of the faults, from 1.
        number: usize,
        /// The field's name.
        field: &'static str,
        /// What is wrong.
        problem: String,
        /// What to write instead.
        hint: String,
    },
    /// The rule of this number, from 1, which was made in Rust, cannot be, and why.
    Rule(usize, &'static str),
    /// So many rules are more than [`RULES_MAX`].
    TooManyRules(usize),
    /// The text of this origin has so many bytes, which are more than are read.
    TooLong(String, usize),
}

impl fmt::Display for ScriptError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed(place, problem) => write!(formatter, "{place}: {problem}"),
            Self::Field {
                place,
                number,
                field,
                problem,
                hint,
            } => write!(
                formatter,
                "{place}: fault {number}, `{field}`: {problem}\nhint: {hint}"
            ),
            Self::Rule(number, problem) => write!(formatter, "rule {number}: {problem}"),
            Self::TooManyRules(found) => write!(
                formatter,
                "{found} rules are more than the {RULES_MAX} of a script\nhint: give each bus a script of its own"
            ),
            Self::TooLong(origin, bytes) => write!(
                formatter,
                "{origin}: {bytes} bytes are more than the {SCRIPT_BYTES_MAX} of a script\nhint: this is some other file"
            ),
        }
    }
}

impl core::error::Error for ScriptError {}
