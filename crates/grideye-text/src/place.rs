//! Places in a file, and problems found there.

use std::fmt;

/// A place in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file as named by the caller or by another file.
    pub file: Box<str>,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

impl Place {
    /// The start of a line, from 1.
    #[must_use]
    pub fn of_line(file: &str, line: usize) -> Self {
        let (file, column) = (file.into(), 1);
        Self { file, line, column }
    }

    /// The place of a byte of the file's text; beyond it, its end.
    #[must_use]
    pub fn of_byte(file: &str, text: &str, byte: usize) -> Self {
        let before = text.get(..byte).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Self {
            file: file.into(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    /// A problem here, and how to fix it.
    #[must_use]
    pub fn refused(self, problem: String, hint: &str) -> Refusal {
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
#[must_use]
pub fn excerpt(text: &str) -> String {
    let mut excerpt: String = text.chars().take(EXCERPT_CHARACTERS_MAX).collect();
    if excerpt.len() < text.len() {
        excerpt.push('…');
    }
    excerpt.replace(char::is_control, " ")
}

const EXCERPT_CHARACTERS_MAX: usize = 60;
