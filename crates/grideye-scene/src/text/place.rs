//! Where something stands in a file, what is wrong with it, and lengths as messages have them.

use glam::DVec3;
use std::fmt;

/// A place in a file: line and column count from 1, columns in characters.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file as the caller named it, or as the scene names it.
    pub file: Box<str>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Place {
    /// The beginning of a line.
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

/// What is wrong at a place in a file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{place}: {problem}\nhint: {hint}")]
pub struct Refusal {
    /// Where.
    pub place: Place,
    /// What was found, and mostly what was expected.
    pub problem: String,
    /// What to do.
    pub hint: String,
}

/// The beginning of what a file has in a place, on one line.
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
    // To a thousandth: what is left of a rotation's rounding would only hide the number.
    let micrometers = (meters * MM_PER_M * 1000.0).round();
    let [x, y, z] = micrometers.to_array().map(|number| number / 1000.0 + 0.0);
    format!("[{x}, {y}, {z}]")
}
