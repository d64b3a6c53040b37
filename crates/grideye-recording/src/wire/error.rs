//! Why a body is rejected, in terms of its fields.

use crate::text::shortened;
use std::fmt::Display;

grideye_frame::named! {
    /// What kind of fault a body has, with its name in the collector's answer.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum WireFault {
        /// Not JSON, or cut short.
        NotJson = "not_json";
        /// Not the compact form, or cut short.
        Malformed = "malformed";
        /// A field unknown to the format.
        UnknownField = "unknown_field";
        /// A required field is absent.
        MissingField = "missing_field";
        /// A field or key occurs twice.
        Repeated = "repeated";
        /// A value of the wrong type, range, order or number of elements.
        WrongValue = "wrong_value";
        /// More elements than the receiver accepts in one body.
        TooMany = "too_many";
    }
}

/// Why a body was rejected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {what}")]
pub struct WireError {
    /// The kind of fault.
    pub fault: WireFault,
    /// The field's place, for example `sensors[0].frames[3].pixels_raw[63]`; `body` for the whole.
    pub path: String,
    /// What belongs there, and what is there, which quotes the sender, escaped and cut.
    pub what: String,
}

impl WireError {
    pub(super) fn new(fault: WireFault, path: String, what: impl Into<String>) -> Self {
        let what = what.into();
        Self { fault, path, what }
    }

    pub(super) fn wrong_value(path: String, expected: &str, found: impl Display) -> Self {
        let what = format!("expected {expected}, found {found}");
        Self::new(WireFault::WrongValue, path, what)
    }

    /// `limit` says what it counts, for example `4096 frames in all`.
    pub(super) fn too_many(path: String, limit: &str) -> Self {
        let what = format!("expected at most {limit}, found more\nhint: send smaller batches");
        Self::new(WireFault::TooMany, path, what)
    }

    pub(super) fn repeated(path: String) -> Self {
        let what = "expected at most once, found twice";
        Self::new(WireFault::Repeated, path, what)
    }

    pub(super) fn not_json(path: String, error: &serde_json::Error, found: &str) -> Self {
        let (line, column) = (error.line(), error.column());
        let what = format!("expected JSON, found a fault at line {line} column {column}: {found}");
        Self::new(WireFault::NotJson, path, what)
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
            return Self::not_json(path, error, &shortened(message));
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
        return WireError::too_many(path, limit);
    }
    if let Some(field) = message.strip_prefix("missing field ") {
        let what = "expected a value, found none";
        return WireError::new(WireFault::MissingField, below(&path, field), what);
    }
    if let Some(field) = message.strip_prefix("duplicate field ") {
        return WireError::repeated(below(&path, field));
    }
    let (found, expected) = message
        .rsplit_once(", expected ")
        .unwrap_or((message, "a value of the format"));
    if found.starts_with("unknown field") {
        let what = format!("expected {expected}, found an unknown field");
        return WireError::new(WireFault::UnknownField, path, what);
    }
    let found = ["invalid type: ", "invalid value: ", "invalid length "]
        .iter()
        .find_map(|beginning| found.strip_prefix(beginning))
        .unwrap_or(found);
    WireError::wrong_value(path, expected, shortened(found))
}

/// The path of the field that a message names in backticks.
fn below(parent: &str, field: &str) -> String {
    let field = shortened(field.trim_matches('`'));
    visible(match parent {
        "body" => field,
        _ => format!("{parent}.{field}"),
    })
}
