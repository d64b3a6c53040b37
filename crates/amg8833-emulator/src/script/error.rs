//! Why a script cannot be followed.

use alloc::string::String;
use core::fmt;

/// The most rules in one script.
pub const RULES_MAX: usize = 100;

/// Where in a script something stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// What the script was called when it was read, a file name as a rule.
    pub origin: String,
    /// The line, from 1.
    pub line: usize,
    /// The character in the line, from 1.
    pub column: usize,
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}:{}", self.origin, self.line, self.column)
    }
}

/// Why a script cannot be followed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScriptError {
    /// It is no TOML, or has a key that no script has, or a value of another type.
    Malformed {
        /// Where.
        place: Place,
        /// What the parser says.
        problem: String,
    },
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
    /// A rule that was made in Rust cannot be.
    Rule {
        /// Which, from 1.
        number: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// There are more than [`RULES_MAX`] rules.
    TooManyRules {
        /// How many there are.
        found: usize,
    },
    /// The text is longer than any script has to be.
    TooLong {
        /// What the script was called.
        origin: String,
        /// Its length in bytes.
        bytes: usize,
        /// The most that is read.
        bytes_max: usize,
    },
}

impl fmt::Display for ScriptError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Malformed { place, problem } => write!(formatter, "{place}: {problem}"),
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
            Self::Rule { number, problem } => write!(formatter, "rule {number}: {problem}"),
            Self::TooManyRules { found } => write!(
                formatter,
                "{found} rules are more than the {RULES_MAX} of a script\nhint: give each bus a script of its own"
            ),
            Self::TooLong {
                origin,
                bytes,
                bytes_max,
            } => write!(
                formatter,
                "{origin}: {bytes} bytes are more than the {bytes_max} of a script\nhint: this is some other file"
            ),
        }
    }
}

impl core::error::Error for ScriptError {}
