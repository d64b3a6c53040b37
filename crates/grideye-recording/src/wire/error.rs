//! Why a body is rejected, in terms of its fields.

use crate::text::shortened;

/// Why a body was rejected. `path` is the field's place or `body`; `found` quotes the sender, escaped and cut.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WireError {
    /// Not JSON, or cut short.
    #[error("{path}: expected JSON, found a fault at line {line} column {column}: {found}")]
    NotJson {
        /// The last place that was read.
        path: String,
        /// Line of the fault, from 1.
        line: usize,
        /// Column of the fault, from 1.
        column: usize,
        /// What is wrong there.
        found: String,
    },
    /// Not the compact form, or cut short.
    #[error("{path}: expected {expected} at byte {offset}, found {found}")]
    Malformed {
        /// The field.
        path: String,
        /// Offset in the body, from 0.
        offset: usize,
        /// What belongs there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A field unknown to the format.
    #[error("{path}: expected {expected}, found an unknown field")]
    UnknownField {
        /// The field.
        path: String,
        /// The known fields.
        expected: String,
    },
    /// A required field is absent.
    #[error("{path}: expected a value, found none")]
    MissingField {
        /// The field.
        path: String,
    },
    /// A field or key occurs twice.
    #[error("{path}: expected at most once, found twice")]
    Repeated {
        /// The field.
        path: String,
    },
    /// A value of the wrong type, range, order or number of elements.
    #[error("{path}: expected {expected}, found {found}")]
    WrongValue {
        /// The field.
        path: String,
        /// What belongs there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// More elements than the receiver accepts in one body.
    #[error("{path}: expected at most {limit}, found more\nhint: send smaller batches")]
    TooMany {
        /// The field.
        path: String,
        /// The limit and what it counts, for example `4096 frames in all`.
        limit: String,
    },
}

impl WireError {
    /// The field's place, for example `sensors[0].frames[3].pixels_raw[63]`; `body` for the whole.
    #[must_use]
    pub fn path(&self) -> &str {
        match self {
            Self::NotJson { path, .. }
            | Self::Malformed { path, .. }
            | Self::UnknownField { path, .. }
            | Self::MissingField { path }
            | Self::Repeated { path }
            | Self::WrongValue { path, .. }
            | Self::TooMany { path, .. } => path,
        }
    }

    /// Translates the parser's error at this place.
    pub(super) fn from_parser(
        place: &serde_path_to_error::Path,
        error: &serde_json::Error,
    ) -> Self {
        let path = shown(place);
        let whole = error.to_string();
        let position = format!(" at line {} column {}", error.line(), error.column());
        let message = whole.strip_suffix(&position).unwrap_or(&whole);
        if !error.is_data() {
            return Self::NotJson {
                path,
                line: error.line(),
                column: error.column(),
                found: shortened(message),
            };
        }
        from_message(path, message)
    }
}

/// How [`values`](super::values) begins the message of a limit.
pub(super) const TOO_MANY: &str = "too many, expected at most ";

/// Maximum path in an error, because map keys are untrusted.
const PATH_CHARS_MAX: usize = 160;

fn shown(place: &serde_path_to_error::Path) -> String {
    let path: String = place
        .to_string()
        .chars()
        .take(PATH_CHARS_MAX)
        .flat_map(|character| match character {
            ' '..='~' => vec![character],
            _ => character.escape_default().collect(),
        })
        .collect();
    match path.as_str() {
        "." => "body".to_owned(),
        _ => visible(path),
    }
}

/// Shows an empty field name as `""`, so that its path does not look like its parent's.
fn visible(mut path: String) -> String {
    if path.is_empty() || path.ends_with('.') {
        path.push_str("\"\"");
    }
    path
}

/// Distinguishes serde's messages by their beginnings, which its trait `de::Error` defines.
fn from_message(path: String, message: &str) -> WireError {
    if let Some(limit) = message.strip_prefix(TOO_MANY) {
        return WireError::TooMany {
            path,
            limit: limit.to_owned(),
        };
    }
    if let Some(field) = message.strip_prefix("missing field ") {
        return WireError::MissingField {
            path: below(&path, field),
        };
    }
    if let Some(field) = message.strip_prefix("duplicate field ") {
        return WireError::Repeated {
            path: below(&path, field),
        };
    }
    let (found, expected) = message
        .rsplit_once(", expected ")
        .unwrap_or((message, "a value of the format"));
    if found.starts_with("unknown field") {
        return WireError::UnknownField {
            path,
            expected: expected.to_owned(),
        };
    }
    let found = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|beginning| found.strip_prefix(beginning))
        .unwrap_or(found);
    WireError::WrongValue {
        path,
        expected: expected.to_owned(),
        found: shortened(found),
    }
}

/// The path of the field that a message names in backticks.
fn below(parent: &str, field: &str) -> String {
    let field = shortened(field.trim_matches('`'));
    visible(match parent {
        "body" => field,
        _ => format!("{parent}.{field}"),
    })
}
