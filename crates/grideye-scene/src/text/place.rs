//! Places in a file, problems found there, and lengths formatted for messages.

use glam::DVec3;
use std::fmt;

/// A place in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file as named by the caller or by the scene.
    pub file: Box<str>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Place {
    pub(crate) fn of_line(file: &str, line: usize) -> Self {
        let (file, column) = (file.into(), 1);
        Self { file, line, column }
    }

    pub(crate) fn of_byte(file: &str, text: &str, byte: usize) -> Self {
        let before = text.get(..byte).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Self {
            file: file.into(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    pub(crate) fn refused(self, problem: String, hint: &str) -> Refusal {
        Refusal {
            place: self,
            problem,
            hint: hint.to_owned(),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}:{}", self.file, self.line, self.column)
    }
}

/// A problem at a place in a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}\nhint: {hint}")]
pub struct Refusal {
    /// Where it is.
    pub place: Place,
    /// What was found, and usually what was expected.
    pub problem: String,
    /// How to fix it.
    pub hint: String,
}

/// The start of a text, on one line.
pub(crate) fn excerpt(text: &str) -> String {
    let mut excerpt: String = text.chars().take(EXCERPT_CHARACTERS_MAX).collect();
    if excerpt.len() < text.len() {
        excerpt.push('…');
    }
    excerpt.replace(char::is_control, " ")
}

const EXCERPT_CHARACTERS_MAX: usize = 60;

pub(crate) const MM_PER_M: f64 = 1000.0;

pub(crate) fn reach((low, high): (DVec3, DVec3)) -> String {
    format!("from {} to {}", millimeters(low), millimeters(high))
}

pub(crate) fn millimeters(meters: DVec3) -> String {
    // Round to a thousandth of a millimeter, because rounding errors of rotations would only obscure the number.
    let micrometers = (meters * MM_PER_M * 1000.0).round();
    let [x, y, z] = micrometers.to_array().map(|number| number / 1000.0 + 0.0);
    format!("[{x}, {y}, {z}]")
}
