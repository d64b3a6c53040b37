//! Shared by the requests about recordings: numbers, texts, and file names.

use crate::http::refusal::Refusal;
use crate::percent::percent_encoded;
use crate::store::RecordingId;
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use grideye_recording::is_hidden;
use serde_json::{Map, Value};

pub(super) fn parse_id(text: &str) -> Result<RecordingId, Refusal> {
    text.parse().map_err(|_not_a_number| {
        Refusal::new(
            StatusCode::NOT_FOUND,
            "no_such_recording",
            "recordings are known by number",
        )
        .hint("GET /v1/recordings lists them")
    })
}

/// The text of a field, trimmed.
pub(super) fn text_of(
    fields: &Map<String, Value>,
    field: &'static str,
    hint: &str,
) -> Result<String, Refusal> {
    let text = fields.get(field).and_then(Value::as_str);
    let what = || format!("expected {field} to be a string");
    let text = text.ok_or_else(|| Refusal::wrong_value(field, what(), hint))?;
    Ok(text.trim().to_owned())
}

/// Checks a text for people: at most `chars_max` characters, none of them hidden.
pub(super) fn check_text(what: &str, text: &str, chars_max: usize) -> Result<(), String> {
    let chars = text.chars().count();
    if chars > chars_max {
        return Err(format!(
            "the {what} has {chars} characters; at most {chars_max} are allowed"
        ));
    }
    match text.chars().find(|character| is_hidden(*character)) {
        Some(character) => Err(format!("the {what} may not contain {character:?}")),
        None => Ok(()),
    }
}

/// The headers of a CSV file with this name.
pub(super) fn csv_headers(name: &str, extension: &str) -> [(HeaderName, HeaderValue); 2] {
    let kind = HeaderValue::from_static("text/csv; charset=utf-8; header=present");
    let name = attachment(name, extension);
    [
        (header::CONTENT_TYPE, kind),
        (header::CONTENT_DISPOSITION, name),
    ]
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "it stands where map_err wants a function of the error"
)]
pub(crate) fn not_written(error: impl ToString) -> Refusal {
    let status = StatusCode::INTERNAL_SERVER_ERROR;
    Refusal::new(status, "not_written", error.to_string())
}

/// The header `content-disposition`: a plain name for old programs, the exact one for others (RFC 6266).
#[must_use]
pub fn attachment(name: &str, extension: &str) -> HeaderValue {
    let plain: String = name
        .chars()
        .map(|character| match character {
            ' '..='~' if character != '%' => character,
            _ => '_',
        })
        .collect();
    let exact = percent_encoded(name.as_bytes(), b"-._~");
    let disposition = format!(
        r#"attachment; filename="{plain}.{extension}"; filename*=UTF-8''{exact}.{extension}"#
    );
    HeaderValue::from_str(&disposition).unwrap_or(HeaderValue::from_static("attachment"))
}
